#pragma once

#include <chrono>

#include "core/clock.h"
#include "firmware_io/gpio_lines.h"
#include "firmware_io/press_detector.h"
#include "firmware_io/station_hardware.h"
#include "firmware_io/turntable_config.h"

namespace skullstation {

/// How the station is wired (docs/hardware.md). The defaults are the line names of the station's
/// device-tree overlay and contacts to ground; an E-stop that opens a contact (as it must) reads
/// as active when its wire breaks.
struct GpioStationConfig {
  std::string chip;  ///< name, label or path; empty: every chip is searched

  GpioWire step{"turntable-step"};
  GpioWire direction{"turntable-dir"};  ///< TurntableConfig::reversed turns it round
  GpioWire enable{"turntable-enable", true};
  GpioWire home{"turntable-home", true, GpioBias::pull_up};
  GpioWire estop{"estop", false, GpioBias::pull_up};
  GpioWire door{};  ///< active while open
  GpioWire button{"start-button", true, GpioBias::pull_up};
  GpioWire green{"lamp-green"};
  GpioWire yellow{"lamp-yellow"};
  GpioWire red{"lamp-red"};
  GpioWire buzzer{"buzzer"};
  GpioWire lights{"lights"};

  /// High time of a step pulse (DRV8825: at least 1.9 us).
  std::chrono::microseconds step_pulse{5};
  ButtonTiming button_timing;

  /// Everything that moves or stops the platter has a line, no line serves two ends, times are
  /// sensible. Errors name the key below [gpio].
  Result<void> validate() const;
};

/// Opens all lines or none. Lamps, buzzer, lights and motor current are off afterwards; a stop
/// pressed already has tripped the interlock. `clock` is the SystemClock, on whose time base the
/// kernel stamps edges.
/// Errors (kind hardware): a line that is missing, ambiguous or in use; a chip that is missing or
/// may not be opened. Kind bad_input: the configuration is not valid.
Result<StationHardware> open_gpio_station(const GpioStationConfig& config,
                                          const TurntableConfig& turntable, Clock& clock);

/// The same on lines found elsewhere.
Result<StationHardware> open_gpio_station(const GpioStationConfig& config,
                                          const TurntableConfig& turntable, Clock& clock,
                                          GpioLines lines);

}  // namespace skullstation
