#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "core/random.h"
#include "daemon/cli/commands.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/phantom/person_ct.h"
#include "reconstruction/phantom/person_files.h"
#include "reconstruction/phantom/specimen.h"
#include "reconstruction/phantom/tooth_loss.h"
#include "reconstruction/volume/dicom_writer.h"
#include "reconstruction/volume/image_file.h"

namespace skullstation {

namespace {

constexpr std::uint64_t kNoise = 0xc7;
constexpr std::uint64_t kStain = 0x5d;
constexpr std::uint64_t kTeeth = 0x7e;

Result<void> write_ct(const PhantomCommand& command, const CommonOptions& common,
                      const Person& person, const TissueMap& tissue,
                      const std::filesystem::path& folder, const Progress& progress) {
  PhantomCtOptions options;
  if (command.spacing_mm.size() == 3) {
    options.spacing_mm = Eigen::Map<const Eigen::Vector3d>(command.spacing_mm.data());
  }
  options.seed = mix(person.parameters.seed, kNoise);
  options.threads = common.threads;
  for (const std::string& flaw : command.flaws) {
    if (auto added = add_flaw(options, person, flaw); !added) return added;
  }
  const auto volume = phantom_ct(body_of(person), tissue, options, progress);
  if (!volume) return forward(volume);
  if (!command.dicom) return write_nifti(*volume, folder / "ct.nii.gz");
  DicomWriteOptions dicom;
  dicom.patient_name = "SYNTHETIC";
  dicom.patient_id = folder.filename().string();
  return write_dicom_series(*volume, folder / "ct", dicom);
}

}  // namespace

Result<CommandReport> run(const PhantomCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  SpecimenDamage damage;
  for (const std::string& word : command.damage) {
    if (auto added = add_damage(damage, word); !added) return forward(added);
  }
  const bool ct = command.ct || command.dicom || !command.flaws.empty();
  progress.report(0.0, "canonical head");
  const PersonMaker maker(command.edge_mm, common.threads);
  std::optional<TissueMap> tissue;
  if (ct) tissue.emplace(common.threads);
  int shrunk = 0;
  for (int i = 0; i < command.count; ++i) {
    if (progress.stop.stop_requested()) {
      return fail(ErrorKind::cancelled, command.out.string(), "stopped by the operator");
    }
    progress.report(static_cast<double>(i) / command.count, fmt::format("person {}", i + 1));
    PersonParameters parameters = draw_person(mix(common.seed, static_cast<std::uint64_t>(i)));
    parameters.mandible_opening_deg = command.mandible_opening_deg;
    if (command.tooth_loss) {
      parameters.missing_teeth =
          draw_missing_teeth(parameters.age_years, mix(parameters.seed, kTeeth));
    }
    const Person person = maker.make(parameters, common.threads);
    const auto folder = command.out / fmt::format("person_{:04}", i + 1);
    if (auto written = write_person(person, folder); !written) return forward(written);
    if (ct) {
      Progress quiet;
      quiet.stop = progress.stop;
      if (auto written = write_ct(command, common, person, *tissue, folder, quiet); !written) {
        return forward(written);
      }
    }
    if (command.specimen || !command.damage.empty()) {
      const TriangleMesh mesh = specimen(person, damage, mix(parameters.seed, kStain));
      if (auto written = write_mesh(mesh, folder / "specimen.ply"); !written) {
        return forward(written);
      }
    }
    shrunk += person.bone.shrinkings > 0 || person.face.shrinkings > 0;
  }
  CommandReport report;
  report.text = fmt::format(
      "{} synthetic people in {}, of whom {} had to be moved towards the "
      "average to be sound\n",
      command.count, command.out.string(), shrunk);
  report.json = nlohmann::ordered_json{
      {"people", command.count},
      {"folder", command.out.string()},
      {"moved_towards_average",
       shrunk}}.dump(2);
  return report;
}

}  // namespace skullstation
