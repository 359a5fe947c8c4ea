#include "capture/scan/session_recorder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include "capture/scan/space_reserve.h"
#include "core/file.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

constexpr const char* images_folder = "images";
constexpr const char* part_suffix = ".part";  // write_file_durably's temporary name

/// A new session goes into an empty folder, or one where a scan got no further than preparing it:
/// nobody's files are mixed with ours by a mistyped path.
Result<void> check_folder_is_free(const fs::path& folder, const std::set<std::string>& planned) {
  const auto ours = [&](const fs::path& inside) {
    fs::path name = inside;
    if (name.extension() == part_suffix) name.replace_extension();
    return name == images_folder || name == "session.json" || name == SpaceReserve::file_name ||
           planned.contains(name.string());
  };
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const fs::path inside = entry->path().lexically_relative(folder);
    if (!ours(inside)) {
      return fail(ErrorKind::bad_input, folder.string(),
                  fmt::format("is not empty ({}) and is no capture session", inside.string()),
                  "choose a new folder");
    }
  }
  if (error) return fail(ErrorKind::bad_input, folder.string(), error.message());
  return {};
}

Result<int> lock_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) {
    return fail(ErrorKind::bad_input, folder.string(), std::system_category().message(errno));
  }
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    ::close(descriptor);
    return fail(ErrorKind::bad_input, folder.string(), "is in use by another scan",
                "wait until it ends");
  }
  return descriptor;
}

std::string list_of_rings(const SessionPlan& plan) {
  std::vector<std::string> rings;
  for (const SessionPlan::Ring& ring : plan.rings) {
    rings.push_back(fmt::format("{} ({} views)", ring.camera, ring.views));
  }
  return fmt::format("{}", fmt::join(rings, ", "));
}

std::string description_of(const std::optional<CharucoBoard>& board) {
  if (!board) return "none";
  return fmt::format("{} {}x{}, squares {} mm, markers {} mm", board->dictionary, board->squares_x,
                     board->squares_y, board->square_mm, board->marker_mm);
}

std::string description_of(const SessionCamera& camera) {
  return camera.params
             ? fmt::format("{} [{}]", to_string(camera.model), fmt::join(*camera.params, ", "))
             : "not calibrated";
}

}  // namespace

std::optional<std::string> plan_difference(const Session& recorded, const Session& wanted) {
  const auto differ = [](std::string_view what, std::string_view was, std::string_view is) {
    return fmt::format("{} was \"{}\" and now is \"{}\"", what, was, is);
  };
  if (recorded.case_number != wanted.case_number) {
    return differ("the case", recorded.case_number, wanted.case_number);
  }
  if (recorded.station != wanted.station) {
    return differ("the station", recorded.station, wanted.station);
  }
  if (!recorded.plan) return "it was not made by this station's scan: it has no plan";
  if (recorded.plan->passes != wanted.plan->passes) {
    return differ("the number of passes", std::to_string(recorded.plan->passes),
                  std::to_string(wanted.plan->passes));
  }
  if (recorded.plan->rings != wanted.plan->rings) {
    return differ("the rings", list_of_rings(*recorded.plan), list_of_rings(*wanted.plan));
  }
  if (recorded.board != wanted.board) {
    return differ("the board", description_of(recorded.board), description_of(wanted.board));
  }
  for (const SessionCamera& camera : wanted.cameras) {
    const auto was = std::ranges::find(recorded.cameras, camera.id, &SessionCamera::id);
    if (was == recorded.cameras.end()) {
      return fmt::format("camera \"{}\" is new", camera.id);
    }
    if (was->model != camera.model || was->params != camera.params) {
      return differ(fmt::format("the calibration of {}", camera.id), description_of(*was),
                    description_of(camera));
    }
  }
  return std::nullopt;
}

SessionRecorder::SessionRecorder(fs::path folder, Session session, const ScanPlan& plan,
                                 WriteFile write_file, int lock)
    : folder_(std::move(folder)),
      session_(std::move(session)),
      write_file_(std::move(write_file)),
      lock_(lock) {
  for (const PlannedView& view : planned_views(plan)) planned_.insert(view.image);
}

SessionRecorder::SessionRecorder(SessionRecorder&& other) noexcept
    : folder_(std::move(other.folder_)),
      session_(std::move(other.session_)),
      planned_(std::move(other.planned_)),
      write_file_(std::move(other.write_file_)),
      lock_(std::exchange(other.lock_, -1)),
      resumed_(other.resumed_),
      current_pass_(other.current_pass_),
      replaced_(std::move(other.replaced_)) {}

SessionRecorder::~SessionRecorder() {
  if (lock_ >= 0) ::close(lock_);
}

Result<SessionRecorder> SessionRecorder::open(const fs::path& folder, Session wanted,
                                              const ScanPlan& plan, WriteFile write_file,
                                              const Progress& progress) {
  if (Result<void> made = make_writable_folder(folder); !made) return forward(made);
  const Result<int> lock = lock_folder(folder);
  if (!lock) return forward(lock);
  SessionRecorder recorder(folder, std::move(wanted), plan, std::move(write_file), *lock);

  std::error_code ignored;
  if (!fs::exists(folder / "session.json", ignored)) {
    if (Result<void> free = check_folder_is_free(folder, recorder.planned_); !free) {
      return forward(free);
    }
    recorder.remove_leftovers();
    return recorder;
  }
  Result<Session> session = read_session(folder);
  if (!session) return forward(session);
  if (const auto difference = plan_difference(*session, recorder.session_)) {
    return fail(ErrorKind::bad_input, folder.string(),
                fmt::format("holds a session of another scan: {}", *difference),
                "choose a new folder, or give the same options as when that scan began");
  }
  for (const SessionView& view : session->views) {
    if (!recorder.planned_.contains(view.image)) {
      return fail(
          ErrorKind::bad_input, folder.string(),
          fmt::format("holds a session of another scan: \"{}\" is not in the plan", view.image),
          "choose a new folder, or give the same options as when that scan began");
    }
  }
  recorder.session_ = std::move(*session);
  recorder.resumed_ = true;
  recorder.remove_leftovers();
  if (Result<void> kept = recorder.keep_intact_views(progress); !kept) return forward(kept);
  return recorder;
}

Result<void> SessionRecorder::keep_intact_views(const Progress& progress) {
  const bool was_complete = session_.complete.value_or(false);
  if (!was_complete && !session_.views.empty()) current_pass_ = session_.views.back().pass;

  std::vector<SessionView> intact;
  std::map<int, std::size_t> intact_in_pass;
  for (std::size_t i = 0; i < session_.views.size(); ++i) {
    if (progress.stop.stop_requested()) {
      return fail(ErrorKind::cancelled, folder_.string(),
                  "the check of recorded views was stopped");
    }
    progress.report(static_cast<double>(i) / static_cast<double>(session_.views.size()),
                    "checking recorded views");
    const SessionView& view = session_.views[i];
    if (verify_image(view, folder_)) {
      intact.push_back(view);
      ++intact_in_pass[view.pass];
    } else {
      replaced_.push_back(view.image);
    }
  }
  // The placement of any pass but the current one is gone. What such a pass lacks can't be added:
  // views of two placements would pass for one.
  const std::size_t planned_in_pass =
      planned_.size() / static_cast<std::size_t>(session_.plan->passes);
  std::erase_if(intact, [&](const SessionView& view) {
    const bool lost = current_pass_ != view.pass && intact_in_pass[view.pass] < planned_in_pass;
    if (lost) replaced_.push_back(view.image);
    return lost;
  });
  session_.views = std::move(intact);
  session_.complete = complete();
  return {};
}

bool SessionRecorder::recorded(const PlannedView& view) const {
  return std::ranges::find(session_.views, view.image, &SessionView::image) != session_.views.end();
}

int SessionRecorder::recorded_in_pass(int pass) const {
  return static_cast<int>(std::ranges::count(session_.views, pass, &SessionView::pass));
}

bool SessionRecorder::complete() const { return session_.views.size() == planned_.size(); }

Result<void> SessionRecorder::set_image_size(const std::string& camera, int width, int height) {
  const auto entry = std::ranges::find(session_.cameras, camera, &SessionCamera::id);
  if (entry == session_.cameras.end()) {
    return fail(ErrorKind::usage, camera, "is no camera of this session");
  }
  if (resumed_ && (entry->width != width || entry->height != height)) {
    return fail(ErrorKind::bad_input, folder_.string(),
                fmt::format("holds a session of another scan: the pictures of {} had {}x{} px and "
                            "now have {}x{}",
                            camera, entry->width, entry->height, width, height),
                "choose a new folder, or set the camera's format as it was");
  }
  entry->width = width;
  entry->height = height;
  return {};
}

Result<void> SessionRecorder::begin() {
  if (Result<void> made = make_writable_folder(folder_ / images_folder); !made) return made;
  if (Result<void> written = write_session_file(); !written) return written;
  remove_unrecorded_images();
  return {};
}

void SessionRecorder::remove_leftovers() {
  std::error_code ignored;
  fs::remove(folder_ / SpaceReserve::file_name, ignored);
  fs::remove(folder_ / (std::string("session.json") + part_suffix), ignored);
  for (const std::string& image : planned_) fs::remove(folder_ / (image + part_suffix), ignored);
  remove_unrecorded_images();
}

void SessionRecorder::remove_unrecorded_images() {
  std::set<std::string> unrecorded = planned_;
  for (const SessionView& view : session_.views) unrecorded.erase(view.image);
  std::error_code ignored;
  for (const std::string& image : unrecorded) fs::remove(folder_ / image, ignored);
}

Result<void> SessionRecorder::record(SessionView view, std::string_view image_bytes) {
  view.sha256 = sha256_hex(image_bytes);
  if (Result<void> written = write_file_(folder_ / view.image, image_bytes); !written) {
    return written;
  }
  session_.views.push_back(std::move(view));
  session_.complete = complete();
  if (Result<void> written = write_session_file(); !written) {
    session_.views.pop_back();
    session_.complete = false;
    return written;
  }
  return {};
}

Result<void> SessionRecorder::write_session_file() {
  const Result<std::string> text = format_session(session_);
  if (!text) return forward(text);
  return write_file_(folder_ / "session.json", *text);
}

}  // namespace skullstation
