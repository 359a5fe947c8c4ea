// How well missing bone is completed and how well its uncertainty is known, by a model of others:
// parts of synthetic people's skulls are hidden, as a Markdown table (docs/models.md). Usage:
//   bench_completion [PEOPLE = 64] [SEED = 1]
// The people are those of the default model, the template's vertices lie where their anatomy has
// them: no registration errs here. Every fifth is left out of the others' model in turn.

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "core/random.h"
#include "daemon/model/model_source.h"
#include "reconstruction/phantom/person.h"
#include "reconstruction/registration/similarity_fit.h"
#include "reconstruction/statistics/population.h"
#include "reconstruction/statistics/skull_completion.h"

namespace skullstation {
namespace {

constexpr double edge_mm = 4.0;  // of surfaces that are not used
constexpr int left_out_step = 5;

/// Where the template's vertices lie on a person.
Points3 vertices_of(const Person& person, const SkullTemplate& skull) {
  Points3 vertices(skull.vertices.rows(), 3);
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    const Eigen::Vector3d place = skull.vertices.row(v);
    const bool lower = bone_of(skull.region[static_cast<std::size_t>(v)]) == SkullBone::mandible;
    vertices.row(v) = person.bone.on_person(place, lower).transpose();
  }
  return vertices;
}

Points3 laid_on(const Points3& vertices, const Points3& reference, const Eigen::VectorXd& weights) {
  const Similarity3 pose =
      fit_similarity(vertices, reference, weights, FitScale::one).value_or(Similarity3{});
  Points3 result(vertices.rows(), 3);
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    result.row(v) = (pose * Eigen::Vector3d(vertices.row(v))).transpose();
  }
  return result;
}

struct Hidden {
  const char* name;
  bool (*hides)(const Eigen::Vector3d& place, SkullBone bone);
};
constexpr std::array hidden_parts = {
    Hidden{"mandible",
           [](const Eigen::Vector3d&, SkullBone bone) { return bone == SkullBone::mandible; }},
    Hidden{"vault", [](const Eigen::Vector3d& place,
                       SkullBone bone) { return bone == SkullBone::cranium && place.z() > 45.0; }},
    Hidden{"left half of the face",
           [](const Eigen::Vector3d& place, SkullBone) {
             return place.x() > 0.0 && place.y() < 0.0 && place.z() < 45.0;
           }},
};

/// Over the coordinates of the hidden outer vertices.
struct Errors {
  double count = 0.0;
  double squares_mm2 = 0.0;
  double variance_mm2 = 0.0;
  double in_band = 0.0;

  void add(const Eigen::RowVector3d& off_mm, double sd_mm) {
    count += 3.0;
    squares_mm2 += off_mm.squaredNorm();
    variance_mm2 += 3.0 * sd_mm * sd_mm;
    in_band += static_cast<double>((off_mm.array().abs() <= 1.2816 * sd_mm).count());
  }
};

int run(int people, std::uint64_t seed) {
  const auto templates = load_templates(std::nullopt);
  if (!templates) {
    fmt::print(stderr, "{}\n", templates.error().message());
    return exit_code(templates.error().kind);
  }
  const SkullTemplate& skull = templates->skull;
  const Eigen::VectorXd weights = skull_weights(skull);
  const PersonMaker maker(edge_mm, 0);
  std::vector<Points3> skulls;
  for (int i = 1; i <= people; ++i) {
    const Person person =
        maker.make(draw_person(mix(seed * 10000 + static_cast<std::uint64_t>(i), 0)), 0);
    skulls.push_back(laid_on(vertices_of(person, skull), skull.vertices, weights));
  }
  std::array<Errors, hidden_parts.size()> errors;
  for (std::size_t n = 0; n < skulls.size(); n += left_out_step) {
    std::vector<Points3> others = skulls;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(n));
    const auto model = build_shape_model(others, weights);
    if (!model) {
      fmt::print(stderr, "{}\n", model.error().message());
      return exit_code(model.error().kind);
    }
    for (std::size_t p = 0; p < hidden_parts.size(); ++p) {
      std::vector<bool> observed(skull.outer.begin(), skull.outer.end());
      Eigen::VectorXd shown = weights;
      for (int v = 0; v < skull.boundary_count; ++v) {
        const auto at = static_cast<std::size_t>(v);
        if (!hidden_parts[p].hides(skull.vertices.row(v), bone_of(skull.region[at]))) continue;
        observed[at] = false;
        shown[v] = 0.0;
      }
      const Points3 truth = laid_on(skulls[n], unflattened(model->mean), shown);
      const CompletedSkull completed = completed_skull(skull, *model, truth, observed);
      for (int v = 0; v < skull.boundary_count; ++v) {
        const auto at = static_cast<std::size_t>(v);
        if (observed[at] || !skull.outer[at]) continue;
        errors[p].add(completed.vertices.row(v) - truth.row(v), completed.sd_mm[v]);
      }
    }
  }
  fmt::print(
      "| hidden | error of a coordinate, RMS mm | SD mm | in a Gaussian's 80 % band "
      "|\n|---|---|---|---|\n");
  for (std::size_t p = 0; p < hidden_parts.size(); ++p) {
    const Errors& e = errors[p];
    fmt::print("| {} | {:.2f} | {:.2f} | {:.0f} % |\n", hidden_parts[p].name,
               std::sqrt(e.squares_mm2 / e.count), std::sqrt(e.variance_mm2 / e.count),
               100.0 * e.in_band / e.count);
  }
  return 0;
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  return skullstation::run(argc > 1 ? std::atoi(argv[1]) : 64,
                           argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
}
