#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "daemon/station/station_config.h"

namespace {

namespace fs = std::filesystem;

/// A file in memory, where there is one, that lasts as long as the program.
const fs::path& config_file() {
  static const fs::path file = [] {
    std::string name = (fs::exists("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path()) /
                       "skullstation-config-XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    static const fs::path made = name;
    std::atexit([] { fs::remove_all(made); });
    return made / "station.toml";
  }();
  return file;
}

}  // namespace

/// Whatever the text says, it is a configuration or a list of problems in words; the answer to both
/// is the same a second time.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace skullstation;
  std::ofstream(config_file(), std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  const LoadedConfig loaded = load_config(config_file());
  for (const Error& problem : loaded.problems) {
    if (problem.message().empty()) __builtin_trap();
  }
  if (read_config(config_file()).has_value() != loaded.problems.empty()) __builtin_trap();
  return 0;
}
