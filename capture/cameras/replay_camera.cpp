#include "capture/cameras/replay_camera.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "core/session/image_file.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr std::array<std::string_view, 5> kExtensions{".png", ".jpg", ".jpeg", ".tif", ".tiff"};

bool is_digit(char letter) { return std::isdigit(static_cast<unsigned char>(letter)) != 0; }

bool is_picture(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

/// The digits that start at `at`, without leading zeros; `at` moves behind them.
std::string_view take_number(std::string_view text, std::size_t& at) {
  while (at < text.size() && text[at] == '0') ++at;
  const std::size_t begin = at;
  while (at < text.size() && is_digit(text[at])) ++at;
  return text.substr(begin, at - begin);
}

/// Names compared letter by letter, runs of digits by their value.
bool natural_less(std::string_view a, std::string_view b) {
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const std::string_view x = take_number(a, i);
      const std::string_view y = take_number(b, j);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (i < a.size() || j < b.size()) return j < b.size();
  return a < b;  // equal but for leading zeros
}

class ReplayCamera final : public Camera {
 public:
  ReplayCamera(ReplayCameraConfig config, const Image8& first, Clock& clock)
      : config_(std::move(config)),
        width_(first.width),
        height_(first.height),
        channels_(first.channels),
        clock_(clock) {}

  CameraDescription description() const override {
    return {.backend = "replay",
            .model = "recorded pictures",
            .serial = {},
            .stable_path = config_.pictures.front().parent_path().string(),
            .format = fmt::format("{} {}x{}", channels_ == 1 ? "grey" : "RGB", width_, height_)};
  }

  Result<Frame> frame_after(Instant not_before, milliseconds timeout,
                            std::stop_token stop) override {
    const Instant now = clock_.now();
    if (!clock_.sleep_until(std::min(not_before, now + timeout), stop) || stop.stop_requested()) {
      return fail(ErrorKind::cancelled, "replay camera", "stopped while waiting for a picture");
    }
    if (not_before > now + timeout) {
      return fail(ErrorKind::hardware, "replay camera",
                  fmt::format("no picture within {}: the moment asked for lies later", timeout));
    }
    if (next_ == config_.pictures.size() && config_.loop) next_ = 0;
    if (next_ == config_.pictures.size()) {
      return fail(ErrorKind::bad_input, description().stable_path,
                  fmt::format("all {} pictures were used", config_.pictures.size()),
                  "record more pictures, plan fewer views, or let the replay loop");
    }
    const fs::path& path = config_.pictures[next_];
    Result<Image8> image = read_image(path);
    if (!image) return forward(image);
    if (image->width != width_ || image->height != height_ || image->channels != channels_) {
      return fail(
          ErrorKind::bad_input, path.string(),
          fmt::format("is {}x{} with {} channels, the first picture is {}x{} with {}", image->width,
                      image->height, image->channels, width_, height_, channels_),
          "replay the pictures of one camera only");
    }
    ++next_;
    return Frame{std::move(*image), std::max(clock_.now(), not_before), sequence_++, std::nullopt};
  }

  Result<std::vector<CameraControl>> controls() override { return std::vector<CameraControl>{}; }

  Result<std::vector<LockedSetting>> lock(const CameraSettings& settings) override {
    if (settings.exposure) return refuse("exposure");
    if (settings.gain) return refuse("gain");
    if (settings.white_balance_k) return refuse("white_balance_k");
    if (settings.focus) return refuse("focus");
    return std::vector<LockedSetting>{};
  }

  Result<void> reopen() override { return {}; }

 private:
  tl::unexpected<Error> refuse(const char* setting) const {
    return fail(ErrorKind::bad_input, description().stable_path,
                fmt::format("recorded pictures have no control for {}", setting),
                fmt::format("leave {} out of the replay camera's settings", setting));
  }

  ReplayCameraConfig config_;
  int width_;
  int height_;
  int channels_;
  Clock& clock_;
  std::size_t next_ = 0;
  std::uint32_t sequence_ = 0;
};

}  // namespace

Result<std::vector<fs::path>> pictures_in(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> pictures;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (is_picture(entry->path())) pictures.push_back(entry->path());
  }
  if (error) {
    return fail(ErrorKind::bad_input, folder.string(),
                fmt::format("can't be listed: {}", error.message()),
                "name a folder with recorded pictures");
  }
  if (pictures.empty()) {
    return fail(ErrorKind::bad_input, folder.string(), "holds no PNG, JPEG or TIFF pictures",
                "name a folder with recorded pictures");
  }
  std::sort(pictures.begin(), pictures.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return pictures;
}

Result<std::unique_ptr<Camera>> open_replay_camera(const ReplayCameraConfig& config, Clock& clock) {
  if (config.pictures.empty()) {
    return fail(ErrorKind::bad_input, "replay camera", "has no pictures to serve",
                "name a folder with recorded pictures");
  }
  const Result<Image8> first = read_image(config.pictures.front());
  if (!first) return forward(first);
  return std::make_unique<ReplayCamera>(config, *first, clock);
}

}  // namespace skullstation
