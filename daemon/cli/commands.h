#pragma once

#include <filesystem>
#include <string>

#include "core/progress.h"
#include "core/result.h"
#include "daemon/cli/terminal.h"
#include "reconstruction/distance/comparison.h"
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
};
Result<CommandReport> run(const PhantomCommand&, const CommonOptions&, const Progress&);

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
