// The `skullstation` program: its command line. What the commands do is in daemon/cli.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "daemon/cli/commands.h"
#include "daemon/cli/terminal.h"
#include "reconstruction/rendering/picture_sheet.h"

namespace {

using namespace skullstation;

/// What the command line chose: set by the parser's callback, run afterwards.
using Command = std::function<Result<CommandReport>(const CommonOptions&, const Progress&)>;

/// Adds a command; `declare(app, options)` declares the options of its struct.
template <class Options, class Declare>
void add(CLI::App& parent, const std::string& name, const std::string& help, Command& chosen,
         const Declare& declare) {
  CLI::App* app = parent.add_subcommand(name, help);
  const auto options = std::make_shared<Options>();
  declare(*app, *options);
  app->callback([&chosen, options] {
    chosen = [options](const CommonOptions& common, const Progress& progress) {
      return run(*options, common, progress);
    };
  });
}

constexpr const char* config_help = "station.toml; without it: a simulated station, all defaults";

void add_surface_options(CLI::App& app, CtSurfaceOptions& o) {
  app.add_option("--skin-hu", o.skin_hu, "threshold of the skin")->capture_default_str();
  app.add_option("--bone-hu", o.bone_hu, "threshold of the bone")->capture_default_str();
  app.add_option("--metal-hu", o.metal_hu, "threshold of metal")->capture_default_str();
  app.add_option("--edge-mm", o.decimation.edge_mm, "mean edge length")->capture_default_str();
  app.add_option("--max-error-mm", o.decimation.max_error_mm,
                 "how far thinning may move the surface")
      ->capture_default_str();
  app.add_flag("--no-crop{false}", o.crop, "keep what lies below the mandible");
  app.add_option("--crop-below-mandible-mm", o.crop_below_mandible_mm, "where the volume is cut")
      ->capture_default_str();
}

void add_commands(CLI::App& app, Command& chosen) {
  add<DemoCommand>(app, "demo", "the whole main job on a simulated station", chosen,
                   [](CLI::App& demo, DemoCommand& o) {
                     demo.add_option("--out", o.out, "where the results go")->capture_default_str();
                   });

  add<ScanCommand>(app, "scan", "photograph a specimen all round; resumes an unfinished session",
                   chosen, [](CLI::App& scan, ScanCommand& o) {
                     scan.add_option("--out", o.out, "the session's folder")->required();
                     scan.add_option("--config", o.config, config_help);
                     scan.add_option("--case", o.case_number, "case number");
                   });

  CLI::App* calibrate = app.add_subcommand("calibrate", "measure cameras and table");
  calibrate->require_subcommand(1);
  add<CalibrateCameraCommand>(
      *calibrate, "camera", "intrinsics from photographs of the board in many poses", chosen,
      [](CLI::App& camera, CalibrateCameraCommand& o) {
        camera.add_option("--config", o.config, config_help);
        camera.add_option("--camera", o.camera, "which camera (default: the only one)");
        camera.add_option("--images", o.images, "folder of photographs (default: take them now)");
        camera.add_option("--out", o.out, "file (default: in the station's calibration folder)");
      });
  add<CalibrateTableCommand>(
      *calibrate, "table", "axis, board and camera positions; checks steps per turn", chosen,
      [](CLI::App& table, CalibrateTableCommand& o) {
        table.add_option("--config", o.config, config_help);
        table.add_option("--stops", o.stops, "angles over one turn")
            ->capture_default_str()
            ->check(CLI::Range(6, 360));
        table.add_option("--out", o.out, "file (default: in the station's calibration folder)");
      });
  add<BoardCommand>(*calibrate, "board", "write the board as an SVG that prints at its true size",
                    chosen, [](CLI::App& board, BoardCommand& o) {
                      board.add_option("--config", o.config, config_help);
                      board.add_option("--out", o.out, "SVG file")->required();
                    });

  CLI::App* session = app.add_subcommand("session", "look after capture sessions");
  session->require_subcommand(1);
  add<SessionCheckCommand>(
      *session, "check", "is a session readable and are all its images intact?", chosen,
      [](CLI::App& check, SessionCheckCommand& o) {
        check.add_option("SESSION", o.session, "the session's folder")->required();
      });

  CLI::App* config = app.add_subcommand("config", "check or show the configuration");
  config->require_subcommand(1);
  add<ConfigCheckCommand>(*config, "check", "every mistake in a station.toml, with its line",
                          chosen, [](CLI::App& check, ConfigCheckCommand& o) {
                            check.add_option("FILE", o.config, "station.toml")->required();
                          });
  add<ConfigShowCommand>(*config, "show",
                         "all values in force, their meaning and where they come from", chosen,
                         [](CLI::App& show, ConfigShowCommand& o) {
                           show.add_option("--config", o.config, config_help);
                         });

  add<PictureCommand>(
      app, "picture", "draw a mesh from eight sides", chosen,
      [](CLI::App& picture, PictureCommand& o) {
        picture.add_option("MESH", o.mesh, "PLY, OBJ or STL, in mm")->required();
        picture.add_option("--over", o.over, "a mesh to draw see-through over it");
        picture.add_option("--out", o.out, "PNG file")->required();
        std::vector<std::string> names;
        for (const PictureSide& side : head_sides()) names.emplace_back(side.name);
        picture.add_option("--side", o.side, "one side only")->check(CLI::IsMember(names));
        picture.add_option("--size", o.size_px, "of each side, in pixels")
            ->capture_default_str()
            ->check(CLI::Range(16, 4096));
      });

  add<CompareCommand>(
      app, "compare", "distances between two surfaces, both ways", chosen,
      [](CLI::App& compare, CompareCommand& o) {
        compare.add_option("A", o.a, "PLY, OBJ or STL, in mm")->required();
        compare.add_option("B", o.b, "what A is compared with")->required();
        compare.add_option("--align", o.align, "how A may be moved to B first")
            ->transform(CLI::CheckedTransformer(
                std::map<std::string, Alignment>{{"none", Alignment::none},
                                                 {"rigid", Alignment::rigid},
                                                 {"similarity", Alignment::similarity}}));
        compare.add_option("--region", o.region,
                           "text file with the numbers of A's vertices that count, one a line");
        compare.add_option("--out", o.out, "write A, moved and coloured by distance (.ply, .glb)");
        compare.add_option("--full-color-mm", o.full_color_mm, "distance of the full colour")
            ->capture_default_str()
            ->check(CLI::PositiveNumber);
      });

  CLI::App* ct = app.add_subcommand("ct", "CT scans for model generation");
  ct->require_subcommand(1);
  add<CtImportCommand>(
      *ct, "import", "bone and skin surfaces of a head, with a quality report", chosen,
      [](CLI::App& ct_import, CtImportCommand& o) {
        ct_import
            .add_option("SCAN", o.input, "DICOM folder or file, .nii, .nii.gz, .nrrd, .mha, .mhd")
            ->required();
        ct_import.add_option("--out", o.out, "the subject's new folder")->required();
        ct_import.add_option("--series", o.read.series,
                             "which series of the folder: its UID, number or description");
        ct_import.add_flag("--keep-identity", o.read.keep_identity,
                           "keep patient name, ID and dates (dropped otherwise)");
        ct_import
            .add_option("--length-unit", o.read.length_unit,
                        "mm, m or um, where the file states none or a wrong one")
            ->transform(CLI::CheckedTransformer(
                std::map<std::string, LengthUnit>{{"mm", LengthUnit::millimetre},
                                                  {"m", LengthUnit::metre},
                                                  {"um", LengthUnit::micrometre}}));
        ct_import.add_flag("--assume-patient-axes", o.read.assume_patient_axes,
                           "for files without orientation: axes run left, posterior, superior");
        ct_import.add_option("--hu-offset", o.read.hu_offset, "added to every value");
        ct_import.add_flag("--infer-hu-offset", o.read.infer_hu_offset,
                           "find that offset by the air round the head");
        add_surface_options(ct_import, o.surfaces);
      });

  add<PhantomCommand>(
      app, "phantom", "make synthetic people: bone and skin surfaces, landmarks, true thickness",
      chosen, [](CLI::App& phantom, PhantomCommand& o) {
        phantom.add_option("--count", o.count, "how many")
            ->capture_default_str()
            ->check(CLI::Range(1, 100000));
        phantom.add_option("--out", o.out, "folder for a subject folder each")->required();
        phantom.add_option("--edge", o.edge_mm, "length of the surfaces' edges, in mm")
            ->capture_default_str()
            ->check(CLI::Range(0.5, 5.0));
      });

  add<DoctorCommand>(app, "doctor", "check devices, space and calibration; say what to mend",
                     chosen, [](CLI::App& doctor, DoctorCommand& o) {
                       doctor.add_option("--config", o.config, config_help);
                     });
}

void add_common_options(CLI::App& app, CommonOptions& common) {
  app.add_flag("--json", common.json, "print one JSON object with the figures");
  app.add_option("--threads", common.threads, "0: all")->check(CLI::Range(0, 1024));
  app.add_option("--seed", common.seed, "of everything random")->capture_default_str();
}

}  // namespace

int main(int argc, char** argv) {
  const StopOnSignal stop;

  CLI::App app{"Skullstation: from a skull on a turntable to a facial approximation"};
  app.set_version_flag("--version", SKULLSTATION_VERSION);
  app.require_subcommand(1);
  app.fallthrough();  // the common flags may stand anywhere
  CommonOptions common;
  add_common_options(app, common);
  Command chosen;
  add_commands(app, chosen);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool asked_for_help = error.get_exit_code() == 0;
    app.exit(error);
    return asked_for_help ? 0 : exit_code(ErrorKind::usage);
  }
  Result<CommandReport> result;
  {
    ProgressBar bar;
    result = chosen(common, bar.progress(stop.token()));
  }
  return finish(result, common.json);
}
