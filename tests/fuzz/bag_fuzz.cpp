#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "daemon/evidence/package.h"
#include "daemon/evidence/package_check.h"

namespace {

namespace fs = std::filesystem;

/// A folder in memory, where there is one, that lasts as long as the program.
const fs::path& bag() {
  static const fs::path folder = [] {
    std::string name = (fs::exists("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path()) /
                       "skullstation-bag-XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    static const fs::path made = name;
    std::atexit([] { fs::remove_all(made); });
    return made;
  }();
  return folder;
}

}  // namespace

/// The input is the tag files of a bag one after the other, each ended by a byte 0; missing ones
/// are not written. No package is sound whose signatures nobody made.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace skullstation;
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  fs::create_directories(bag() / "signature");
  fs::create_directories(bag() / "data");
  for (const char* name :
       {tag_manifest_file, manifest_file, blocks_file, metadata_file, bag_info_file,
        provenance_file, public_key_file, certificate_file, ed25519_file, cms_file,
        audit_entry_file, signature_sums_file, "data/a", bagit_file}) {
    fs::remove(bag() / name);
    if (rest.empty() && name != bagit_file) continue;
    const std::string_view bytes = rest.substr(0, rest.find('\0'));
    rest.remove_prefix(std::min(rest.size(), bytes.size() + 1));
    std::ofstream(bag() / name, std::ios::binary) << bytes;
  }
  const auto check = check_package(bag(), std::nullopt);
  if (!check) __builtin_trap();
  if (check->findings.empty() && !(check->ed25519_valid && check->cms_signer)) __builtin_trap();
  for (const PackageFinding& finding : check->findings) {
    if (finding.what.empty()) __builtin_trap();
  }
  return 0;
}
