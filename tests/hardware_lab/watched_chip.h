#pragma once

#include <functional>
#include <memory>
#include <string>

#include "firmware_io/gpio_chip.h"

namespace skullstation {

/// The kernel's chip at `path`, with an eye on one of its outputs: `active` is called, on the
/// thread that sets the line, each time after the line was set active. So the world outside can
/// answer a step at once, as a mechanical switch does, however slow the emulated machine is.
std::unique_ptr<GpioChip> open_watched_chip(const std::string& path, const std::string& line,
                                            std::function<void()> active);

}  // namespace skullstation
