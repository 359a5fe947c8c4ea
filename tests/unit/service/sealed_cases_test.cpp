#include "daemon/service/sealed_cases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "core/file.h"
#include "daemon/delivery/delivery.h"
#include "daemon/evidence/package.h"
#include "daemon/evidence/package_check.h"
#include "tests/support/steps.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using skullstation::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class SealedCases : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "records");
    fs::create_directories(folder_ / "museum");
    targets_ = {target("records"), target("museum"), target("closed")};
    targets_.back().enabled = false;
    open();
  }
  /// As after a crash: whatever was not on the disk is gone.
  void open() {
    store_.reset();
    outbox_.reset();
    auto store = CaseStore::open(folder_ / "store", clock_, "1.2.3");
    ASSERT_TRUE(store) << store.error().message();
    store_ = *std::move(store);
    auto outbox = Outbox::open(folder_ / "outbox", clock_);
    ASSERT_TRUE(outbox) << outbox.error().message();
    outbox_ = *std::move(outbox);
  }
  TargetConfig target(const std::string& name) const {
    TargetConfig config;
    config.name = name;
    config.address = (folder_ / name).string();
    return config;
  }
  /// A case whose chain is made, the true package as the artifact of its `seal` job.
  Job sealed_case() {
    const auto chain = station_chain("draft", {}, {false, "", ""});
    const auto scanned = testing::scan_fake_case(*store_, "2026-0042", chain);
    EXPECT_TRUE(scanned);
    return make_outstanding();
  }
  /// Makes what waits; the last job.
  Job make_outstanding() {
    Job last;
    for (auto job = *store_->next_job(); job; job = *store_->next_job()) {
      last = *job;
      const fs::path out = folder_ / "out";
      fs::remove_all(out);
      if (job->step == seal_step) {
        const PackageSource source = testing::write_small_case(folder_ / "made");
        EXPECT_TRUE(write_package(source, {testing::test_keys(), std::nullopt, "test", {}}, clock_,
                                  out, 1));
      } else {
        fs::create_directories(out);
        std::ofstream(out / "made.txt") << job->id;
      }
      EXPECT_TRUE(store_->start(job->id));
      EXPECT_TRUE(store_->finish(job->id, {}, out));
    }
    return last;
  }
  Result<void> hand_over() { return hand_over_sealed_cases(*store_, *outbox_, targets_); }
  void send() {
    SenderOptions options;
    options.targets = targets_;
    const auto sent = send_due(*outbox_, options, clock_);
    ASSERT_TRUE(sent) << sent.error().message();
    EXPECT_TRUE(*sent);
  }
  std::vector<std::string> rows(std::int64_t case_id) {
    std::vector<std::string> words;
    const auto found = *deliveries_of(*store_, *outbox_, case_id);
    for (const Delivery& row : found) {
      words.push_back(row.target + " " + std::string(to_string(row.state)));
    }
    return words;
  }
  bool verified(std::int64_t case_id) { return store_->case_of(case_id)->verified.has_value(); }

  TemporaryFolder folder_{testing::Medium::memory};
  SimulatedClock clock_;
  std::vector<TargetConfig> targets_;
  std::unique_ptr<CaseStore> store_;
  std::unique_ptr<Outbox> outbox_;
};

TEST_F(SealedCases, GoToEveryEnabledTargetAndAreVerifiedOnceAllHaveArrived) {
  const Job seal = sealed_case();
  EXPECT_THAT(rows(seal.case_id), IsEmpty());
  ASSERT_TRUE(hand_over());
  EXPECT_THAT(rows(seal.case_id), ElementsAre("records queued", "museum queued"));
  const fs::path package = package_folder(*store_, seal);
  const auto check = check_package(package, {});
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_THAT(check->findings, IsEmpty());

  fs::rename(folder_ / "museum", folder_ / "museum is closed");
  send();
  ASSERT_TRUE(hand_over());
  EXPECT_THAT(rows(seal.case_id), ElementsAre("records delivered", "museum waiting"));
  EXPECT_FALSE(verified(seal.case_id));
  fs::rename(folder_ / "museum is closed", folder_ / "museum");
  clock_.sleep_for(1h, {});
  send();
  ASSERT_TRUE(hand_over());
  EXPECT_THAT(rows(seal.case_id), ElementsAre("records delivered", "museum delivered"));
  EXPECT_TRUE(verified(seal.case_id));
  for (const char* name : {"records", "museum"}) {
    const auto there = check_package(*fs::directory_iterator(folder_ / name), {});
    ASSERT_TRUE(there) << there.error().message();
    EXPECT_THAT(there->findings, IsEmpty()) << name;
  }
}

TEST_F(SealedCases, NothingIsLostOrDoubledWhereverACrashComes) {
  const Job seal = sealed_case();
  const fs::path package = package_folder(*store_, seal);
  // While the package was being laid out; after that, before the outbox had it; after one target.
  fs::create_directories(package.parent_path() /
                         ("." + package.filename().string() + ".unfinished/x"));
  open();
  ASSERT_TRUE(hand_over());
  const auto first = *deliveries_of(*store_, *outbox_, seal.case_id);
  for (int crash = 0; crash < 3; ++crash) {
    open();
    if (crash == 1) fs::remove_all(package);  // by somebody; the store has its bytes
    ASSERT_TRUE(hand_over());
    EXPECT_TRUE(fs::exists(package / "bagit.txt"));
    const auto again = *deliveries_of(*store_, *outbox_, seal.case_id);
    ASSERT_THAT(again, SizeIs(2));
    EXPECT_EQ(again[0].id, first[0].id);
    EXPECT_EQ(again[1].id, first[1].id);
  }
  send();
  open();  // after the receivers had it, before the case was marked
  EXPECT_FALSE(verified(seal.case_id));
  ASSERT_TRUE(hand_over());
  EXPECT_TRUE(verified(seal.case_id));
  EXPECT_THAT(*outbox_->list(), SizeIs(2));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "records"), fs::directory_iterator()),
            1);
}

TEST_F(SealedCases, AResultThatWasMadeAnewIsNotVerifiedByTheOldOnesDelivery) {
  const Job seal = sealed_case();
  ASSERT_TRUE(hand_over());
  send();
  ASSERT_TRUE(store_->rerun(seal.case_id, "approximate", R"({"age_years": 50})"));
  ASSERT_TRUE(hand_over());
  EXPECT_FALSE(verified(seal.case_id));
  const Job anew = make_outstanding();
  EXPECT_EQ(anew.step, seal_step);
  EXPECT_NE(anew.id, seal.id);
  ASSERT_TRUE(hand_over());
  EXPECT_FALSE(verified(seal.case_id));
  send();
  ASSERT_TRUE(hand_over());
  EXPECT_TRUE(verified(seal.case_id));
  EXPECT_THAT(rows(seal.case_id), SizeIs(4)) << "both results were delivered";
}

TEST_F(SealedCases, WithoutATargetTheyStayAndAreNeverVerified) {
  targets_.clear();
  const Job seal = sealed_case();
  ASSERT_TRUE(hand_over());
  ASSERT_TRUE(hand_over());
  EXPECT_TRUE(fs::exists(package_folder(*store_, seal) / "bagit.txt"));
  EXPECT_FALSE(verified(seal.case_id));
  clock_.sleep_for(1000h, {});
  EXPECT_THAT(*store_->remove_expired(1h), IsEmpty());
  targets_ = {target("records")};  // named later
  ASSERT_TRUE(hand_over());
  EXPECT_THAT(rows(seal.case_id), ElementsAre("records queued"));
}

TEST_F(SealedCases, AreDeletedWithTheirCase) {
  const Job seal = sealed_case();
  ASSERT_TRUE(hand_over());
  send();
  ASSERT_TRUE(hand_over());
  const fs::path package = package_folder(*store_, seal);
  ASSERT_TRUE(remove_packages_of_deleted_cases(*store_));
  EXPECT_TRUE(fs::exists(package)) << "its case is still there";
  clock_.sleep_for(100h, {});
  EXPECT_THAT(*store_->remove_expired(24h), ElementsAre(seal.case_id));
  ASSERT_TRUE(remove_packages_of_deleted_cases(*store_));
  EXPECT_FALSE(fs::exists(package));
  ASSERT_TRUE(hand_over());
  EXPECT_FALSE(fs::exists(package));
  EXPECT_THAT(rows(seal.case_id), ElementsAre("records delivered", "museum delivered"));
}

TEST_F(SealedCases, ADamagedOneIsToldAndHoldsNoOtherBack) {
  const Job bad = sealed_case();
  const Job good = sealed_case();
  ASSERT_NE(bad.case_id, good.case_id);
  const auto files = *store_->files(bad.id);
  const auto signature = std::ranges::find(files, "signature/cms.p7s", &ArtifactFile::path);
  ASSERT_NE(signature, files.end());
  fs::permissions(store_->blob(*signature), fs::perms::owner_write, fs::perm_options::add);
  std::ofstream(store_->blob(*signature)) << "rot";
  const auto handed = hand_over();
  ASSERT_FALSE(handed);
  EXPECT_THAT(handed.error().message(), HasSubstr("is damaged: signature/cms.p7s"));
  EXPECT_THAT(rows(bad.case_id), IsEmpty());
  EXPECT_THAT(rows(good.case_id), SizeIs(2));
}

}  // namespace
}  // namespace skullstation
