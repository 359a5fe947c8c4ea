#pragma once

#include <filesystem>
#include <string>

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

}  // namespace skullstation::testing
