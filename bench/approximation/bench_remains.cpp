// Faces over what is left of skulls, beside the faces over the whole ones: phantoms that the model
// never saw, as Markdown tables (docs/faces.md). Usage:
//   bench_remains [--model FILE] [--people 10] [--seed 5000]
// A vertex of the head counts as observed if the bone nearest to it was; face, nose, lips, eyes and
// scalp count, ears and neck do not. Then the bone itself: the vertices that were missing, beside
// where the template's fit to the whole skull has them.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

#include "bench/approximation/remains.h"
#include "core/random.h"
#include "daemon/model/model_source.h"
#include "reconstruction/approximation/face_estimate.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/registration/point_tree.h"
#include "reconstruction/registration/similarity_fit.h"

namespace skullstation {
namespace {

constexpr double edge_mm = 2.0;

struct Options {
  std::string model;
  int people = 10;
  std::uint64_t seed = 5000;
};

/// A face and, for each vertex of its head, how far it is off and whether bone below was observed;
/// and the bone that it was made over.
struct JudgedFace {
  Eigen::VectorXd error_mm;
  Eigen::VectorXd sd_mm;
  Eigen::VectorXd band_mm;
  std::vector<bool> observed;
  CaseSkull skull;
};

Result<JudgedFace> judged_face(const FaceModel& model, const Person& person, Remains remains) {
  const auto skull = fit_case_skull(model, remains_of(person, remains));
  if (!skull) return forward(skull);
  FaceOptions options;
  options.variations = false;
  const auto face = estimate_face(model, *skull, options);
  if (!face) return forward(face);
  const TriangleMesh skin = moved(skull->anatomical_from_input, person.skin);
  const TriangleBvh truth(skin);
  const PointTree bone(skull->vertices.topRows(model.skull_template.boundary_count));
  JudgedFace judged{Eigen::VectorXd(face->head.rows()), face->sd_mm, face->band_mm, {}, *skull};
  for (Eigen::Index v = 0; v < face->head.rows(); ++v) {
    const Eigen::Vector3d at = face->head.row(v);
    judged.error_mm[v] = truth.closest(at).distance_mm;
    const auto nearest = static_cast<std::size_t>(bone.nearest(at).index);
    judged.observed.push_back(skull->observed[nearest]);
  }
  return judged;
}

/// Means over the vertices of one part of the heads, of all people.
struct PartMeans {
  double count = 0.0;
  double error_mm = 0.0;
  double whole_error_mm = 0.0;
  double sd_mm = 0.0;
  double whole_sd_mm = 0.0;
  double in_band = 0.0;

  void add(const JudgedFace& face, const JudgedFace& whole, Eigen::Index v) {
    count += 1.0;
    error_mm += face.error_mm[v];
    whole_error_mm += whole.error_mm[v];
    sd_mm += face.sd_mm[v];
    whole_sd_mm += whole.sd_mm[v];
    in_band += face.error_mm[v] <= face.band_mm[v] ? 1.0 : 0.0;
  }
  /// \param all count of the vertices of all parts
  void print(Remains remains, const char* part, double all) const {
    fmt::print("| {} | {} | {:.0f} % | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.0f} % |\n",
               to_string(remains), part, 100.0 * count / all, error_mm / count,
               whole_error_mm / count, sd_mm / count, whole_sd_mm / count, 100.0 * in_band / count);
  }
};

/// Over the coordinates of the outer bone that was missing, of all people.
struct BoneMeans {
  double count = 0.0;
  double squares_mm2 = 0.0;
  double variance_mm2 = 0.0;
  double in_band = 0.0;

  void add(const SkullTemplate& skull, const CaseSkull& remains, const CaseSkull& whole) {
    constexpr double gaussian_80 = 1.2816;
    const Similarity3 to_whole =
        whole.anatomical_from_input * remains.anatomical_from_input.inverse();
    for (int v = 0; v < skull.boundary_count; ++v) {
      const auto at = static_cast<std::size_t>(v);
      if (!skull.outer[at] || remains.observed[at] || !whole.observed[at]) continue;
      const Eigen::Vector3d off =
          to_whole * Eigen::Vector3d(remains.vertices.row(v)) - whole.vertices.row(v).transpose();
      const double sd_mm = remains.sd_mm[v];
      count += 3.0;
      squares_mm2 += off.squaredNorm();
      variance_mm2 += 3.0 * sd_mm * sd_mm;
      in_band += static_cast<double>((off.array().abs() <= gaussian_80 * sd_mm).count());
    }
  }
  void print(Remains remains) const {
    fmt::print("| {} | {:.2f} | {:.2f} | {:.0f} % |\n", to_string(remains),
               std::sqrt(squares_mm2 / count), std::sqrt(variance_mm2 / count),
               100.0 * in_band / count);
  }
};

Result<void> run(const Options& options) {
  const auto source =
      load_model(options.model.empty() ? std::optional<std::filesystem::path>() : options.model);
  if (!source) return forward(source);
  const FaceModel& model = source->model;
  constexpr std::array kinds = {Remains::no_mandible, Remains::no_calvaria, Remains::half_face};
  std::array<std::array<PartMeans, 2>, kinds.size()> parts;  // missing, observed
  std::array<BoneMeans, kinds.size()> bones;
  const PersonMaker maker(edge_mm, 0);
  int failed = 0;
  for (int i = 0; i < options.people; ++i) {
    const Person person =
        maker.make(draw_person(mix(options.seed, static_cast<std::uint64_t>(i))), 0);
    const auto whole = judged_face(model, person, Remains::complete);
    if (!whole) return forward(whole);
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      const auto face = judged_face(model, person, kinds[k]);
      if (!face) {
        fmt::print("person {}, {}: {}\n", i + 1, to_string(kinds[k]), face.error().message());
        ++failed;
        continue;
      }
      bones[k].add(model.skull_template, face->skull, whole->skull);
      for (Eigen::Index v = 0; v < face->error_mm.size(); ++v) {
        const auto at = static_cast<std::size_t>(v);
        const HeadRegion region = model.head_template.region[at];
        if (!is_facial(region) && region != HeadRegion::scalp) continue;
        parts[k][face->observed[at] ? 1 : 0].add(*face, *whole, v);
      }
    }
    fmt::print(stderr, "{} of {}\n", i + 1, options.people);
  }
  fmt::print(
      "{} people, seed {}; {}; no face: {}\n\n"
      "| skull | part of the head | share | error mm | over the whole skull | SD mm | over the "
      "whole "
      "skull | in 80 % band |\n|---|---|---|---|---|---|---|---|\n",
      options.people, options.seed, source->name, failed);
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    const double all = parts[k][0].count + parts[k][1].count;
    parts[k][1].print(kinds[k], "bone observed", all);
    parts[k][0].print(kinds[k], "bone missing", all);
  }
  fmt::print(
      "\n| missing bone | error of a coordinate, RMS mm | SD mm | in a Gaussian's 80 % band "
      "|\n|---|---|---|---|\n");
  for (std::size_t k = 0; k < kinds.size(); ++k) bones[k].print(kinds[k]);
  return {};
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  skullstation::Options options;
  CLI::App app("Faces over what is left of skulls");
  app.add_option("--model", options.model, "model file; without: the default model");
  app.add_option("--people", options.people, "how many");
  app.add_option("--seed", options.seed, "of the people");
  CLI11_PARSE(app, argc, argv);
  if (const auto done = skullstation::run(options); !done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return skullstation::exit_code(done.error().kind);
  }
  return 0;
}
