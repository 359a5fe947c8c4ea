#include "daemon/delivery/delivery.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>

#include <map>

#include "core/file.h"
#include "daemon/evidence/audit_check.h"
#include "daemon/evidence/package_check.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/delivery/sealed_case.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;
using enum DeliveryState;

/// Keeps objects in memory; does what a receiver must not do, if it is told to.
class FakeTarget final : public Target {
 public:
  std::map<std::string, std::string> held;
  int puts = 0;
  bool loses = false;

  Result<void> put(const DeliveryObject& object, const Progress&) override {
    ++puts;
    if (!loses) held.emplace(object.name, read_file(object.file).value());  // never replaces
    return {};
  }
  Result<std::optional<std::string>> read_back(const DeliveryObject& object,
                                               const Progress&) override {
    const auto found = held.find(object.name);
    if (found == held.end()) return std::optional<std::string>();
    return std::optional(sha256_hex(found->second));
  }
  Result<bool> remove(const DeliveryObject&) override { return false; }
};

class DeliveryTest : public ::testing::Test {
 protected:
  DeliveryTest() : package_(testing::seal_small_case(folder_.path(), 3000)) {
    fs::create_directories(share_);
    target_.name = "share";
    target_.address = share_.string();
    options_.targets = {target_};
    outbox_ = Outbox::open(folder_ / "outbox", clock_).value();
  }
  Delivery send(std::int64_t id) {
    const auto sent = send_due(*outbox_, options_, clock_);
    EXPECT_TRUE(sent && *sent) << sent.error().message();
    return outbox_->find(id).value();
  }
  fs::path remote() const { return share_ / package_.remote_name(); }

  TemporaryFolder folder_{testing::Medium::memory};
  SealedPackage package_;
  fs::path share_ = folder_ / "share";
  TargetConfig target_;
  SenderOptions options_;
  SimulatedClock clock_;
  std::unique_ptr<Outbox> outbox_;
};

TEST_F(DeliveryTest, APackagesSumChangesWithItsSealsAndItsName) {
  EXPECT_EQ(package_.case_number, "2026-0042");
  EXPECT_EQ(package_.files.back().path, "bagit.txt") << "comes last: its folder is complete";
  for (const ManifestLine& line : package_.files) {
    EXPECT_EQ(sha256_of_file(package_.folder / line.path).value(), line.sha256) << line.path;
  }
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(package_.folder)) {
    files += entry.is_regular_file() ? 1 : 0;
  }
  EXPECT_EQ(std::ssize(package_.files), files) << "every file is delivered";
  EXPECT_EQ(package_.remote_name(), "2026-0042_" + package_.sha256.substr(0, 16));
  SealedPackage odd = package_;
  odd.case_number = "../ü/x";
  EXPECT_EQ(odd.remote_name().find('/'), std::string::npos);
  EXPECT_FALSE(odd.remote_name().starts_with('.'));
  EXPECT_THAT(read_sealed_package(share_).error().message(), HasSubstr("is no sealed package"));
}

TEST_F(DeliveryTest, IsDeliveredOnceThoughSentThreeTimes) {
  FakeTarget target;
  const auto objects = objects_for(target_, package_, folder_ / "work").value();
  for (int time = 0; time < 3; ++time) {
    EXPECT_EQ(deliver_objects(target, objects).value(), sum_of(objects));
  }
  EXPECT_EQ(target.puts, std::ssize(objects));
}

TEST_F(DeliveryTest, OtherBytesUnderTheSameNameAreFoundAndKept) {
  FakeTarget target;
  const auto objects = objects_for(target_, package_, folder_ / "work").value();
  target.held[objects[2].name] = "somebody else's";
  const auto sent = deliver_objects(target, objects);
  ASSERT_FALSE(sent);
  EXPECT_EQ(sent.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(sent.error().message(), HasSubstr("holds other bytes under this name"));
  EXPECT_EQ(target.held[objects[2].name], "somebody else's");
}

TEST_F(DeliveryTest, AReceiverThatOnlySaysYesIsNotBelieved) {
  FakeTarget target;
  target.loses = true;
  const auto sent = deliver_objects(target, objects_for(target_, package_, "").value());
  ASSERT_FALSE(sent);
  EXPECT_EQ(sent.error().kind, ErrorKind::hardware);
  EXPECT_THAT(sent.error().message(), HasSubstr("does not hold it"));
}

TEST_F(DeliveryTest, ArrivesInAFolderAsAWholePackage) {
  options_.audit = DeliveryAudit{{folder_ / "audit.jsonl", "ST-01"}, testing::test_keys(), "test"};
  const auto id = outbox_->add(package_, "share").value().id;
  const Delivery row = send(id);
  EXPECT_EQ(row.state, delivered) << row.last_error.value_or("");
  EXPECT_EQ(row.read_back_sha256, sum_of(objects_for(target_, package_, "").value()));
  const auto check = check_package(remote(), {});
  ASSERT_TRUE(check);
  EXPECT_TRUE(check->findings.empty());
  EXPECT_THAT(read_file(folder_ / "audit.jsonl").value(), HasSubstr("\"what\":\"delivery\""));
  EXPECT_TRUE(check_audit_file(folder_ / "audit.jsonl", {}, {}).value().findings.empty());
  for (const auto& entry : fs::recursive_directory_iterator(share_)) {
    EXPECT_FALSE(entry.path().filename().string().ends_with(".part"));
  }
  EXPECT_FALSE(fs::exists(folder_ / "outbox/work" / std::to_string(id)));
}

TEST_F(DeliveryTest, AMissingShareWaitsAndAChangedFileThereIsRejected) {
  const auto id = outbox_->add(package_, "share").value().id;
  fs::remove(share_);
  Delivery row = send(id);
  EXPECT_EQ(row.state, waiting);
  EXPECT_THAT(*row.last_error, HasSubstr("see whether the share is mounted"));
  fs::create_directories(remote());
  ASSERT_TRUE(write_file_durably(remote() / "bagit.txt", "other"));
  clock_.sleep_for(std::chrono::hours(1), {});
  row = send(id);
  EXPECT_EQ(row.state, rejected);
  EXPECT_THAT(*row.last_error, HasSubstr("bagit.txt: the receiver holds other bytes"));
  EXPECT_EQ(read_file(remote() / "bagit.txt").value(), "other");
}

TEST_F(DeliveryTest, AFileThatChangedHereIsNotBlamedOnTheReceiver) {
  const auto id = outbox_->add(package_, "share").value().id;
  testing::change_byte(package_.folder / "data/case/large.bin", 17, 1);
  const Delivery row = send(id);
  EXPECT_EQ(row.state, rejected);
  EXPECT_THAT(*row.last_error, HasSubstr("large.bin: is not as it was sealed"));
  EXPECT_FALSE(fs::exists(remote())) << "nothing of it was sent";
}

TEST_F(DeliveryTest, PackageAndTargetThatWentAwayAreNamed) {
  const auto id = outbox_->add(package_, "share").value().id;
  fs::rename(package_.folder, folder_ / "elsewhere");
  EXPECT_THAT(*send(id).last_error, HasSubstr("the package is not there"));
  EXPECT_EQ(outbox_->find(id).value().state, waiting);
  fs::copy(folder_ / "elsewhere", package_.folder, fs::copy_options::recursive);
  ASSERT_TRUE(write_file_durably(package_.folder / "signature/sha256.txt", ""));
  ASSERT_TRUE(outbox_->retry(id));
  EXPECT_THAT(*send(id).last_error, HasSubstr("is not the package that was to be delivered"));
  options_.targets.clear();
  ASSERT_TRUE(outbox_->retry(id));
  EXPECT_THAT(*send(id).last_error, HasSubstr("is no longer in the configuration"));
  EXPECT_EQ(outbox_->find(id).value().state, rejected);
}

TEST_F(DeliveryTest, DisabledAndClosedTargetsAreLeftQueued) {
  const auto id = outbox_->add(package_, "share").value().id;
  options_.targets[0].enabled = false;
  EXPECT_EQ(send(id).state, queued);
  options_.targets[0].enabled = true;
  options_.targets[0].hours = "03:00-04:00";
  EXPECT_EQ(send(id).state, queued);
  EXPECT_EQ(send(id).attempts, 0);
}

TEST_F(DeliveryTest, IsStoppedOnRequest) {
  const auto id = outbox_->add(package_, "share").value().id;
  std::stop_source stop;
  stop.request_stop();
  Progress progress;
  progress.stop = stop.get_token();
  const auto sent = send_due(*outbox_, options_, clock_, progress);
  ASSERT_FALSE(sent);
  EXPECT_EQ(sent.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(outbox_->find(id).value().state, queued);
}

TEST_F(DeliveryTest, AProbeGoesThereAndBack) {
  const auto probed = try_target(target_, "ST-01", folder_ / "probe").value();
  EXPECT_TRUE(probed.removed);
  EXPECT_TRUE(fs::is_empty(share_));
  EXPECT_FALSE(fs::exists(folder_ / "probe"));
  target_.mounted = true;
  target_.address = "/usr";
  const auto not_mounted = try_target(target_, "ST-01", folder_ / "probe");
  ASSERT_FALSE(not_mounted);
  EXPECT_THAT(not_mounted.error().message(), HasSubstr("nothing is mounted there"));
}

TEST_F(DeliveryTest, AFullDiskAtTheReceiverWaits) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root may mount a small file system";
  if (::mount("none", share_.c_str(), "tmpfs", 0, "size=16k") != 0) {
    GTEST_SKIP() << "nothing can be mounted here";
  }
  const auto id = outbox_->add(package_, "share").value().id;
  const Delivery row = send(id);
  bool left = false;
  for (const auto& entry : fs::recursive_directory_iterator(share_)) {
    left = left || entry.path().filename().string().ends_with(".part");
  }
  ::umount(share_.c_str());
  EXPECT_EQ(row.state, waiting);
  EXPECT_THAT(*row.last_error, HasSubstr("the receiver's disk is full"));
  EXPECT_FALSE(left);
}

}  // namespace
}  // namespace skullstation
