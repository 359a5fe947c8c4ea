#include "tests/servers/servers.h"

#include <sys/mount.h>

#include <sys/stat.h>

#include "core/file.h"
#include "core/random.h"
#include "daemon/evidence/package_check.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation::testing {

namespace fs = std::filesystem;

namespace {

/// Why no servers can be started here; empty: they can.
std::string no_network_because;

class OwnNetwork final : public ::testing::Environment {
 public:
  void SetUp() override { no_network_because = enter_own_network(); }
};
const auto* const own_network = ::testing::AddGlobalTestEnvironment(new OwnNetwork);

}  // namespace

void Servers::need(const std::vector<std::string>& programs) {
  if (!no_network_because.empty()) GTEST_SKIP() << no_network_because;
  for (const std::string& program : programs) {
    if (!fs::exists(program)) {
      GTEST_SKIP() << program << " is not installed (tests/servers/packages.txt)";
    }
  }
}

Servers::SmallDisks::~SmallDisks() {
  // Detached: a server may still be about to end.
  for (const fs::path& disk : mounted) ::umount2(disk.c_str(), MNT_DETACH);
}

bool Servers::make_small_disk(const std::string& name, const std::string& size) {
  const fs::path disk = make(name);
  const auto mount = [&] {
    if (::mount("none", disk.c_str(), "tmpfs", 0, ("size=" + size).c_str()) != 0) {
      GTEST_SKIP() << "nothing can be mounted here";
    }
    small_disks_.mounted.push_back(disk);
  };
  mount();
  return !small_disks_.mounted.empty();
}

const SealedPackage& Servers::package() {
  static const TemporaryFolder folder(Medium::memory);
  static const SealedPackage sealed =
      seal_small_case(folder.path(), long_form() ? 55'000'000 : 2'000'000);
  return sealed;
}

std::vector<DeliveryObject> Servers::objects(const TargetConfig& target) {
  return objects_for(target, package(), folder_ / "work").value();
}

Result<std::string> Servers::deliver(const TargetConfig& target) {
  EXPECT_TRUE(target.validate()) << target.validate().error().message();
  auto opened = open_target(target);
  if (!opened) return forward(opened);
  return deliver_objects(**opened, objects(target));
}

std::string Servers::arrives(const TargetConfig& target) {
  const auto sum = deliver(target);
  if (!sum) return sum.error().message();
  return *sum == sum_of(objects(target)) ? "" : "another sum";
}

std::string Servers::fails(const TargetConfig& target, ErrorKind kind) {
  const auto sum = deliver(target);
  if (sum) return "it was delivered";
  EXPECT_EQ(sum.error().kind, kind) << sum.error().message();
  return sum.error().message();
}

std::string Servers::probe(const TargetConfig& target, bool removed) {
  const auto probed = try_target(target, "ST-01", folder_ / "probe");
  if (!probed) return probed.error().message();
  return probed->removed == removed ? "" : "removed: " + std::to_string(probed->removed);
}

fs::path Servers::make(const std::string& name) {
  fs::create_directories(folder_ / name);
  return folder_ / name;
}

std::string Servers::secret(const std::string& text) {
  const auto file = folder_ / ("secret-" + sha256_hex(text).substr(0, 8));
  EXPECT_TRUE(write_file_durably(file, text));
  ::chmod(file.c_str(), 0600);
  return file;
}

TargetConfig Servers::target(DeliveryProtocol protocol, const std::string& address) {
  TargetConfig config;
  config.name = "records";
  config.protocol = protocol;
  config.address = address;
  return config;
}

TargetConfig Servers::with_certificate(TargetConfig config) {
  config.ca_file = certificates().ca();
  config.certificate_file = certificates().client();
  config.key_file = certificates().client_key();
  return config;
}

void Servers::expect_whole_package(const fs::path& root) {
  const auto check = check_package(root / package().remote_name(), {});
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_TRUE(check->findings.empty());
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    EXPECT_FALSE(entry.path().string().ends_with(".part")) << entry.path();
    files += entry.is_regular_file() ? 1 : 0;
  }
  EXPECT_EQ(files, std::ssize(package().files)) << "once, and nothing else";
}

std::string Servers::finds_other_bytes(const TargetConfig& config,
                                       const std::function<void(std::string&)>& change) {
  DeliveryObject other = objects(config).front();
  std::string bytes = read_file(other.file).value();
  change(bytes);
  other.file = make("other") / other.file.filename();
  EXPECT_TRUE(write_file_durably(other.file, bytes));
  other.bytes = bytes.size();
  other.sha256 = sha256_hex(bytes);
  const auto put = open_target(config).value()->put(other, {});
  EXPECT_TRUE(put) << put.error().message();
  return fails(config, ErrorKind::bad_input);
}

void Servers::survives_cuts(const TargetConfig& config, int from, int to, std::size_t most) {
  Random random(42);
  int cut = 0;
  for (int i = 0; i < 20; ++i) {
    const CuttingProxy proxy(from, to, random.below(most));
    const auto sent = deliver(config);
    if (sent) continue;
    EXPECT_EQ(sent.error().kind, ErrorKind::hardware) << sent.error().message();
    ++cut;
  }
  EXPECT_GT(cut, 5);
  const CuttingProxy proxy(from, to, std::size_t{1} << 40);
  EXPECT_EQ(arrives(config), "");
}

}  // namespace skullstation::testing
