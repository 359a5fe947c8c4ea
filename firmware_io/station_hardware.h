#pragma once

#include <memory>

#include "firmware_io/interlock.h"
#include "firmware_io/panel.h"
#include "firmware_io/turntable.h"

namespace skullstation {

/// Everything of the station that is not a camera. Made by open_gpio_station() or
/// SimulatedStation; all parts are always there. Members are destroyed bottom up: the turntable,
/// which looks at the interlock, goes first.
struct StationHardware {
  std::unique_ptr<Interlock> interlock;
  std::unique_ptr<Button> button;
  std::unique_ptr<SignalLamp> lamp;
  std::unique_ptr<Lights> lights;
  std::unique_ptr<Turntable> turntable;
};

}  // namespace skullstation
