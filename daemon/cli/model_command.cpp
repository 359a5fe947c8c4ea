#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "daemon/cli/commands.h"
#include "daemon/model/fitted_subjects.h"
#include "daemon/model/model_report.h"
#include "daemon/model/model_source.h"
#include "daemon/report/html_page.h"
#include "reconstruction/statistics/build_face_model.h"
#include "reconstruction/statistics/head_import.h"
#include "reconstruction/statistics/model_file.h"
#include "reconstruction/statistics/model_quality.h"

namespace skullstation {

namespace {

using Eigen::Index;
using Json = nlohmann::ordered_json;

struct Population {
  std::vector<ModelSubject> subjects;
  Json sources = Json::array();   ///< name and hash of each that takes part
  Json failures = Json::array();  ///< name and reason of each that does not
  std::string notes;              ///< of failures and remarks, for people
};

Result<Population> population_of(const std::vector<SubjectFit>& fits, bool allow_failures) {
  Population population;
  for (const SubjectFit& fit : fits) {
    if (fit.failure.empty()) {
      population.subjects.push_back(fit.subject);
      population.sources.push_back({{"name", fit.subject.name},
                                    {"surfaces_sha256", fit.surfaces_sha256},
                                    {"remark", fit.remark}});
      if (!fit.remark.empty()) {
        population.notes += fmt::format("{}: {}\n", fit.subject.name, fit.remark);
      }
    } else {
      population.failures.push_back({{"name", fit.subject.name}, {"reason", fit.failure}});
      population.notes += fmt::format("left out: {}: {}\n", fit.subject.name, fit.failure);
    }
  }
  if (!population.failures.empty() && !allow_failures) {
    return fail(ErrorKind::no_result, "model build",
                fmt::format("{} of {} subjects can't be fitted:\n{}", population.failures.size(),
                            fits.size(), population.notes),
                "mend them, take them away, or say --allow-failures");
  }
  return population;
}

/// Two-sided p of Wilcoxon's signed rank test (1945), normal approximation.
double wilcoxon_p(std::vector<double> differences) {
  std::erase(differences, 0.0);
  std::ranges::sort(differences, {}, [](double d) { return std::abs(d); });
  const auto n = static_cast<double>(differences.size());
  double positive = 0.0;
  for (std::size_t i = 0; i < differences.size(); ++i) {
    if (differences[i] > 0.0) positive += static_cast<double>(i) + 1.0;
  }
  const double z =
      (positive - n * (n + 1.0) / 4.0) / std::sqrt(n * (n + 1.0) * (2.0 * n + 1.0) / 24.0);
  return std::erfc(std::abs(z) / std::sqrt(2.0));
}

Result<std::vector<VertexLandmark>> read_multi_pie(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return forward(text);
  const auto json = Json::parse(*text, nullptr, false);
  std::vector<int> vertices;
  if (json.is_object() && json.contains("indices") && json["indices"].is_array()) {
    for (const auto& index : json["indices"]) {
      if (index.is_number_integer()) vertices.push_back(index.get<int>());
    }
  }
  auto landmarks = multi_pie_landmarks(vertices);
  if (!landmarks) landmarks.error().where = file.string();
  return landmarks;
}

/// One way to foretell left-out subjects: means over all of them.
struct Prediction {
  const char* name;
  ForetoldErrors LeftOut::*errors;
  double face_mm = 0.0;
  double tissue_mm = 0.0;
  double coverage = 0.0;  ///< of a Gaussian's 80 % band
};

}  // namespace

Result<CommandReport> run(const ModelBuildCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const auto templates = load_templates(command.templates);
  if (!templates) return forward(templates);
  const auto fits =
      fit_subjects(command.subjects, templates->skull, templates->head,
                   {command.fits, common.seed, common.threads}, progress.part(0.0, 0.9));
  if (!fits) return forward(fits);
  auto population = population_of(*fits, command.allow_failures);
  if (!population) return forward(population);
  FaceModelOptions options;
  options.skull.max_modes = command.skull_modes;
  options.head.max_modes = command.head_modes;
  const Json provenance = {{"format", "skullstation-model/1"},
                           {"program_version", SKULLSTATION_VERSION},
                           {"seed", common.seed},
                           {"card", command.card},
                           {"subjects", population->sources},
                           {"left_out", population->failures}};
  const auto model =
      build_face_model(templates->skull, templates->head, std::move(population->subjects), options,
                       provenance.dump(), progress.part(0.9, 1.0));
  if (!model) return forward(model);
  const auto bytes = encode_model(*model);
  if (!bytes) return forward(bytes);
  if (const auto written = write_file_durably(command.out, *bytes); !written) {
    return forward(written);
  }
  CommandReport report;
  report.text =
      population->notes +
      fmt::format("{}: {} subjects, {} skull modes, {} head modes, {} tissue modes, {:.1f} MB\n",
                  command.out.string(), model->joint.subjects, model->skull.mode_count(),
                  model->head.mode_count(), model->tissue.mode_count(),
                  static_cast<double>(bytes->size()) / 1e6);
  report.json = Json{{"model", command.out.string()},
                     {"sha256", sha256_hex(*bytes)},
                     {"subjects", model->joint.subjects},
                     {"left_out", population->failures},
                     {"skull_modes", model->skull.mode_count()},
                     {"head_modes", model->head.mode_count()},
                     {"tissue_modes", model->tissue.mode_count()}}
                    .dump(2);
  return report;
}

Result<CommandReport> run(const ModelInfoCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const auto source = load_model(command.model);
  if (!source) return forward(source);
  const FaceModel& model = source->model;
  if (!command.report.empty()) {
    ReportPictureOptions pictures;
    pictures.threads = common.threads;
    const auto page = model_report(*source, pictures, progress);
    if (!page) return forward(page);
    if (const auto written = write_file_durably(command.report, html_page(*page)); !written) {
      return forward(written);
    }
  }
  CommandReport report;
  report.text = fmt::format(
      "{}\nsha256 {}\n{} subjects\nskull: {} vertices, {} modes\nhead: {} vertices, {} modes\n"
      "tissue: {} modes\njoint model: {} variables\n",
      source->card, source->sha256, model.joint.subjects, model.skull.vertex_count(),
      model.skull.mode_count(), model.head.vertex_count(), model.head.mode_count(),
      model.tissue.mode_count(), model.joint.names.size());
  for (std::size_t b = 1; b < model.joint.blocks.size(); ++b) {
    report.text += fmt::format("  {} from {}\n", model.joint.blocks[b], told_by(model.joint, b));
  }
  Json bands = Json::array();
  for (const BandFactor& band : model.bands) {
    bands.push_back({{"region", band.region}, {"level", band.level}, {"factor", band.factor}});
    report.text +=
        fmt::format("{:.0f} % band, {}: {:.2f} SD\n", 100.0 * band.level, band.region, band.factor);
  }
  report.json = Json{{"model", source->name},
                     {"sha256", source->sha256},
                     {"subjects", model.joint.subjects},
                     {"skull_modes", model.skull.mode_count()},
                     {"head_modes", model.head.mode_count()},
                     {"tissue_modes", model.tissue.mode_count()},
                     {"bands", bands},
                     {"provenance", Json::parse(model.provenance, nullptr, false)}}
                    .dump(2);
  return report;
}

Result<CommandReport> run(const ModelImportHeadCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  auto bytes = read_file(command.head);
  if (!bytes) return forward(bytes);
  const std::string hash = sha256_hex(*bytes);
  const auto foreign = decode_statismo(*std::move(bytes), command.head.string());
  if (!foreign) return forward(foreign);
  HeadImportOptions options;
  options.seed = common.seed;
  options.threads = common.threads;
  if (!command.landmarks.empty()) {
    auto landmarks = read_multi_pie(command.landmarks);
    if (!landmarks) return forward(landmarks);
    options.landmarks = *std::move(landmarks);
  }
  auto base = load_model(command.model);
  if (!base) return forward(base);
  auto imported = import_head(base->model, *foreign, options, progress);
  if (!imported) return forward(imported);
  const HeadFitQuality& fit = imported->fit;
  FaceModel model = with_head(std::move(base->model), std::move(imported->model));
  Json provenance = Json::parse(model.provenance, nullptr, false);
  if (!provenance.is_object()) provenance = Json::object();
  provenance["card"] =
      fmt::format("{} Its heads are those of {}, which nothing ties to its skulls.", base->card,
                  command.head.filename().string());
  provenance["head"] = {{"file", command.head.filename().string()}, {"sha256", hash}};
  model.provenance = provenance.dump();
  const auto encoded = encode_model(model);
  if (!encoded) return forward(encoded);
  if (const auto written = write_file_durably(command.out, *encoded); !written) {
    return forward(written);
  }
  CommandReport report;
  for (const std::string& warning : imported->warnings) report.text += "warning: " + warning + "\n";
  report.text += fmt::format(
      "{}: {} head modes; template to the foreign mean: face RMS {:.2f} mm, P95 {:.2f} mm, {:.0f} "
      "% "
      "of its points kept\n",
      command.out.string(), model.head.mode_count(), fit.facial.rms_mm, fit.facial.p95_mm,
      100.0 * fit.kept_share);
  report.json = Json{{"model", command.out.string()},         {"sha256", sha256_hex(*encoded)},
                     {"head_modes", model.head.mode_count()}, {"facial_rms_mm", fit.facial.rms_mm},
                     {"kept_share", fit.kept_share},          {"warnings", imported->warnings}}
                    .dump(2);
  return report;
}

Result<CommandReport> run(const ModelEvaluateCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const auto templates = load_templates(command.templates);
  if (!templates) return forward(templates);
  const auto fits =
      fit_subjects(command.subjects, templates->skull, templates->head,
                   {command.fits, common.seed, common.threads}, progress.part(0.0, 0.6));
  if (!fits) return forward(fits);
  auto population = population_of(*fits, command.allow_failures);
  if (!population) return forward(population);
  auto subjects =
      aligned_population(templates->skull, templates->head, std::move(population->subjects));
  if (!subjects) return forward(subjects);
  complete_skulls(templates->skull, *subjects);
  const auto tissue = population_tissue_model(templates->skull, *subjects);
  if (!tissue) return forward(tissue);
  const auto left = leave_one_out(templates->skull, templates->head, *subjects, *tissue, {},
                                  progress.part(0.6, 0.8));
  if (!left) return forward(left);

  std::vector<Points3> skulls;
  std::vector<Points3> heads;
  for (const ModelSubject& subject : *subjects) {
    skulls.push_back(subject.skull);
    heads.push_back(subject.head);
  }
  ModelQualityOptions quality_options;
  quality_options.threads = common.threads;
  quality_options.seed = common.seed;
  quality_options.random_members = 200;
  quality_options.max_modes = 20;
  progress.report(0.8, "model quality");
  const auto head_quality = model_quality(
      heads, vertex_areas({templates->head.vertices, templates->head.triangles, {}, {}}),
      quality_options);
  if (!head_quality) return forward(head_quality);
  const auto skull_quality =
      model_quality(skulls, skull_weights(templates->skull), quality_options);
  if (!skull_quality) return forward(skull_quality);

  Prediction predictions[] = {{"mean head, mean depths", &LeftOut::mean},
                              {"given the skull", &LeftOut::given_skull},
                              {"given skull, sex, age, BMI", &LeftOut::given_all}};
  std::vector<double> gains;
  const auto count = static_cast<double>(left->size());
  for (const LeftOut& subject : *left) {
    for (Prediction& prediction : predictions) {
      const ForetoldErrors& errors = subject.*prediction.errors;
      const Eigen::ArrayXd ratio = errors.head_mm.cwiseAbs().cwiseQuotient(errors.head_sd_mm);
      prediction.face_mm += mean_facial_error_mm(templates->head, errors.head_mm) / count;
      prediction.tissue_mm += errors.tissue_mm / count;
      prediction.coverage +=
          static_cast<double>((ratio < 1.2816).count()) / static_cast<double>(ratio.size()) / count;
    }
    gains.push_back(mean_facial_error_mm(templates->head, subject.mean.head_mm) -
                    mean_facial_error_mm(templates->head, subject.given_skull.head_mm));
  }
  const double p = wilcoxon_p(gains);
  CommandReport report;
  report.text = fmt::format(
      "{} subjects, each foretold by the others; mean absolute errors\n\n"
      "{:<30}{:>12}{:>14}{:>14}\n",
      left->size(), "", "face [mm]", "depths [mm]", "in 80 % band");
  Json errors = Json::array();
  for (const Prediction& prediction : predictions) {
    report.text +=
        fmt::format("{:<30}{:>12.3f}{:>14.3f}{:>12.1f} %\n", prediction.name, prediction.face_mm,
                    prediction.tissue_mm, 100.0 * prediction.coverage);
    errors.push_back({{"prediction", prediction.name},
                      {"face_mm", prediction.face_mm},
                      {"tissue_mm", prediction.tissue_mm},
                      {"in_gaussian_80_band", prediction.coverage}});
  }
  report.text += fmt::format(
      "skull against mean head: Wilcoxon p = {:.2g}\n\n{:>6}{:>14}{:>16}"
      "{:>14}{:>14}{:>16}{:>14}\n",
      p, "modes", "skull compact", "generalis. [mm]", "specif. [mm]", "head compact",
      "generalis. [mm]", "specif. [mm]");
  for (std::size_t m = 0;
       m < std::min(head_quality->compactness.size(), skull_quality->compactness.size()); ++m) {
    report.text +=
        fmt::format("{:>6}{:>13.1f}%{:>16.3f}{:>14.3f}{:>13.1f}%{:>16.3f}{:>14.3f}\n", m + 1,
                    100.0 * skull_quality->compactness[m], skull_quality->generalisation_mm[m],
                    skull_quality->specificity_mm[m], 100.0 * head_quality->compactness[m],
                    head_quality->generalisation_mm[m], head_quality->specificity_mm[m]);
  }
  const auto json_of = [](const ModelQuality& quality) {
    return Json{{"compactness", quality.compactness},
                {"generalisation_mm", quality.generalisation_mm},
                {"generalisation_error_mm", quality.generalisation_error_mm},
                {"specificity_mm", quality.specificity_mm}};
  };
  report.json = Json{{"subjects", left->size()},
                     {"face_error", errors},
                     {"wilcoxon_p", p},
                     {"skull", json_of(*skull_quality)},
                     {"head", json_of(*head_quality)},
                     {"left_out", population->failures}}
                    .dump(2);
  return report;
}

}  // namespace skullstation
