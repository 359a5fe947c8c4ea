// Writes the skull of a phantom in far finer triangles than the approximation needs, with the
// noise of a scanner, to see what a scan of such a size costs (docs/faces.md). Usage:
//   bench_fine_skull --out SKULL.ply [--triangles 20000000] [--seed 5000] [--noise 0.02]

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <vector>

#include "core/random.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/phantom/person.h"

namespace skullstation {
namespace {

constexpr double edge_mm = 1.4;

struct Options {
  std::string out;
  int triangles = 20'000'000;
  std::uint64_t seed = 5000;
  double noise_mm = 0.02;
};

/// Every triangle cut into four at the middles of its edges.
TriangleMesh quartered(const TriangleMesh& mesh) {
  struct Edge {
    int low = 0;
    int high = 0;
    Eigen::Index side = 0;  ///< 3 * triangle + its first corner
  };
  std::vector<Edge> edges;
  edges.reserve(static_cast<std::size_t>(mesh.triangles.size()));
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax({mesh.triangles(t, k), mesh.triangles(t, (k + 1) % 3)});
      edges.push_back({low, high, 3 * t + k});
    }
  }
  std::ranges::sort(edges, {}, [](const Edge& e) { return std::tuple(e.low, e.high, e.side); });
  TriangleMesh finer;
  std::vector<int> middle(edges.size());
  std::vector<Eigen::RowVector3d> middles;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Edge& e = edges[i];
    if (i == 0 || e.low != edges[i - 1].low || e.high != edges[i - 1].high) {
      middles.emplace_back(0.5 * (mesh.vertices.row(e.low) + mesh.vertices.row(e.high)));
    }
    middle[static_cast<std::size_t>(e.side)] =
        static_cast<int>(mesh.vertices.rows() + std::ssize(middles)) - 1;
  }
  finer.vertices.resize(mesh.vertices.rows() + std::ssize(middles), 3);
  finer.vertices.topRows(mesh.vertices.rows()) = mesh.vertices;
  for (std::size_t i = 0; i < middles.size(); ++i) {
    finer.vertices.row(mesh.vertices.rows() + static_cast<Eigen::Index>(i)) = middles[i];
  }
  finer.triangles.resize(4 * mesh.triangles.rows(), 3);
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const auto corner = mesh.triangles.row(t);
    const int* side = &middle[static_cast<std::size_t>(3 * t)];
    finer.triangles.row(4 * t) << corner[0], side[0], side[2];
    finer.triangles.row(4 * t + 1) << side[0], corner[1], side[1];
    finer.triangles.row(4 * t + 2) << side[2], side[1], corner[2];
    finer.triangles.row(4 * t + 3) << side[0], side[1], side[2];
  }
  return finer;
}

Result<void> run(const Options& options) {
  TriangleMesh skull = PersonMaker(edge_mm, 0).make(draw_person(options.seed), 0).skull;
  while (skull.triangles.rows() < options.triangles) skull = quartered(skull);
  Random random(options.seed);
  for (double& coordinate : skull.vertices.reshaped()) {
    coordinate += random.normal(0.0, options.noise_mm);
  }
  fmt::print("{} triangles\n", skull.triangles.rows());
  return write_mesh(skull, options.out);
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  skullstation::Options options;
  CLI::App app("A skull in very many triangles");
  app.add_option("--out", options.out, "PLY, OBJ or STL file")->required();
  app.add_option("--triangles", options.triangles, "at least")->check(CLI::Range(1, 500'000'000));
  app.add_option("--seed", options.seed, "of the person and the noise");
  app.add_option("--noise", options.noise_mm, "standard deviation of each coordinate [mm]");
  CLI11_PARSE(app, argc, argv);
  if (const auto done = skullstation::run(options); !done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return skullstation::exit_code(done.error().kind);
  }
  return 0;
}
