#pragma once

#include "core/result.h"
#include "firmware_io/motion_plan.h"

namespace skullstation {

/// What the driver must know about a turntable.
struct TurntableConfig {
  MotionLimits limits;
  bool reversed = false;               ///< the DIR line's high level turns clockwise
  double backlash_deg = 0.5;           ///< overshoot before the final counter-clockwise approach
  double home_speed_deg_s = 10.0;      ///< while looking for the index switch
  double home_search_deg = 400.0;      ///< give up ("index switch never seen") after this much
  double home_offset_deg = 0.0;        ///< from the switch's edge to the zero
  bool release_when_idle = true;       ///< whoever scans calls release() at the end
  bool holds_without_current = false;  ///< a worm gear, say: release() keeps the position

  Result<void> validate() const;
};

}  // namespace skullstation
