#include "daemon/model/fitted_subjects.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/parallel.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/mesh/flat_cuts.h"
#include "reconstruction/registration/head_led_by_skull.h"
#include "reconstruction/registration/head_registration.h"
#include "reconstruction/registration/observed_bone.h"
#include "reconstruction/registration/skull_registration.h"
#include "reconstruction/statistics/subject_file.h"
#include "reconstruction/statistics/tissue_thickness.h"

namespace skullstation {

namespace {

namespace fs = std::filesystem;

constexpr double least_facial_share = 0.5;
constexpr double worst_facial_mean_mm = 2.0;

std::vector<fs::path> subject_folders(const fs::path& subjects) {
  std::vector<fs::path> folders;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(subjects, error)) {
    // A skin without skull, or the reverse, is a mistake that has to be named.
    const bool is_subject =
        fs::exists(entry.path() / "skull.ply") || fs::exists(entry.path() / "skin.ply");
    if (is_subject) folders.push_back(entry.path());
  }
  std::ranges::sort(folders);
  return folders;
}

template <class Matrix>
std::string_view bytes_of(const Matrix& matrix) {
  return {reinterpret_cast<const char*>(matrix.data()),
          static_cast<std::size_t>(matrix.size()) * sizeof(typename Matrix::Scalar)};
}

std::string templates_sha256(const SkullTemplate& skull, const HeadTemplate& head) {
  return sha256_hex(sha256_hex(bytes_of(skull.vertices)) + sha256_hex(bytes_of(skull.tetrahedra)) +
                    sha256_hex(bytes_of(head.vertices)) + sha256_hex(bytes_of(head.triangles)));
}

/// Sex, age and body mass index, as far as subject.json tells them.
Result<PersonFacts> read_facts(const fs::path& file) {
  PersonFacts facts;
  if (!fs::exists(file)) return facts;
  const auto text = read_file(file);
  if (!text) return forward(text);
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object()) {
    return fail(ErrorKind::bad_input, file.string(), "is not a JSON object", "write it again");
  }
  if (const auto sex = json.find("sex"); sex != json.end() && sex->is_string()) {
    const auto word = sex->get<std::string>();
    if (word == "male" || word == "M") facts.male = 1.0;
    if (word == "female" || word == "F") facts.male = 0.0;
  }
  const auto number = [&](const char* name, std::optional<double>& value) {
    if (const auto found = json.find(name); found != json.end() && found->is_number()) {
      value = found->get<double>();
    }
  };
  number("age_years", facts.age_years);
  number("bmi", facts.body_mass_index);
  return facts;
}

Result<ModelSubject> fit_folder(const fs::path& folder, const SkullTemplate& skull,
                                const HeadTemplate& head, const SubjectFitOptions& options,
                                const Progress& progress) {
  const auto facts = read_facts(folder / "subject.json");
  if (!facts) return forward(facts);
  const auto bone = read_mesh(folder / "skull.ply");
  if (!bone) return forward(bone);
  const auto skin = read_mesh(folder / "skin.ply");
  if (!skin) return forward(skin);
  auto subject = fit_subject(*bone, *skin, skull, head, options, progress);
  if (!subject) return forward(subject);
  subject->name = folder.filename().string();
  subject->facts = *facts;
  return subject;
}

Result<std::string> surfaces_sha256(const fs::path& folder) {
  std::string surfaces;
  for (const char* file : {"skull.ply", "skin.ply"}) {
    const auto bytes = read_file(folder / file);
    if (!bytes) return forward(bytes);
    surfaces += sha256_hex(*bytes);
  }
  return sha256_hex(surfaces);
}

/// One subject, fitted now or before. Fails only for what ends the whole run: a stop, or a folder
/// that can't be written.
Result<SubjectFit> fitted_subject(const fs::path& folder, const SkullTemplate& skull,
                                  const HeadTemplate& head, const std::string& templates,
                                  const SubjectFitOptions& options, const Progress& progress) {
  SubjectFit fit;
  fit.subject.name = folder.filename().string();
  const auto surfaces = surfaces_sha256(folder);
  if (!surfaces) {
    fit.failure = surfaces.error().message();
    return fit;
  }
  fit.surfaces_sha256 = *surfaces;
  const std::string key = sha256_hex(fit.surfaces_sha256 + templates + SKULLSTATION_VERSION +
                                     std::to_string(options.seed));
  const fs::path kept = options.fits / (fit.subject.name + ".h5");
  if (auto bytes = read_file(kept); bytes) {
    auto stored = decode_subject(*std::move(bytes), kept.string());
    if (stored && stored->key == key) {
      fit.subject = std::move(stored->subject);
      fit.from_before = true;
      return fit;
    }
  }
  auto subject = fit_folder(folder, skull, head, options, progress);
  if (!subject) {
    if (subject.error().kind == ErrorKind::cancelled) return forward(subject);
    fit.failure = subject.error().message();
    return fit;
  }
  fit.subject = *std::move(subject);
  const auto encoded = encode_subject({key, fit.subject});
  if (!encoded) return forward(encoded);
  if (const auto written = write_file_durably(kept, *encoded); !written) return forward(written);
  return fit;
}

/// What was not observed of a bone, and so is the other subjects' and not this one's.
std::string what_is_missing(const SkullTemplate& skull, const ModelSubject& subject) {
  constexpr double enough = 0.7;
  std::string missing;
  for (const auto& [bone, name] :
       {std::pair(SkullBone::cranium, "cranium"), {SkullBone::mandible, "mandible"}}) {
    const double seen = observed_share(skull, subject.skull_observed, bone);
    if (seen >= enough) continue;
    missing += fmt::format("{}of the {} {:.0f} % were observed", missing.empty() ? "" : ", ", name,
                           100.0 * seen);
  }
  return missing.empty() ? "" : missing + "; the rest follows from the others";
}

/// Nobody may count twice, as surfaces or as fits.
void name_duplicates(std::vector<SubjectFit>& fits) {
  constexpr double same_mm = 0.02;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    for (std::size_t j = 0; j < i && fits[i].failure.empty(); ++j) {
      if (!fits[j].failure.empty()) continue;
      const bool again =
          fits[i].surfaces_sha256 == fits[j].surfaces_sha256 ||
          (fits[i].subject.skull - fits[j].subject.skull).rowwise().norm().mean() < same_mm;
      if (again) fits[i].failure = fmt::format("is {} again", fits[j].subject.name);
    }
  }
}

}  // namespace

Result<ModelSubject> fit_subject(const TriangleMesh& closed_bone, const TriangleMesh& closed_skin,
                                 const SkullTemplate& skull, const HeadTemplate& head,
                                 const SubjectFitOptions& options, const Progress& progress) {
  // Where the scan ended are neither bone nor skin: no template may take the lids for them.
  const TriangleMesh bone = opened_at_flat_cuts(closed_bone);
  const TriangleMesh skin = opened_at_flat_cuts(closed_skin);
  SkullRegistrationOptions skull_options;
  skull_options.seed = options.seed;
  skull_options.threads = options.threads;
  const auto skull_fit = register_skull(skull, bone, skull_options, progress.part(0.0, 0.8));
  if (!skull_fit) return forward(skull_fit);
  if (skull_fit->quality.facial.mean_mm > worst_facial_mean_mm) {
    return fail(ErrorKind::no_result, "skull",
                fmt::format("the template lies {:.1f} mm from the face of its skull on average",
                            skull_fit->quality.facial.mean_mm),
                "look at the skull's surface");
  }
  if (skull_fit->quality.observed_share < least_facial_share) {
    return fail(ErrorKind::no_result, "skull",
                fmt::format("only {:.0f} % of the skull's outside is there",
                            100.0 * skull_fit->quality.observed_share));
  }
  HeadRegistrationOptions head_options;
  head_options.pose = &skull_fit->input_from_template;
  head_options.start = head_led_by_skull(head, skull, *skull_fit);
  head_options.seed = options.seed;
  head_options.threads = options.threads;
  const auto head_fit = register_head(head, skin, head_options, progress.part(0.8, 1.0));
  if (!head_fit) return forward(head_fit);

  ModelSubject subject;
  subject.skull = skull_fit->vertices;
  subject.skull_observed = skull_fit->observed;
  subject.head = head_fit->vertices;
  std::vector<bool> measurable = skull_fit->observed;
  for (std::size_t v = 0; v < measurable.size(); ++v) {
    if (!skull.outer[v]) measurable[v] = false;
  }
  ThicknessOptions thickness;
  thickness.threads = options.threads;
  const auto depths =
      tissue_thickness(surface_of(skull, skull_fit->vertices), measurable, skin, thickness);
  if (!depths) return forward(depths);
  subject.tissue_mm = *depths;
  return subject;
}

Result<std::vector<SubjectFit>> fit_subjects(const fs::path& subjects, const SkullTemplate& skull,
                                             const HeadTemplate& head,
                                             const SubjectFitOptions& options,
                                             const Progress& progress) {
  const std::vector<fs::path> folders = subject_folders(subjects);
  if (folders.empty()) {
    return fail(ErrorKind::bad_input, subjects.string(),
                "holds no subject: no folder in it has a skull.ply or skin.ply",
                "make subjects by \"ct import\" or \"phantom\"");
  }
  if (const auto made = make_writable_folder(options.fits); !made) return forward(made);
  const std::string templates = templates_sha256(skull, head);
  // A subject a thread: most of a fit is one solver after the other.
  SubjectFitOptions alone = options;
  alone.threads = 1;
  Progress quiet;
  quiet.stop = progress.stop;
  std::vector<Result<SubjectFit>> attempts(folders.size());
  std::mutex one_at_a_time;
  std::size_t finished = 0;
  parallel_for(static_cast<int>(folders.size()), options.threads, [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    if (progress.stop.stop_requested()) {
      attempts[at] = fail(ErrorKind::cancelled, subjects.string(), "stopped by the operator");
      return;
    }
    attempts[at] = fitted_subject(folders[at], skull, head, templates, alone, quiet);
    const std::lock_guard lock(one_at_a_time);
    ++finished;
    progress.report(static_cast<double>(finished) / static_cast<double>(folders.size()),
                    folders[at].filename().string());
  });
  std::vector<SubjectFit> fits;
  for (auto& attempt : attempts) {
    if (!attempt) return forward(attempt);
    fits.push_back(*std::move(attempt));
  }
  judge_subjects(skull, fits);
  return fits;
}

void judge_subjects(const SkullTemplate& skull, std::vector<SubjectFit>& fits) {
  name_duplicates(fits);
  for (SubjectFit& fit : fits) {
    if (fit.failure.empty()) fit.remark = what_is_missing(skull, fit.subject);
  }
}

}  // namespace skullstation
