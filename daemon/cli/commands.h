#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "daemon/cli/terminal.h"
#include "reconstruction/distance/comparison.h"
#include "reconstruction/registration/skull_registration.h"
#include "reconstruction/volume/ct_surfaces.h"
#include "reconstruction/volume/volume_options.h"

namespace skullstation {

// Every command is a plain struct of its options and a run() that gives its report. main_cli.cpp
// makes the structs from the command line; one .cpp a command group runs them. An empty `config`
// means the simulated station with its defaults.

/// The whole main job on a simulated station.
struct DemoCommand {
  std::filesystem::path out = "out/demo";
};
Result<CommandReport> run(const DemoCommand&, const CommonOptions&, const Progress&);

/// Photographs a specimen all round; an unfinished session in `out` is resumed.
struct ScanCommand {
  std::filesystem::path config;
  std::filesystem::path out;
  std::string case_number;
};
Result<CommandReport> run(const ScanCommand&, const CommonOptions&, const Progress&);

/// Intrinsics of a camera from photographs of the board in many poses.
struct CalibrateCameraCommand {
  std::filesystem::path config;
  std::string camera;            ///< id in station.toml; empty: the only one
  std::filesystem::path images;  ///< photographs of the board; empty: take them now
  std::filesystem::path out;     ///< file; empty: in the station's calibration folder
};
Result<CommandReport> run(const CalibrateCameraCommand&, const CommonOptions&, const Progress&);

/// Axis, board and camera positions; checks steps per turn and direction.
struct CalibrateTableCommand {
  std::filesystem::path config;
  std::filesystem::path out;  ///< file; empty: in the station's calibration folder
  int stops = 24;             ///< angles over one turn
};
Result<CommandReport> run(const CalibrateTableCommand&, const CommonOptions&, const Progress&);

/// Writes the station's board as an SVG that prints at its true size.
struct BoardCommand {
  std::filesystem::path config;
  std::filesystem::path out;
};
Result<CommandReport> run(const BoardCommand&, const CommonOptions&, const Progress&);

/// Photographs to a metric surface (docs/poses_and_masks.md, docs/photogrammetry.md).
struct ReconstructCommand {
  std::filesystem::path session;
  std::filesystem::path out;               ///< a folder that does not exist yet, or is empty
  std::string poses = "auto";              ///< auto, board, given, sfm
  std::string quality = "standard";        ///< draft, standard, fine
  std::optional<double> camera_radius_mm;  ///< of the first camera from the table's axis
  double close_holes_mm = 0.0;             ///< longest rim of an opening that is closed; 0: none
};
Result<CommandReport> run(const ReconstructCommand&, const CommonOptions&, const Progress&);

/// Is a session readable, and are all its images intact?
struct SessionCheckCommand {
  std::filesystem::path session;
};
Result<CommandReport> run(const SessionCheckCommand&, const CommonOptions&, const Progress&);

/// Names every mistake in a station.toml.
struct ConfigCheckCommand {
  std::filesystem::path config;
};
Result<CommandReport> run(const ConfigCheckCommand&, const CommonOptions&, const Progress&);

/// All values in force, their meaning and their origin.
struct ConfigShowCommand {
  std::filesystem::path config;
};
Result<CommandReport> run(const ConfigShowCommand&, const CommonOptions&, const Progress&);

/// Draws a mesh [mm, +x left, +y back, +z up] from eight sides, or from one.
struct PictureCommand {
  std::filesystem::path mesh;
  std::filesystem::path over;  ///< a second mesh drawn see-through over the first; empty: none
  std::filesystem::path out;
  std::string side;  ///< name of one of head_sides(); empty: all
  int size_px = 600;
};
Result<CommandReport> run(const PictureCommand&, const CommonOptions&, const Progress&);

/// Makes synthetic people with exactly known anatomy: one subject folder each.
struct PhantomCommand {
  int count = 1;
  std::filesystem::path out;
  double edge_mm = 1.5;
  double mandible_opening_deg = 0.0;
  bool tooth_loss = false;          ///< teeth missing as their age has it
  bool ct = false;                  ///< write the CT volume, too
  bool dicom = false;               ///< as a DICOM series instead of NIfTI
  std::vector<double> spacing_mm;   ///< of its voxels, three; empty: 0.5, 0.5, 1
  std::vector<std::string> flaws;   ///< words of add_flaw
  bool specimen = false;            ///< write the stained bone as a specimen for the station
  std::vector<std::string> damage;  ///< words of add_damage
};
Result<CommandReport> run(const PhantomCommand&, const CommonOptions&, const Progress&);

/// Makes the templates of skull and head from the canonical phantom.
struct TemplateBuildCommand {
  std::filesystem::path out;
  std::filesystem::path pictures;  ///< folder for both surfaces, coloured by region; empty: none
  double skull_edge_mm = 1.7;
  double head_edge_mm = 3.5;
};
Result<CommandReport> run(const TemplateBuildCommand&, const CommonOptions&, const Progress&);

/// Deforms the template skull onto a surface: skull_fitted.ply and fit.json in `out`.
struct FitSkullCommand {
  std::filesystem::path mesh;
  std::optional<std::filesystem::path> templates;  ///< else those of the default model
  std::filesystem::path out;
  SkullRegularizer regularizer = SkullRegularizer::smooth;
  bool unit_unknown = false;
};
Result<CommandReport> run(const FitSkullCommand&, const CommonOptions&, const Progress&);

/// Deforms the template head onto a surface: head_fitted.ply and fit.json in `out`.
struct FitHeadCommand {
  std::filesystem::path mesh;
  std::optional<std::filesystem::path> templates;  ///< else those of the default model
  std::filesystem::path out;
  bool unit_unknown = false;
};
Result<CommandReport> run(const FitHeadCommand&, const CommonOptions&, const Progress&);

/// Fits the templates to every subject folder and makes a model file of them.
struct ModelBuildCommand {
  std::filesystem::path subjects;
  std::optional<std::filesystem::path> templates;  ///< else those of the default model
  std::filesystem::path out;
  std::filesystem::path fits;  ///< keeps finished fits between runs
  std::string card;            ///< what the subjects are, in plain words
  bool allow_failures = false;
  int skull_modes = 60;
  int head_modes = 60;
};
Result<CommandReport> run(const ModelBuildCommand&, const CommonOptions&, const Progress&);

/// Leaves one subject out at a time: face error, calibration; compactness, generalisation,
/// specificity.
struct ModelEvaluateCommand {
  std::filesystem::path subjects;
  std::optional<std::filesystem::path> templates;  ///< else those of the default model
  std::filesystem::path fits;
  bool allow_failures = false;
};
Result<CommandReport> run(const ModelEvaluateCommand&, const CommonOptions&, const Progress&);

struct ModelInfoCommand {
  std::optional<std::filesystem::path> model;  ///< else the default model
  std::filesystem::path report;                ///< HTML file with pictures; empty: none
};
Result<CommandReport> run(const ModelInfoCommand&, const CommonOptions&, const Progress&);

/// Another head model for a model: skull and tissue stay, nothing is known of how they go together.
struct ModelImportHeadCommand {
  std::filesystem::path head;                  ///< Statismo file
  std::filesystem::path landmarks;             ///< empty: the pose is found
  std::optional<std::filesystem::path> model;  ///< else the default model
  std::filesystem::path out;
};
Result<CommandReport> run(const ModelImportHeadCommand&, const CommonOptions&, const Progress&);

/// From bone to face: a case folder with the face, its variants, uncertainty and report.
struct ApproximateCommand {
  std::filesystem::path skull;
  std::optional<std::filesystem::path> model;  ///< else the default model
  std::filesystem::path out;
  std::optional<std::string> sex;  ///< "male" or "female"
  std::optional<double> age_years;
  std::optional<double> body_mass_index;
  std::string ancestry;           ///< written down; no model knows what to do with it
  std::filesystem::path tissue;   ///< CSV of depths known at landmarks; empty: none
  int variants = 9;               ///< 1, 9 or 25: the grid of two tissue variations
  bool mean_tissue = false;       ///< the paper's way: the population's mean depths
  bool no_feature_rules = false;  ///< nose and eyes as the model has them
  bool unit_unknown = false;
  int most_triangles = 4'000'000;  ///< a finer scan is thinned to about so many
};
Result<CommandReport> run(const ApproximateCommand&, const CommonOptions&, const Progress&);

/// Seals a case as a BagIt bag with signatures (docs/evidence.md).
struct PackageCommand {
  std::filesystem::path case_folder;
  std::filesystem::path out;
  std::optional<std::filesystem::path> session;
  std::optional<std::filesystem::path> reconstruction;
  std::string case_number;          ///< empty: the session's, else the case folder's name
  std::filesystem::path config;     ///< empty: no audit log, keys from `keys`
  std::filesystem::path keys;       ///< folder; empty: as the configuration says
  std::filesystem::path audit_log;  ///< file; empty: as the configuration says
  std::string time_stamp_url;       ///< of an authority; empty: as the configuration says
  std::string by;                   ///< who seals it; empty: this program's user
};
Result<CommandReport> run(const PackageCommand&, const CommonOptions&, const Progress&);

/// A sealed package's models and pictures as a museum shows them.
struct ExhibitCommand {
  std::filesystem::path package;
  std::filesystem::path out;
  std::filesystem::path config;  ///< its [museum]; empty: nothing is said of rights, no manifest
};
Result<CommandReport> run(const ExhibitCommand&, const CommonOptions&, const Progress&);

/// Is a package as it was sealed?
struct VerifyCommand {
  std::filesystem::path package;
  std::filesystem::path trust;  ///< PEM file of certificates and public keys; empty: none
};
Result<CommandReport> run(const VerifyCommand&, const CommonOptions&, const Progress&);

/// Sends a probe to a target, reads it back, removes it.
struct DeliverTestCommand {
  std::filesystem::path config;
  std::string target;
};
Result<CommandReport> run(const DeliverTestCommand&, const CommonOptions&, const Progress&);

/// What is in the outbox and how far it is.
struct DeliverListCommand {
  std::filesystem::path config;
};
Result<CommandReport> run(const DeliverListCommand&, const CommonOptions&, const Progress&);

/// Tries a delivery again now, whatever kept it.
struct DeliverRetryCommand {
  std::filesystem::path config;
  std::int64_t id = 0;
};
Result<CommandReport> run(const DeliverRetryCommand&, const CommonOptions&, const Progress&);

/// Keeps a delivery back until it is retried.
struct DeliverHoldCommand {
  std::filesystem::path config;
  std::int64_t id = 0;
};
Result<CommandReport> run(const DeliverHoldCommand&, const CommonOptions&, const Progress&);

/// Checks a package, puts it into the outbox for every target or some, and sends it.
struct DeliverSendCommand {
  std::filesystem::path config;
  std::filesystem::path package;
  std::vector<std::string> targets;  ///< names; empty: all that are enabled
};
Result<CommandReport> run(const DeliverSendCommand&, const CommonOptions&, const Progress&);

/// Makes the keys that a station signs with.
struct KeysCreateCommand {
  std::filesystem::path folder;
  std::string station;
  int valid_days = 3650;
};
Result<CommandReport> run(const KeysCreateCommand&, const CommonOptions&, const Progress&);

/// Fingerprints of a station's keys, to be compared by other ways than the package's.
struct KeysShowCommand {
  std::filesystem::path folder;
};
Result<CommandReport> run(const KeysShowCommand&, const CommonOptions&, const Progress&);

/// Was anything in an audit log changed, removed or reordered?
struct AuditVerifyCommand {
  std::filesystem::path log;
  std::vector<std::filesystem::path> heads;  ///< packages, or files with an entry of the log
  std::filesystem::path trust;               ///< PEM file; empty: none
};
Result<CommandReport> run(const AuditVerifyCommand&, const CommonOptions&, const Progress&);

/// The entries of an audit log in words.
struct AuditShowCommand {
  std::filesystem::path log;
  std::string case_number;  ///< empty: of all cases
  int last = 0;             ///< so many from the end; 0: all
};
Result<CommandReport> run(const AuditShowCommand&, const CommonOptions&, const Progress&);

/// Checks devices, space and calibration, and says what to mend.
struct DoctorCommand {
  std::filesystem::path config;
};
Result<CommandReport> run(const DoctorCommand&, const CommonOptions&, const Progress&);

/// Bone and skin surfaces of a head from its CT, as a subject's folder.
struct CtImportCommand {
  std::filesystem::path input;  ///< DICOM folder or file, NIfTI, NRRD, MetaImage
  std::filesystem::path out;    ///< the subject's folder; must not exist yet
  VolumeReadOptions read;
  std::optional<std::string> sex;  ///< "male" or "female"; else as the scan says
  std::optional<int> age_years;    ///< else as the scan says
  std::optional<double> body_mass_index;
  CtSurfaceOptions surfaces;
};
Result<CommandReport> run(const CtImportCommand&, const CommonOptions&, const Progress&);

/// Distances between two surfaces, both ways.
struct CompareCommand {
  std::filesystem::path a;
  std::filesystem::path b;
  Alignment align = Alignment::none;  ///< how A may be moved to B first
  std::filesystem::path region;       ///< vertices of A that count; empty: all
  std::filesystem::path out;          ///< A, moved and coloured by distance; empty: not written
  double full_color_mm = 2.0;         ///< distance at which the colour is full
};
Result<CommandReport> run(const CompareCommand&, const CommonOptions&, const Progress&);

}  // namespace skullstation
