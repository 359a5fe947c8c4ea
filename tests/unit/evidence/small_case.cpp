#include "tests/unit/evidence/small_case.h"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "core/file.h"
#include "core/random.h"
#include "tests/support/temporary_folder.h"

namespace skullstation::testing {

namespace fs = std::filesystem;

namespace {

void write(const fs::path& path, std::string_view bytes) {
  fs::create_directories(path.parent_path());
  if (!std::ofstream(path, std::ios::binary).write(bytes.data(), std::ssize(bytes))) {
    throw std::runtime_error("can't write " + path.string());
  }
}

struct KeysOnDisk {
  TemporaryFolder folder;
  fs::path keys = folder / "keys";
  StationKeys read;

  KeysOnDisk() {
    if (!create_station_keys(keys, {"TEST", 3650}, SimulatedClock())) {
      throw std::runtime_error("no keys");
    }
    read = read_station_keys(keys).value();
  }
};

const KeysOnDisk& keys_on_disk() {
  static const KeysOnDisk keys;
  return keys;
}

}  // namespace

PackageSource write_small_case(const fs::path& folder, std::size_t large_bytes) {
  const std::string skull = noise(3000, 1);
  const std::string photographs[] = {noise(5000, 2), noise(4000, 3)};
  std::string views;
  for (int i = 0; i < 2; ++i) {
    const std::string name = fmt::format("images/p0_c0_00{}.png", i);
    write(folder / "session" / name, photographs[i]);
    views += fmt::format(
        R"({}{{"image":"{}","camera":"cam0","captured":"2026-01-31T12:00:0{}Z","sha256":"{}"}})",
        i > 0 ? "," : "", name, i, sha256_hex(photographs[i]));
  }
  const std::string session = fmt::format(
      R"({{"format":"skullstation-session/1","created":"2026-01-31T12:00:00Z","station":"ST-01",)"
      R"("case":"2026-0042","cameras":[{{"id":"cam0","width":640,"height":480}}],"views":[{}]}})",
      views);
  write(folder / "session/session.json", session);
  write(folder / "reconstruction/cameras.json", session);
  write(folder / "reconstruction/skull.ply", skull);
  write(folder / "reconstruction/quality.json",
        R"({"format":"skullstation-reconstruction-quality/1","scale":{"source":"board"}})");
  write(folder / "case/case.json",
        fmt::format(
            R"({{"format":"skullstation-case/1","input":{{"file":"skull.ply","sha256":"{}"}},)"
            R"("model":{{"file":"default model","sha256":"{}","card":"Made of balls.",)"
            R"("subjects":3}},"program_version":"1.2.3","seed":7,"facts":{{"age_years":40.0}},)"
            R"("warnings":["78 % observed"]}})",
            sha256_hex(skull), std::string(64, 'b')));
  write(folder / "case/head.ply", noise(large_bytes, 4));
  write(folder / "case/variants/tissue_1_+2 100%.glb", noise(2000, 5));
  write(folder / "case/empty.csv", "");
  PackageSource source;
  source.case_folder = folder / "case";
  source.session = folder / "session";
  source.reconstruction = folder / "reconstruction";
  source.program_version = "1.2.3";
  return source;
}

const StationKeys& test_keys() { return keys_on_disk().read; }

const fs::path& test_keys_folder() { return keys_on_disk().keys; }

std::string noise(std::size_t bytes, std::uint64_t seed) {
  Random random(seed);
  std::string text(bytes, '\0');
  for (char& c : text) c = static_cast<char>(random.bits());
  return text;
}

void change_byte(const fs::path& file, std::uint64_t offset, unsigned char flip) {
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  stream.seekg(static_cast<std::streamoff>(offset));
  const int old = stream.get();
  stream.seekp(static_cast<std::streamoff>(offset));
  stream.put(static_cast<char>(old ^ flip));
  if (old < 0 || !stream.flush()) throw std::runtime_error("can't change " + file.string());
}

bool long_form() {
  const char* wanted = std::getenv("SKULLSTATION_LONG");
  return wanted != nullptr && std::string(wanted) == "1";
}

}  // namespace skullstation::testing
