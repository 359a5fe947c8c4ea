#include "tests/unit/delivery/sealed_case.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "core/file.h"
#include "core/session/image_file.h"
#include "daemon/evidence/package.h"
#include "reconstruction/io/mesh_file.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation::testing {

namespace fs = std::filesystem;

namespace {

void check(const Result<void>& done) {
  if (!done) throw std::runtime_error(done.error().message());
}

void replace_all(std::string& text, const std::string& old, const std::string& now) {
  for (std::size_t at = text.find(old); at != std::string::npos; at = text.find(old, at)) {
    text.replace(at, old.size(), now);
  }
}

/// Another content, with its sum corrected in every JSON file that names it.
void replace_file(const fs::path& folder, const fs::path& file, const std::string& bytes) {
  const std::string old = sha256_of_file(file).value();
  check(write_file_durably(file, bytes));
  for (const char* name :
       {"session/session.json", "reconstruction/cameras.json", "case/case.json"}) {
    std::string text = read_file(folder / name).value();
    replace_all(text, old, sha256_hex(bytes));
    check(write_file_durably(folder / name, text));
  }
}

Image8 gradient() {
  Image8 image(64, 48, 3);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) image.at(x, y, x % 3) = static_cast<std::uint8_t>(4 * x + y);
  }
  return image;
}

TriangleMesh tetrahedron(double edge_mm) {
  TriangleMesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << 0, 0, 0, edge_mm, 0, 0, 0, edge_mm, 0, 0, 0, edge_mm;
  mesh.triangles.resize(4, 3);
  mesh.triangles << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
  return mesh;
}

/// A wavy sheet whose binary STL (50 bytes a triangle) has about so many bytes.
TriangleMesh sheet(std::size_t stl_bytes) {
  const int squares = static_cast<int>(std::sqrt(static_cast<double>(stl_bytes) / 100.0)) + 1;
  const int side = squares + 1;
  TriangleMesh mesh;
  mesh.vertices.resize(side * side, 3);
  mesh.triangles.resize(2 * squares * squares, 3);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      mesh.vertices.row(y * side + x) << 0.1 * x, 0.1 * y, std::sin(0.1 * x) * std::cos(0.1 * y);
      if (x == squares || y == squares) continue;
      const int corner = y * side + x;
      const int first = 2 * (y * squares + x);
      mesh.triangles.row(first) << corner, corner + 1, corner + side;
      mesh.triangles.row(first + 1) << corner + 1, corner + side + 1, corner + side;
    }
  }
  return mesh;
}

}  // namespace

SealedPackage seal_small_case(const fs::path& folder, std::size_t large_bytes) {
  PackageSource source = write_small_case(folder, large_bytes);
  check(
      write_mesh(large_bytes == 0 ? tetrahedron(100.0) : sheet(large_bytes), folder / "mesh.ply"));
  replace_file(folder, folder / "reconstruction/skull.ply", read_file(folder / "mesh.ply").value());
  check(write_mesh(tetrahedron(120.0), folder / "case/head.ply"));
  check(write_file_durably(folder / "case/report.pdf", "%PDF-1.4\nodd\n%%EOF\n.."));
  check(write_file_durably(folder / "case/large.bin", noise(large_bytes, 9)));
  // A JPEG, though its name says PNG: what counts is the content.
  replace_file(folder, folder / "session/images/p0_c0_000.png", encode_jpeg(gradient(), 90));
  replace_file(folder, folder / "session/images/p0_c0_001.png", encode_png(gradient()));
  const auto sealed = write_package(source, {test_keys(), std::nullopt, "test", {}},
                                    SimulatedClock(), folder / "package", 1);
  if (!sealed) throw std::runtime_error(sealed.error().message());
  return read_sealed_package(folder / "package").value();
}

}  // namespace skullstation::testing
