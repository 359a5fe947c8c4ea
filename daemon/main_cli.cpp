// The `skullstation` program: its command line. What the commands do is in daemon/cli.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "daemon/cli/commands.h"
#include "daemon/cli/step_command.h"
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
constexpr const char* template_help =
    "file made by template build; without: the templates of the default model";

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

void add_evidence_commands(CLI::App& app, Command& chosen) {
  constexpr const char* trust_help =
      "PEM file of the station's (or its authority's) certificate or public key, got by another "
      "way than the package";
  add<PackageCommand>(
      app, "package", "seal a case: checksums, provenance, signatures, audit entry", chosen,
      [](CLI::App& package, PackageCommand& o) {
        package.add_option("CASE", o.case_folder, "the case's folder")->required();
        package.add_option("--out", o.out, "the package's folder, new")->required();
        package.add_option("--session", o.session, "seal the capture session, too");
        package.add_option("--reconstruction", o.reconstruction, "seal the reconstruction, too");
        package.add_option("--case", o.case_number,
                           "case number (default: the session's, else the folder's name)");
        package.add_option("--config", o.config, "station.toml: its keys and its audit log");
        package.add_option("--keys", o.keys, "folder of keys (default: the configuration's)");
        package.add_option("--audit-log", o.audit_log, "file (default: the configuration's)");
        package.add_option("--time-stamp", o.time_stamp_url,
                           "address of an RFC 3161 authority (default: the configuration's)");
        package.add_option("--by", o.by, "who seals it (default: this user)");
      });
  add<ExhibitCommand>(
      app, "exhibit", "show a package's models: glTF with metadata, Voyager scene, IIIF manifest",
      chosen, [](CLI::App& exhibit, ExhibitCommand& o) {
        exhibit.add_option("PACKAGE", o.package, "the package's folder")->required();
        exhibit.add_option("--out", o.out, "folder, new")->required();
        exhibit.add_option("--config", o.config, "station.toml: its [museum]");
      });
  add<VerifyCommand>(app, "verify", "is a package as it was sealed? Needs nothing but the package",
                     chosen, [](CLI::App& verify, VerifyCommand& o) {
                       verify.add_option("PACKAGE", o.package, "the package's folder")->required();
                       verify.add_option("--trust", o.trust, trust_help);
                     });

  CLI::App* keys = app.add_subcommand("keys", "what this station signs with");
  keys->require_subcommand(1);
  add<KeysCreateCommand>(
      *keys, "create", "make a station's keys, once", chosen,
      [](CLI::App& create, KeysCreateCommand& o) {
        create.add_option("FOLDER", o.folder, "new")->required();
        create.add_option("--station", o.station, "name on the certificate")->required();
        create.add_option("--valid-days", o.valid_days, "of the certificate")
            ->capture_default_str()
            ->check(CLI::Range(1, 36500));
      });
  add<KeysShowCommand>(*keys, "show", "fingerprints, to be given to those who will verify", chosen,
                       [](CLI::App& show, KeysShowCommand& o) {
                         show.add_option("FOLDER", o.folder, "of keys")->required();
                       });

  CLI::App* audit = app.add_subcommand("audit", "what this station has done");
  audit->require_subcommand(1);
  add<AuditVerifyCommand>(
      *audit, "verify", "was anything in the log changed, removed or reordered?", chosen,
      [](CLI::App& verify, AuditVerifyCommand& o) {
        verify.add_option("LOG", o.log, "the audit log")->required();
        verify.add_option("--head", o.heads,
                          "a package (or an entry's file) that must have its place in the log; "
                          "may be given several times: only this shows a removed end");
        verify.add_option("--trust", o.trust, trust_help);
      });
  add<AuditShowCommand>(
      *audit, "show", "its entries in words", chosen, [](CLI::App& show, AuditShowCommand& o) {
        show.add_option("LOG", o.log, "the audit log")->required();
        show.add_option("--case", o.case_number, "of one case only");
        show.add_option("--last", o.last, "so many from the end")->check(CLI::PositiveNumber);
      });
}

void add_delivery_commands(CLI::App& app, Command& chosen) {
  constexpr const char* config = "station.toml: its targets and its outbox";
  CLI::App* deliver = app.add_subcommand("deliver", "bring packages to case systems");
  deliver->require_subcommand(1);
  add<DeliverTestCommand>(*deliver, "test", "send a target a probe, read it back, remove it",
                          chosen, [](CLI::App& test, DeliverTestCommand& o) {
                            test.add_option("TARGET", o.target, "its name")->required();
                            test.add_option("--config", o.config, config)->required();
                          });
  add<DeliverListCommand>(*deliver, "list", "what is in the outbox, and how far it is", chosen,
                          [](CLI::App& list, DeliverListCommand& o) {
                            list.add_option("--config", o.config, config)->required();
                          });
  add<DeliverRetryCommand>(*deliver, "retry", "try a delivery again now", chosen,
                           [](CLI::App& retry, DeliverRetryCommand& o) {
                             retry.add_option("ID", o.id, "as `list` shows it")->required();
                             retry.add_option("--config", o.config, config)->required();
                           });
  add<DeliverHoldCommand>(*deliver, "hold", "keep a delivery back until it is retried", chosen,
                          [](CLI::App& hold, DeliverHoldCommand& o) {
                            hold.add_option("ID", o.id, "as `list` shows it")->required();
                            hold.add_option("--config", o.config, config)->required();
                          });
  add<DeliverSendCommand>(
      *deliver, "send", "send a package; it is in the outbox until it was read back", chosen,
      [](CLI::App& send, DeliverSendCommand& o) {
        send.add_option("PACKAGE", o.package, "the package's folder")->required();
        send.add_option("--config", o.config, config)->required();
        send.add_option("--to", o.targets,
                        "a target's name; may be given several times (default: all enabled)");
      });
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

  add<ReconstructCommand>(
      app, "reconstruct", "make a metric surface of a session's photographs", chosen,
      [](CLI::App& reconstruct, ReconstructCommand& o) {
        reconstruct.add_option("SESSION", o.session, "the session's folder")->required();
        reconstruct.add_option("--out", o.out, "folder for the results; must not exist yet")
            ->required();
        reconstruct.add_option("--poses", o.poses, "where the cameras' poses come from")
            ->capture_default_str()
            ->check(CLI::IsMember({"auto", "board", "given", "sfm"}));
        reconstruct
            .add_option("--camera-radius-mm", o.camera_radius_mm,
                        "distance of the first camera from the table's axis: the scale, where "
                        "neither board nor given poses tell it")
            ->check(CLI::PositiveNumber);
        reconstruct.add_option("--quality", o.quality, "the finer, the slower")
            ->capture_default_str()
            ->check(CLI::IsMember({"draft", "standard", "fine"}));
        reconstruct
            .add_option("--close-holes", o.close_holes_mm,
                        "close openings with a rim up to this long [mm] by a guess, marked in "
                        "skull.ply; 0: none")
            ->capture_default_str()
            ->check(CLI::NonNegativeNumber);
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
        ct_import.add_option("--sex", o.sex, "male or female, where the scan does not tell")
            ->check(CLI::IsMember({"male", "female"}));
        ct_import.add_option("--age", o.age_years, "years, where the scan does not tell")
            ->check(CLI::Range(0, 130));
        ct_import.add_option("--bmi", o.body_mass_index, "body mass index, if known")
            ->check(CLI::Range(8.0, 100.0));
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
        phantom
            .add_option("--mandible-opening", o.mandible_opening_deg,
                        "turn of the mandible, in degrees; the lips stay closed")
            ->check(CLI::Range(0.0, 8.0));
        phantom.add_flag("--tooth-loss", o.tooth_loss, "let people miss teeth as their age has it");
        phantom.add_flag("--ct", o.ct, "write the CT volume, too (ct.nii.gz)");
        phantom.add_flag("--dicom", o.dicom, "write the CT as a DICOM series (folder ct)");
        phantom.add_option("--spacing", o.spacing_mm, "of the CT's voxels: X Y Z, in mm")
            ->expected(3)
            ->check(CLI::Range(0.2, 10.0));
        phantom
            .add_option("--flaws", o.flaws,
                        "of the CT: cropped-calvaria, cropped-nose, head-rest, table, metal, "
                        "padding")
            ->delimiter(',');
        phantom.add_flag("--specimen", o.specimen,
                         "write the stained bone as a specimen for the simulated station "
                         "(specimen.ply)");
        phantom
            .add_option("--damage", o.damage,
                        "of the specimen: missing-mandible, missing-calvaria, hole")
            ->delimiter(',');
      });

  CLI::App* templates = app.add_subcommand("template", "the templates of skull and head");
  templates->require_subcommand(1);
  add<TemplateBuildCommand>(
      *templates, "build", "make both from the canonical phantom", chosen,
      [](CLI::App& build, TemplateBuildCommand& o) {
        build.add_option("--out", o.out, "file")->required();
        build.add_option("--surfaces", o.pictures, "folder for both surfaces, coloured by region");
        build
            .add_option("--skull-edge", o.skull_edge_mm, "length of the facial bone's edges, in mm")
            ->capture_default_str()
            ->check(CLI::Range(1.0, 12.0));
        build.add_option("--head-edge", o.head_edge_mm, "length of the face's edges, in mm")
            ->capture_default_str()
            ->check(CLI::Range(1.5, 15.0));
      });

  CLI::App* fit = app.add_subcommand("fit", "registration alone: the template on a surface");
  fit->require_subcommand(1);
  add<FitSkullCommand>(
      *fit, "skull", "the template skull on a skull, scanned or from CT", chosen,
      [](CLI::App& skull, FitSkullCommand& o) {
        skull.add_option("MESH", o.mesh, "PLY, OBJ or STL, in mm")->required();
        skull.add_option("--template", o.templates, template_help);
        skull.add_option("--out", o.out, "folder")->required();
        skull.add_flag("--unit-unknown", o.unit_unknown, "find the size, too");
        skull.add_option("--regularizer", o.regularizer, "what keeps the template's shape")
            ->transform(CLI::CheckedTransformer(std::map<std::string, SkullRegularizer>{
                {"smooth", SkullRegularizer::smooth},
                {"projected-volume", SkullRegularizer::projected_volume},
                {"volume", SkullRegularizer::volume}}));
      });
  add<FitHeadCommand>(*fit, "head", "the template head on a skin surface", chosen,
                      [](CLI::App& head, FitHeadCommand& o) {
                        head.add_option("MESH", o.mesh, "PLY, OBJ or STL, in mm")->required();
                        head.add_option("--template", o.templates, template_help);
                        head.add_option("--out", o.out, "folder")->required();
                        head.add_flag("--unit-unknown", o.unit_unknown, "find the size, too");
                      });

  CLI::App* model = app.add_subcommand("model", "statistical models of skull, tissue and head");
  model->require_subcommand(1);
  add<ModelBuildCommand>(
      *model, "build", "a model file from subject folders", chosen,
      [](CLI::App& build, ModelBuildCommand& o) {
        build.add_option("--subjects", o.subjects, "folder of subject folders")->required();
        build.add_option("--template", o.templates, template_help);
        build.add_option("--out", o.out, "model file (.h5)")->required();
        build.add_option("--fits", o.fits, "folder that keeps finished fits")->required();
        build.add_option("--card", o.card, "what the subjects are, in plain words")->required();
        build.add_flag("--allow-failures", o.allow_failures, "leave out who can't be fitted");
        build.add_option("--skull-modes", o.skull_modes, "at most")->capture_default_str();
        build.add_option("--head-modes", o.head_modes, "at most")->capture_default_str();
      });
  add<ModelEvaluateCommand>(
      *model, "evaluate", "leave one subject out at a time: how good are the models?", chosen,
      [](CLI::App& evaluate, ModelEvaluateCommand& o) {
        evaluate.add_option("--subjects", o.subjects, "folder of subject folders")->required();
        evaluate.add_option("--template", o.templates, template_help);
        evaluate.add_option("--fits", o.fits, "folder that keeps finished fits")->required();
        evaluate.add_flag("--allow-failures", o.allow_failures, "leave out who can't be fitted");
      });
  add<ModelImportHeadCommand>(
      *model, "import-head", "take another head model in, e.g. one of real people", chosen,
      [](CLI::App& import, ModelImportHeadCommand& o) {
        import.add_option("FILE", o.head, "shape model in Statismo's layout (.h5)")->required();
        import.add_option("--landmarks", o.landmarks,
                          "JSON with \"indices\": vertices of the 68 Multi-PIE landmarks");
        import.add_option("--model", o.model, "model to put it into; without: the default model");
        import.add_option("--out", o.out, "model file (.h5)")->required();
      });
  add<ModelInfoCommand>(
      *model, "info", "what a model file holds", chosen, [](CLI::App& info, ModelInfoCommand& o) {
        info.add_option("MODEL", o.model, "model file; without: the default model");
        info.add_option("--report", o.report, "HTML file with pictures of it");
      });

  add<ApproximateCommand>(
      app, "approximate", "from a skull to a face with its variants and uncertainty", chosen,
      [](CLI::App& approximate, ApproximateCommand& o) {
        approximate.add_option("SKULL", o.skull, "PLY, OBJ or STL, in mm")->required();
        approximate.add_option("--model", o.model, "model file; without: the default model");
        approximate.add_option("--out", o.out, "case folder, new")->required();
        approximate.add_option("--sex", o.sex, "male or female, if known")
            ->check(CLI::IsMember({"male", "female"}));
        approximate.add_option("--age", o.age_years, "years, if known");
        approximate.add_option("--bmi", o.body_mass_index, "body mass index, if known");
        approximate.add_option("--ancestry", o.ancestry,
                               "if known: written down; the model's people have none recorded");
        CLI::Option* tissue = approximate.add_option(
            "--tissue", o.tissue, "CSV of depths known at landmarks: landmark,depth_mm[,sd_mm]");
        approximate
            .add_flag("--mean-tissue", o.mean_tissue,
                      "the population's mean depths, as in the paper")
            ->excludes(tissue);
        approximate.add_flag("--no-feature-rules", o.no_feature_rules,
                             "nose and eyes as the model has them, whatever published rules say");
        approximate
            .add_option("--variants", o.variants,
                        "faces in the grid of two tissue variations: 1, 9 or 25")
            ->check(CLI::IsMember({1, 9, 25}))
            ->capture_default_str();
        approximate.add_flag("--unit-unknown", o.unit_unknown, "find the size, too");
        approximate
            .add_option("--most-triangles", o.most_triangles,
                        "a finer scan is thinned to about so many")
            ->check(CLI::PositiveNumber)
            ->capture_default_str();
      });

  add_evidence_commands(app, chosen);
  add_delivery_commands(app, chosen);

  add<StepCommand>(
      app, "step", "one step of a case; called by skullstationd", chosen,
      [](CLI::App& step, StepCommand& o) {
        step.add_option("NAME", o.name, "reconstruct or approximate")->required();
        step.add_option("FOLDER", o.folder, "working folder with request.json")->required();
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

int run_program(int argc, char** argv) {
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

}  // namespace

int main(int argc, char** argv) {
  return skullstation::guarded("skullstation", [&] { return run_program(argc, argv); });
}
