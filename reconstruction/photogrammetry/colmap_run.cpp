#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <atomic>

#include "core/child_process.h"
#include "core/file.h"
#include "core/parallel.h"
#include "core/session/image_file.h"
#include "reconstruction/photogrammetry/colmap_model.h"
#include "reconstruction/photogrammetry/stereo_view.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

constexpr const char* subject = "structure from motion";
constexpr std::size_t least_images = 3;

using Words = std::vector<std::string>;

/// The end of what COLMAP printed, for whoever has to find out what went wrong.
std::string end_of_log(const fs::path& log) {
  const auto text = read_file(log);
  if (!text) return {};
  constexpr std::size_t most = 400;
  return text->size() <= most ? *text : text->substr(text->size() - most);
}

class ColmapRun {
 public:
  ColmapRun(std::span<const SfmImage> images, std::span<const SfmCamera> cameras,
            const SfmOptions& options, std::stop_token stop)
      : images_(images), cameras_(cameras), options_(options), stop_(std::move(stop)) {}

  Result<void> write_images() const {
    for (const fs::path& folder : {work("images"), work("masks"), work("sparse")}) {
      if (auto made = make_writable_folder(folder); !made) return made;
    }
    std::atomic<bool> good = true;
    parallel_for(static_cast<int>(images_.size()), options_.threads, [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      const SfmImage& image = images_[at];
      const std::string name = colmap_image_name(at);
      const bool written =
          write_file_durably(work("images") / name, encode_png(grey_of(*image.photograph))) &&
          (image.mask.empty() ||
           write_file_durably(work("masks") / (name + ".png"), encode_png(image.mask)));
      if (!written) good = false;
    });
    if (good) return {};
    return fail(ErrorKind::bad_input, options_.work_folder.string(), "can't be written",
                "make room on the disk");
  }

  /// Features of all images, each camera's in a run of its own since its lens is an option.
  Result<void> find_features(const Progress& progress) const {
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      std::string list;
      for (std::size_t i = 0; i < images_.size(); ++i) {
        if (std::cmp_equal(images_[i].camera, c)) list += colmap_image_name(i) + "\n";
      }
      if (list.empty()) continue;
      progress.report(static_cast<double>(c) / static_cast<double>(cameras_.size()),
                      "finding features");
      const fs::path list_file = work(fmt::format("images_{}.txt", c));
      if (auto written = write_file_durably(list_file, list); !written) return written;
      Words words = {"feature_extractor",
                     "--database_path",
                     work("database.db"),
                     "--image_path",
                     work("images"),
                     "--image_list_path",
                     list_file,
                     "--ImageReader.mask_path",
                     work("masks"),
                     "--ImageReader.camera_model",
                     "OPENCV",
                     "--ImageReader.single_camera",
                     "1",
                     "--SiftExtraction.use_gpu",
                     "0",
                     "--SiftExtraction.peak_threshold",
                     "0.004",
                     "--SiftExtraction.num_threads",
                     threads()};
      if (cameras_[c].lens) {
        words.insert(
            words.end(),
            {"--ImageReader.camera_params",
             fmt::format("{:.10g}", fmt::join(cameras_[c].lens->params(LensModel::opencv), ","))});
      }
      if (auto done = colmap(words); !done) return done;
    }
    return {};
  }

  Result<void> match(std::span<const std::pair<int, int>> pairs) const {
    std::string list;
    for (const auto& [a, b] : pairs) {
      list += colmap_image_name(static_cast<std::size_t>(a)) + " " +
              colmap_image_name(static_cast<std::size_t>(b)) + "\n";
    }
    if (auto written = write_file_durably(work("pairs.txt"), list); !written) return written;
    return colmap({"matches_importer", "--database_path", work("database.db"), "--match_list_path",
                   work("pairs.txt"), "--match_type", "pairs", "--SiftMatching.use_gpu", "0",
                   "--SiftMatching.num_threads", threads()});
  }

  Result<void> map() const {
    // A calibrated lens stays as it is; one that is estimated has all of it adjusted.
    const std::string refine = lenses_known() ? "0" : "1";
    return colmap({"mapper",
                   "--database_path",
                   work("database.db"),
                   "--image_path",
                   work("images"),
                   "--output_path",
                   work("sparse"),
                   "--Mapper.num_threads",
                   threads(),
                   "--Mapper.ba_refine_focal_length",
                   refine,
                   "--Mapper.ba_refine_extra_params",
                   refine,
                   "--Mapper.min_model_size",
                   "3",
                   "--Mapper.max_num_models",
                   "3",
                   "--Mapper.init_min_num_inliers",
                   "60",
                   "--Mapper.extract_colors",
                   "0"});
  }

  /// The largest model that was made, as text, the principal points refined where lenses were
  /// estimated.
  Result<SfmModel> largest_model() const {
    std::optional<SfmModel> best;
    std::size_t most = 0;
    for (int number = 0; fs::exists(work("sparse") / std::to_string(number)); ++number) {
      const fs::path folder = work("sparse") / std::to_string(number);
      if (!lenses_known()) {
        const auto adjusted = colmap({"bundle_adjuster", "--input_path", folder, "--output_path",
                                      folder, "--BundleAdjustment.refine_principal_point", "1"});
        if (!adjusted) return forward(adjusted);
      }
      const auto converted = colmap({"model_converter", "--input_path", folder, "--output_path",
                                     folder, "--output_type", "TXT"});
      if (!converted) return forward(converted);
      auto model = read_colmap_model(folder, images_, cameras_);
      if (!model) return forward(model);
      const auto registered = static_cast<std::size_t>(std::ranges::count_if(
          model->camera_from_model, [](const auto& pose) { return pose.has_value(); }));
      if (registered <= most) continue;
      most = registered;
      best = *std::move(model);
    }
    if (most >= least_images) return *std::move(best);
    return fail(
        ErrorKind::no_result, subject,
        fmt::format("{} of {} views could be connected by what they show", most, images_.size()),
        "take more views, a step of 15 degrees at most between them, in sharp focus");
  }

 private:
  fs::path work(const std::string& name) const { return options_.work_folder / name; }
  std::string threads() const {
    return std::to_string(options_.threads > 0 ? options_.threads : -1);
  }
  bool lenses_known() const {
    return std::ranges::all_of(cameras_, [](const SfmCamera& c) { return c.lens.has_value(); });
  }

  Result<void> colmap(Words words) const {
    const fs::path log = work(words.front() + ".log");
    words.insert(words.begin(), options_.program);
    // Its seed is an int of 32 bits.
    words.insert(words.end(), {"--random_seed", std::to_string(options_.seed % 2147483647U)});
    const auto code = run_program(words, log, stop_);
    if (!code) {
      if (code.error().kind == ErrorKind::cancelled) return forward(code);
      return fail(ErrorKind::bad_input, options_.program, code.error().what,
                  "install the package colmap, or give the poses or a board");
    }
    if (*code == 0) return {};
    return fail(ErrorKind::no_result, subject,
                fmt::format("`{} {}` ended with {}: {}", options_.program, words[1], *code,
                            end_of_log(log)));
  }

  std::span<const SfmImage> images_;
  std::span<const SfmCamera> cameras_;
  const SfmOptions& options_;
  std::stop_token stop_;
};

}  // namespace

Result<SfmModel> structure_from_motion(std::span<const SfmImage> images,
                                       std::span<const SfmCamera> cameras,
                                       std::span<const std::pair<int, int>> pairs,
                                       const SfmOptions& options, const Progress& progress) {
  const ColmapRun run(images, cameras, options, progress.stop);
  progress.report(0.0, "writing the photographs for COLMAP");
  if (const auto done = run.write_images(); !done) return forward(done);
  if (const auto done = run.find_features(progress.part(0.02, 0.35)); !done) return forward(done);
  progress.report(0.35, "matching features");
  if (const auto done = run.match(pairs); !done) return forward(done);
  progress.report(0.65, "connecting the views");
  if (const auto done = run.map(); !done) return forward(done);
  return run.largest_model();
}

}  // namespace skullstation
