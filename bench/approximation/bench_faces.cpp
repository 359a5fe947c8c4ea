// How far approximated faces lie from the true ones: phantoms that the model never saw, or subjects
// (skull.ply and skin.ply, as `skullstation ct import` writes them), each method beside the others,
// as Markdown tables (docs/faces.md). Usage:
//   bench_faces [--model FILE] [--people 20 [--seed 5000] | --subject FOLDER ...] [--out FOLDER]
//               [--morphs]
// Depths are the model's population mean (the paper's method), foretold from the skull (the
// default), the same with sex, age and body mass index known, and the person's own.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "bench/seconds.h"
#include "core/random.h"
#include "daemon/model/model_source.h"
#include "reconstruction/approximation/face_error.h"
#include "reconstruction/approximation/face_estimate.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/mesh/flat_cuts.h"
#include "reconstruction/phantom/person.h"
#include "reconstruction/registration/similarity_fit.h"
#include "reconstruction/statistics/tissue_thickness.h"

namespace skullstation {
namespace {

constexpr double edge_mm = 2.0;

struct Options {
  std::string model;
  int people = 20;
  std::uint64_t seed = 5000;
  std::vector<std::string> subjects;  ///< instead of phantoms
  bool morphs = false;                ///< how far morph targets are from faces fitted anew
  std::filesystem::path out;          ///< folder for the meshes; none if empty
};

/// Whose face is approximated, and the truth about it.
struct Somebody {
  TriangleMesh skull;
  TriangleMesh skin;
  std::optional<PersonFacts> facts;
};

struct Method {
  const char* name;
  const char* file;
  TissueChoice tissue;
  bool facts;
  bool rules;
};
constexpr Method methods[] = {
    {"mean depths (paper)", "mean", TissueChoice::population, false, false},
    {"given the skull (default)", "skull_given", TissueChoice::conditional, false, true},
    {"the same without rules", "no_rules", TissueChoice::conditional, false, false},
    {"and sex, age, BMI", "facts", TissueChoice::conditional, true, true},
    {"the person's own depths", "own", TissueChoice::measured, false, true}};

Somebody phantom(const PersonMaker& maker, std::uint64_t seed) {
  Person person = maker.make(draw_person(seed), 0);
  const PersonParameters& p = person.parameters;
  return {std::move(person.skull), std::move(person.skin),
          PersonFacts{p.sex == Sex::male ? 1.0 : 0.0, p.age_years, p.bmi}};
}

Result<Somebody> subject(const std::filesystem::path& folder) {
  auto skull = read_ply(folder / "skull.ply");
  if (!skull) return forward(skull);
  const auto skin = read_ply(folder / "skin.ply");
  if (!skin) return forward(skin);
  return Somebody{*std::move(skull), opened_at_flat_cuts(*skin), std::nullopt};
}

/// The person's own depths over the fitted skull, which lies in `anatomical_from_person`.
Result<Eigen::VectorXd> own_depths(const FaceModel& model, const CaseSkull& skull,
                                   const TriangleMesh& skin) {
  const SkullTemplate& t = model.skull_template;
  std::vector<bool> outer(t.outer.begin(), t.outer.begin() + t.boundary_count);
  auto depths =
      tissue_thickness(surface_of(t, skull.vertices.topRows(t.boundary_count)), outer, skin, {});
  if (!depths) return depths;
  // Only where the model has depths: elsewhere the nearest skin says nothing of the tissue.
  for (Eigen::Index v = 0; v < depths->size(); ++v) {
    if (!model.tissue.modelled[static_cast<std::size_t>(v)]) {
      (*depths)[v] = std::numeric_limits<double>::quiet_NaN();
    }
  }
  return depths;
}

void print_row(const std::string& person, const Method& method, const FaceError& error) {
  fmt::print("| {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.0f} % |\n", person, method.name,
             error.mean_mm, error.p95_mm, error.over_bone_mean_mm, error.features_mean_mm,
             100.0 * error.within_band);
}

Result<void> run(const Options& options) {
  const auto source =
      load_model(options.model.empty() ? std::optional<std::filesystem::path>() : options.model);
  if (!source) return forward(source);
  const FaceModel& model = source->model;
  fmt::print("{} people, {}; {}\n\n", options.people,
             options.subjects.empty() ? fmt::format("seed {}", options.seed) : "subjects",
             source->name);
  fmt::print(
      "| person | method | face mean mm | P95 | over bone mean | nose, lips, eyes mean | in 80 % "
      "band "
      "|\n|---|---|---|---|---|---|---|\n");
  std::optional<PersonMaker> maker;
  if (options.subjects.empty()) maker.emplace(edge_mm, 0);
  std::map<std::string, std::vector<FaceError>> errors;
  std::map<std::string, std::vector<double>> gaps_mm;
  double fit_s = 0.0;
  double face_s = 0.0;
  for (int i = 0; i < options.people; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto person = maker ? Result<Somebody>(phantom(*maker, mix(options.seed, at)))
                              : subject(options.subjects[at]);
    if (!person) return forward(person);
    const Seconds begin = Seconds::now();
    const auto skull = fit_case_skull(model, person->skull);
    fit_s += (Seconds::now() - begin).processor;
    if (!skull) {
      fmt::print("| {} | {} |\n", i + 1, skull.error().message());
      continue;
    }
    const TriangleMesh skin = moved(skull->anatomical_from_input, person->skin);
    for (const Method& method : methods) {
      if (method.facts && !person->facts) continue;
      FaceOptions face_options;
      face_options.tissue = method.tissue;
      face_options.feature_rules = method.rules;
      face_options.variations = options.morphs && &method == &methods[1];
      if (method.facts) face_options.facts = *person->facts;
      if (method.tissue == TissueChoice::measured) {
        auto depths = own_depths(model, *skull, skin);
        if (!depths) return forward(depths);
        face_options.measured_mm = *std::move(depths);
      }
      const Seconds face_begin = Seconds::now();
      const auto face = estimate_face(model, *skull, face_options);
      if (!face) return forward(face);
      face_s += (Seconds::now() - face_begin).processor;
      for (const FaceVariation& v : face->variations) gaps_mm[v.name].push_back(v.refit_gap_mm);
      const FaceError error = face_error(model.head_template, face->head, face->band_mm, skin, 0);
      errors[method.name].push_back(error);
      if (!options.out.empty()) {
        const auto path = [&](const char* what) {
          return options.out / fmt::format("{}_{}.ply", i + 1, what);
        };
        const TriangleMesh head{face->head, model.head_template.triangles, {}, {}};
        const TriangleMesh bone = surface_of(
            model.skull_template, skull->vertices.topRows(model.skull_template.boundary_count));
        for (const auto& [mesh, name] : {std::pair(&head, method.file),
                                         {&skin, "truth"},
                                         {&bone, "skull"},
                                         {&face->spheres, "spheres"}}) {
          if (const auto written = write_ply(*mesh, path(name)); !written) return written;
        }
      }
      print_row(std::to_string(i + 1), method, error);
    }
    std::fflush(stdout);
  }
  for (const Method& method : methods) {
    FaceError mean;
    const auto& all = errors[method.name];
    if (all.empty()) continue;
    const auto count = static_cast<double>(all.size());
    for (const FaceError& error : all) {
      mean.mean_mm += error.mean_mm / count;
      mean.p95_mm += error.p95_mm / count;
      mean.over_bone_mean_mm += error.over_bone_mean_mm / count;
      mean.features_mean_mm += error.features_mean_mm / count;
      mean.within_band += error.within_band / count;
    }
    print_row("mean", method, mean);
  }
  if (options.morphs) {
    fmt::print(
        "\n| morph target at 2 SD | from the face fitted anew, mm | worst person "
        "|\n|---|---|---|\n");
    for (const auto& [name, gaps] : gaps_mm) {
      fmt::print("| {} | {:.2f} | {:.2f} |\n", name,
                 std::accumulate(gaps.begin(), gaps.end(), 0.0) / static_cast<double>(gaps.size()),
                 std::ranges::max(gaps));
    }
  }
  fmt::print("\nprocessor s: {:.1f} a skull, {:.1f} a face\n", fit_s / options.people,
             face_s / options.people / std::size(methods));
  return {};
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  skullstation::Options options;
  CLI::App app("Error of approximated faces");
  app.add_option("--model", options.model, "model file; without: the default model");
  app.add_option("--people", options.people, "how many");
  app.add_option("--seed", options.seed, "of the people");
  app.add_flag("--morphs", options.morphs, "compare morph targets with faces fitted anew");
  app.add_option("--out", options.out, "folder to write the meshes to");
  app.add_option("--subject", options.subjects, "folders with skull.ply and skin.ply")
      ->excludes("--people");
  CLI11_PARSE(app, argc, argv);
  if (!options.subjects.empty()) options.people = static_cast<int>(options.subjects.size());
  if (const auto done = skullstation::run(options); !done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return skullstation::exit_code(done.error().kind);
  }
  return 0;
}
