#pragma once

#include <cstdint>
#include <filesystem>

#include "core/result.h"

namespace skullstation {

/// Disk space held by a file of its own, `.space_reserve`, that gives way as the real files come:
/// a scan that has begun can't run out of it midway. The destructor removes the file; after a
/// crash the next scan into the same folder takes it over.
class SpaceReserve {
 public:
  /// Takes `bytes` on the volume of `folder`. Fails (bad_input) if they are not free.
  static Result<SpaceReserve> take(const std::filesystem::path& folder, std::uint64_t bytes);

  SpaceReserve(SpaceReserve&& other) noexcept;
  SpaceReserve& operator=(SpaceReserve&&) = delete;
  SpaceReserve(const SpaceReserve&) = delete;
  SpaceReserve& operator=(const SpaceReserve&) = delete;
  ~SpaceReserve();

  /// Gives back all but `bytes`. Does nothing if no more than that is held.
  void shrink_to(std::uint64_t bytes);

  static constexpr const char* file_name = ".space_reserve";

 private:
  SpaceReserve(std::filesystem::path file, int descriptor, std::uint64_t bytes)
      : file_(std::move(file)), descriptor_(descriptor), bytes_(bytes) {}

  std::filesystem::path file_;
  int descriptor_;
  std::uint64_t bytes_;
};

}  // namespace skullstation
