#pragma once

#include <filesystem>
#include <functional>

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "capture/scan/scan_plan.h"
#include "core/progress.h"
#include "core/result.h"
#include "core/session/session.h"

namespace skullstation {

using WriteFile = std::function<Result<void>(const std::filesystem::path&, std::string_view bytes)>;

/// What differs between a recorded session and the one that is wanted, for a person; nothing if
/// the scan can go on. Views, times and image sizes are not compared.
std::optional<std::string> plan_difference(const Session& recorded, const Session& wanted);

/// The capture session on the disk while it grows. At every moment session.json is valid and
/// lists exactly the views whose images are safely there, in the order in which they were taken.
class SessionRecorder {
 public:
  /// Opens a new or an interrupted session and locks the folder against a second scan. `wanted`
  /// is the session without views. What an interrupted scan left is removed: its space reserve,
  /// partly written files, and images of the plan that were never recorded. Recorded views are
  /// verified; those that can't be kept are forgotten (in memory: begin() makes it so on the disk).
  /// Errors (bad_input): the folder can't be written to, holds something else, another scan's plan,
  /// or is locked; cancelled.
  static Result<SessionRecorder> open(const std::filesystem::path& folder, Session wanted,
                                      const ScanPlan& plan, WriteFile write_file,
                                      const Progress& progress);
  ~SessionRecorder();
  SessionRecorder(SessionRecorder&& other) noexcept;
  SessionRecorder& operator=(SessionRecorder&&) = delete;
  SessionRecorder(const SessionRecorder&) = delete;
  SessionRecorder& operator=(const SessionRecorder&) = delete;

  const Session& session() const { return session_; }
  bool recorded(const PlannedView& view) const;
  int recorded_in_pass(int pass) const;
  bool complete() const;
  /// The pass that was being photographed when the scan was interrupted, the one of the view
  /// recorded last; nothing in a new or complete session. Only its placement still exists.
  std::optional<int> current_pass() const { return current_pass_; }
  /// Images that were recorded but are damaged, missing, or of a placement that is gone.
  const std::vector<std::string>& replaced() const { return replaced_; }

  /// The camera's image size; an error if the session has another one.
  Result<void> set_image_size(const std::string& camera, int width, int height);

  /// Writes session.json as it now is and removes the images of forgotten views.
  Result<void> begin();

  /// Writes the image, then the session with this view in it. `view.sha256` is filled in here.
  Result<void> record(SessionView view, std::string_view image_bytes);

 private:
  SessionRecorder(std::filesystem::path folder, Session session, const ScanPlan& plan,
                  WriteFile write_file, int lock);

  Result<void> keep_intact_views(const Progress& progress);
  Result<void> write_session_file();
  void remove_leftovers();
  void remove_unrecorded_images();

  std::filesystem::path folder_;
  Session session_;
  std::set<std::string> planned_;  // images
  WriteFile write_file_;
  int lock_;  // descriptor of the folder
  bool resumed_ = false;
  std::optional<int> current_pass_;
  std::vector<std::string> replaced_;
};

}  // namespace skullstation
