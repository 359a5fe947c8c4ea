#include "daemon/case/case_report.h"

#include <fmt/format.h>

#include <cmath>

namespace skullstation {

namespace {

using Eigen::Index;

std::string facts_in_words(const PersonFacts& facts) {
  std::string words;
  const auto add = [&](const std::string& word) { words += (words.empty() ? "" : ", ") + word; };
  if (facts.male) add(*facts.male > 0.5 ? "male" : "female");
  if (facts.age_years) add(fmt::format("{:.0f} years", *facts.age_years));
  if (facts.body_mass_index) add(fmt::format("body mass index {:.1f}", *facts.body_mass_index));
  return words.empty() ? "nothing" : words;
}

double mean_band_mm(const FaceEstimate& face) {
  double sum = 0.0;
  double count = 0.0;
  for (Index v = 0; v < face.band_mm.size(); ++v) {
    if (!face.from_bone[static_cast<std::size_t>(v)]) continue;
    sum += face.band_mm[v];
    count += 1.0;
  }
  return sum / std::max(1.0, count);
}

std::vector<std::pair<std::string, std::string>> feature_rows(const FaceEstimate& face) {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const FeatureFinding& feature : face.features) {
    std::string words = fmt::format("{:.1f} mm", feature.expected_mm);
    if (feature.sd_mm) words += fmt::format(" +- {:.1f}", *feature.sd_mm);
    words += fmt::format(" ({})", feature.source);
    if (feature.in_face_mm) words += fmt::format("; this face {:.1f} mm", *feature.in_face_mm);
    if (!feature.used) words += "; not used";
    rows.emplace_back(feature.name, words);
  }
  return rows;
}

}  // namespace

std::vector<LandmarkDepth> landmark_depths(const FaceModel& model, const FaceEstimate& face) {
  std::vector<LandmarkDepth> depths;
  for (const TemplateLandmark& landmark : model.skull_template.landmarks) {
    LandmarkDepth row;
    row.name = landmark.name;
    const auto at = [&](const Eigen::VectorXd& values) {
      double sum = 0.0;
      for (int k = 0; k < 3; ++k) {
        if (landmark.place.weights[k] > 0.0) {
          sum += landmark.place.weights[k] * values[landmark.place.corners[k]];
        }
      }
      return sum;
    };
    row.depth_mm = at(face.tissue_mm);
    row.sd_mm = at(face.tissue_sd_mm);
    row.model_mean_mm = at(model.tissue.mean_mm);
    row.model_sd_mm = at(model.tissue.sd_mm);
    row.subjects = model.tissue.count[landmark.place.corners[0]];
    if (!std::isnan(row.depth_mm)) depths.push_back(row);
  }
  return depths;
}

Report case_report(const FaceModel& model, const CaseSkull& skull, const FaceEstimate& face,
                   const CaseSource& source, const CasePictures& pictures) {
  Report report{"Facial approximation", {}};
  report.add(Paragraph{
      "A facial approximation is an investigative aid, not an identification. It shows one face "
      "out "
      "of many that the skull allows. Hair, eyes, skin colour and expression are not known and are "
      "not shown; nose, lips, eyes and ears follow from bone only in part."});
  for (const std::string& warning : skull.warnings) report.add(Warning{"warning", warning});
  for (const std::string& warning : face.warnings) report.add(Warning{"warning", warning});
  if (!source.ancestry.empty()) {
    report.add(Warning{
        "ancestry",
        fmt::format("Told as \"{}\" and written down. It changes nothing: the model's people have "
                    "none recorded, and published depths show no effect that counts.",
                    source.ancestry)});
  }
  report.add(Warning{"model", source.model_card});
  report.add(Pictures{pictures.face});

  report.add(Heading{"How far it may be off"});
  report.add(Paragraph{fmt::format(
      "Over bone, eight faces in ten of people with such a skull lie within {:.1f} mm of this one, "
      "on average over the face. Colours: half width of that band from 0 (dark) to 8 mm (yellow). "
      "Grey: not determined by the bone below; the model's guess.",
      mean_band_mm(face))});
  report.add(Pictures{pictures.uncertainty});

  report.add(Heading{"Faces that are as plausible"});
  report.add(Paragraph{
      "Up to two standard deviations along the ways in which the soft tissue of the model's "
      "subjects differs most, and leaner and fuller where the body mass index is not known. Show "
      "them together: whoever knew the person may recognise one and not another."});
  report.add(Pictures{pictures.variants});

  report.add(Heading{"How it was made"});
  report.add(Pictures{pictures.method});
  report.add(Table{{
      {"known besides the skull", facts_in_words(source.facts)},
      {"soft tissue", source.tissue},
      {"skull's face to the fitted template",
       fmt::format("mean {:.2f} mm, 95 % within {:.2f} mm", skull.quality.facial.mean_mm,
                   skull.quality.facial.p95_mm)},
      {"of the skull's outside was observed",
       fmt::format("{:.0f} %, of the mandible {:.0f} %", 100.0 * skull.quality.observed_share,
                   100.0 * skull.quality.mandible_observed_share)},
      {"distance from the model's skulls",
       fmt::format("{:.2f} standard deviations (about 1 is usual)", skull.strangeness)},
      {"model",
       fmt::format("{} subjects, {} skull, {} tissue and {} head modes", model.joint.subjects,
                   model.skull.mode_count(), model.tissue.mode_count(), model.head.mode_count())},
  }});

  report.add(Heading{"Soft tissue at the landmarks"});
  std::vector<std::pair<std::string, std::string>> rows;
  for (const LandmarkDepth& depth : landmark_depths(model, face)) {
    rows.emplace_back(
        depth.name,
        fmt::format("{:.1f} +- {:.1f} mm (model: {:.1f} +- {:.1f} mm, n = {})", depth.depth_mm,
                    depth.sd_mm, depth.model_mean_mm, depth.model_sd_mm, depth.subjects));
  }
  report.add(Table{rows});

  report.add(Heading{"Nose, eyes and mouth by published rules"});
  report.add(Table{feature_rows(face)});

  report.add(Heading{"To make it again"});
  report.add(Table{{{"skull", source.input},
                    {"its SHA-256", source.input_sha256},
                    {"model", source.model},
                    {"its SHA-256", source.model_sha256},
                    {"program", "skullstation " + source.program_version},
                    {"seed", std::to_string(source.seed)},
                    {"method",
                     "Gietzen et al. 2019 (statistical skull model, dense soft tissue thickness, "
                     "statistical head model), with the joint model of skull, tissue and head"}}});
  return report;
}

}  // namespace skullstation
