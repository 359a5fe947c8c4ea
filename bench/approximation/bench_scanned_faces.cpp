// What photogrammetry costs a face: phantoms that the model never saw, each face once from the
// exact surface of the skull and once from what the simulated station makes of that skull, as
// Markdown tables (docs/faces.md). Usage:
//   bench_scanned_faces --cache FOLDER [--model FILE] [--people 5] [--seed 5000] [--threads 0]
// Scan and reconstruction are the demo's. They stay in the cache; a run that was stopped goes on.
// The truth comes to where the simulation says that the specimen lay; nothing is aligned to it.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <vector>

#include "bench/photogrammetry/simulation_truth.h"
#include "bench/seconds.h"
#include "core/file.h"
#include "core/random.h"
#include "daemon/cli/commands.h"
#include "daemon/model/model_source.h"
#include "daemon/station/calibration_workflow.h"
#include "daemon/station/scan_workflow.h"
#include "daemon/station/station.h"
#include "reconstruction/approximation/face_error.h"
#include "reconstruction/approximation/face_estimate.h"
#include "reconstruction/distance/comparison.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/phantom/specimen.h"
#include "reconstruction/registration/similarity_fit.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;

constexpr double edge_mm = 1.0;

struct Options {
  std::string model;
  fs::path cache;
  int people = 5;
  std::uint64_t seed = 5000;
  int threads = 0;
};

struct Method {
  const char* name;
  TissueChoice tissue;
  bool facts;
  bool rules;
};
constexpr std::array methods = {
    Method{"mean depths (paper)", TissueChoice::population, false, false},
    Method{"given the skull (default)", TissueChoice::conditional, false, true},
    Method{"and sex, age, BMI", TissueChoice::conditional, true, true}};
using Errors = std::array<FaceError, methods.size()>;

/// What the station made of a person's skull.
struct Scan {
  TriangleMesh skull;
  Similarity3 scan_from_person;
};

Result<Scan> scan_of(const Person& person, const fs::path& folder, const fs::path& calibration,
                     const CommonOptions& common) {
  const fs::path specimen_file = folder / "specimen.ply";
  const fs::path session = folder / "session";
  const fs::path reconstruction = folder / "reconstruction";
  if (!fs::exists(reconstruction)) {
    if (const auto made = make_writable_folder(folder); !made) return forward(made);
    const auto written = write_ply(specimen(person, {}, common.seed), specimen_file);
    if (!written) return forward(written);
    StationConfig config;
    config.simulation.specimen = specimen_file.string();
    config.calibration_folder = calibration.string();
    const auto known = calibrate_lenses(config, common.seed, common.threads, {});
    if (!known) return forward(known);
    auto station =
        open_station(config, RoomSetting::specimen_on_table, common.seed, common.threads);
    if (!station) return forward(station);
    const auto scanned = scan_specimen(config, *station, "BENCH", session, {}, {});
    if (!scanned) return forward(scanned);
    ReconstructCommand reconstruct;
    reconstruct.session = session;
    reconstruct.out = reconstruction;
    const auto made = run(reconstruct, common, {});
    if (!made) return forward(made);
  }
  auto skull = read_ply(reconstruction / "skull.ply");
  if (!skull) return forward(skull);
  const auto truth = read_simulation_truth(session);
  if (!truth) return forward(truth);
  const Rigid3 scan_from_person = truth->reconstruction_from_specimen();
  return Scan{*std::move(skull), {1.0, scan_from_person.rotation, scan_from_person.translation}};
}

/// Errors of the faces over a skull, by each method.
Result<Errors> face_errors(const FaceModel& model, const TriangleMesh& input,
                           const Similarity3& input_from_person, const Person& person,
                           int threads) {
  SkullRegistrationOptions fit_options;
  fit_options.threads = threads;
  const auto skull = fit_case_skull(model, input, fit_options);
  if (!skull) return forward(skull);
  for (const std::string& warning : skull->warnings) fmt::print(stderr, "{}\n", warning);
  const TriangleMesh skin = moved(skull->anatomical_from_input * input_from_person, person.skin);
  const PersonParameters& p = person.parameters;
  Errors errors;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    FaceOptions options;
    options.tissue = methods[m].tissue;
    options.feature_rules = methods[m].rules;
    options.variations = false;
    options.threads = threads;
    if (methods[m].facts) options.facts = {p.sex == Sex::male ? 1.0 : 0.0, p.age_years, p.bmi};
    const auto face = estimate_face(model, *skull, options);
    if (!face) return forward(face);
    errors[m] = face_error(model.head_template, face->head, face->band_mm, skin, threads);
  }
  return errors;
}

/// A person's figures, or the means of all.
struct Row {
  double scan_mean_mm = 0.0;
  double scan_p95_mm = 0.0;
  std::array<double, methods.size()> exact_mm{};
  std::array<double, methods.size()> scanned_mm{};

  void add(const Row& other, double share) {
    scan_mean_mm += share * other.scan_mean_mm;
    scan_p95_mm += share * other.scan_p95_mm;
    for (std::size_t m = 0; m < methods.size(); ++m) {
      exact_mm[m] += share * other.exact_mm[m];
      scanned_mm[m] += share * other.scanned_mm[m];
    }
  }
  void print(const std::string& person) const {
    for (std::size_t m = 0; m < methods.size(); ++m) {
      fmt::print("| {} | {:.2f} | {:.2f} | {} | {:.2f} | {:.2f} | {:+.2f} |\n", person,
                 scan_mean_mm, scan_p95_mm, methods[m].name, exact_mm[m], scanned_mm[m],
                 scanned_mm[m] - exact_mm[m]);
    }
    std::fflush(stdout);
  }
};

Result<Row> row_of(const FaceModel& model, const Person& person, const Scan& scan, int threads) {
  Row row;
  ComparisonOptions compare;
  compare.threads = threads;
  const auto off =
      compare_surfaces(scan.skull, moved(scan.scan_from_person, person.skull), compare);
  if (!off) return forward(off);
  row.scan_mean_mm = off->a_to_b.mean_mm;
  row.scan_p95_mm = off->a_to_b.p95_mm;
  const auto exact = face_errors(model, person.skull, {}, person, threads);
  if (!exact) return forward(exact);
  const auto scanned = face_errors(model, scan.skull, scan.scan_from_person, person, threads);
  if (!scanned) return forward(scanned);
  for (std::size_t m = 0; m < methods.size(); ++m) {
    row.exact_mm[m] = (*exact)[m].mean_mm;
    row.scanned_mm[m] = (*scanned)[m].mean_mm;
  }
  return row;
}

Result<void> print_tables(const Options& options) {
  const auto source =
      load_model(options.model.empty() ? std::optional<fs::path>() : fs::path(options.model));
  if (!source) return forward(source);
  fmt::print(
      "{} people, seed {}; {}\n\n| person | scan mean mm | P95 | depths | face mean mm, exact "
      "skull | scanned skull | grows by |\n|---|---|---|---|---|---|---|\n",
      options.people, options.seed, source->name);
  const PersonMaker maker(edge_mm, options.threads);
  Row mean;
  Seconds scans;
  Seconds faces;
  for (int i = 0; i < options.people; ++i) {
    CommonOptions common;
    common.seed = mix(options.seed, static_cast<std::uint64_t>(i));
    common.threads = options.threads;
    const Person person = maker.make(draw_person(common.seed), options.threads);
    const Seconds begin = Seconds::now();
    const auto scan = scan_of(person, options.cache / fmt::format("{}-{}", options.seed, i + 1),
                              options.cache / "calibration", common);
    if (!scan) return forward(scan);
    const Seconds scanned = Seconds::now();
    const auto row = row_of(source->model, person, *scan, options.threads);
    if (!row) return forward(row);
    scans = scans + (scanned - begin);
    faces = faces + (Seconds::now() - scanned);
    row->print(std::to_string(i + 1));
    mean.add(*row, 1.0 / options.people);
  }
  mean.print("mean");
  const double share = 1.0 / options.people;
  fmt::print(
      "\na person: scan and reconstruction {:.0f} processor s ({:.0f} s), faces {:.0f} ({:.0f})\n",
      share * scans.processor, share * scans.wall, share * faces.processor, share * faces.wall);
  return {};
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  skullstation::Options options;
  CLI::App app("What photogrammetry costs a face");
  app.add_option("--model", options.model, "model file; without: the default model");
  app.add_option("--cache", options.cache, "folder that keeps scans and reconstructions")
      ->required();
  app.add_option("--people", options.people, "how many")->check(CLI::Range(1, 1000));
  app.add_option("--seed", options.seed, "of the people");
  app.add_option("--threads", options.threads, "0: all");
  CLI11_PARSE(app, argc, argv);
  if (const auto done = skullstation::print_tables(options); !done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return skullstation::exit_code(done.error().kind);
  }
  return 0;
}
