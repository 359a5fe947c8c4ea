#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace skullstation::testing {

/// Writes DIR/station.toml: a simulated station with two cameras of 320x240 pixels and a small
/// synthetic specimen (DIR/specimen.ply), 4 views a ring and 2 passes unless `scan` says otherwise.
/// A scan of it takes about a second. The last arguments are appended to the sections they name.
struct SmallStation {
  int views_per_ring = 4;
  int passes = 2;
  std::string simulation;  ///< more lines of [simulation]
  std::string camera;      ///< more lines of the first camera's [camera.simulated]
  std::string extra;       ///< more of the file
};
std::filesystem::path write_small_station(const std::filesystem::path& folder,
                                          const SmallStation& station = {});

/// The same for a daemon that is to be quick in real time: 2 views a ring, and a turntable that
/// needs a blink. `camera` goes into the first camera's [camera.simulated], `station` into
/// [station], `extra` to the file's end.
std::filesystem::path write_quick_station(const std::filesystem::path& folder,
                                          const std::string& camera = "",
                                          const std::string& station = "",
                                          const std::string& extra = "");

/// `skullstationd` of this build, with fake_step (tests/support/fake_step.cpp) for its steps.
std::vector<std::string> daemon_command(const std::filesystem::path& config,
                                        const std::filesystem::path& storage);

}  // namespace skullstation::testing
