#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

namespace skullstation::testing {

/// Runs the body in a process of its own, which alone sees a file system of this size (in memory)
/// at `folder`; a failure there is one here. False where the kernel does not allow this.
bool on_small_disk(const std::filesystem::path& folder, std::uint64_t bytes,
                   const std::function<void()>& body);

/// Within the body: another size; what is written is kept.
void resize_disk(const std::filesystem::path& folder, std::uint64_t bytes);
/// No byte more.
void leave_no_space(const std::filesystem::path& folder);

}  // namespace skullstation::testing
