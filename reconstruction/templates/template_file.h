#pragma once

#include <filesystem>

#include "core/result.h"
#include "reconstruction/registration/head_template.h"
#include "reconstruction/registration/skull_template.h"

namespace skullstation {

struct Templates {
  SkullTemplate skull;
  HeadTemplate head;
};

/// Writes both templates into one file (format: docs/registration.md), whole or not at all.
Result<void> write_templates(const Templates& templates, const std::filesystem::path& path);

/// Fails for a truncated, foreign or damaged file, and for templates that contradict themselves.
Result<Templates> read_templates(const std::filesystem::path& path);

}  // namespace skullstation
