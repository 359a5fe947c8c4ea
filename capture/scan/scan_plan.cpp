#include "capture/scan/scan_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace skullstation {

Result<void> ScanPlan::validate() const {
  const auto wrong = [](std::string where, std::string what) {
    return fail(ErrorKind::usage, "scan plan: " + std::move(where), std::move(what));
  };
  if (rings.empty()) return wrong("rings", "there is none; each camera needs one");
  std::set<std::string> cameras;
  for (const SessionPlan::Ring& ring : rings) {
    if (ring.camera.empty()) return wrong("rings", "a ring has no camera");
    if (!cameras.insert(ring.camera).second) {
      return wrong("rings", fmt::format("camera \"{}\" has two rings", ring.camera));
    }
    if (ring.views < 1 || ring.views > 1000) {
      return wrong("views", fmt::format("must be from 1 to 1000 a ring, not {}", ring.views));
    }
  }
  if (passes < 1 || passes > 10) {
    return wrong("passes", fmt::format("must be from 1 to 10, not {}", passes));
  }
  if (jpeg_quality < 1 || jpeg_quality > 100) {
    return wrong("jpeg_quality", fmt::format("must be from 1 to 100, not {}", jpeg_quality));
  }
  return {};
}

std::vector<ScanStop> stops_of_pass(const ScanPlan& plan, int pass) {
  const char* extension = plan.image_format == PhotographFormat::png ? "png" : "jpg";
  std::vector<PlannedView> views;
  for (int ring = 0; ring < static_cast<int>(plan.rings.size()); ++ring) {
    const int count = plan.rings[static_cast<std::size_t>(ring)].views;
    for (int view = 0; view < count; ++view) {
      views.push_back({pass, ring, 360.0 * view / count,
                       fmt::format("images/p{}_c{}_{:03}.{}", pass, ring, view, extension)});
    }
  }
  std::ranges::stable_sort(views, {}, &PlannedView::table_angle_deg);
  std::vector<ScanStop> stops;
  for (PlannedView& view : views) {
    // 360 * view / count is the same double wherever the fraction is the same, but for rounding.
    constexpr double same_angle_deg = 1e-9;
    if (stops.empty() || view.table_angle_deg - stops.back().table_angle_deg > same_angle_deg) {
      stops.push_back({view.table_angle_deg, {}});
    }
    stops.back().views.push_back(std::move(view));
  }
  return stops;
}

std::vector<PlannedView> planned_views(const ScanPlan& plan) {
  std::vector<PlannedView> views;
  for (int pass = 0; pass < plan.passes; ++pass) {
    for (ScanStop& stop : stops_of_pass(plan, pass)) {
      std::ranges::move(stop.views, std::back_inserter(views));
    }
  }
  return views;
}

}  // namespace skullstation
