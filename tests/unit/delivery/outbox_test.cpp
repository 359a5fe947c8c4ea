#include "daemon/delivery/outbox.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/file.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;
using enum DeliveryState;
using enum DeliveryEvent;

SealedPackage package(const std::string& sum = std::string(64, 'a')) {
  return {"/packages/one", "2026-0042", "ST-01", sum, {}};
}

class OutboxTest : public ::testing::Test {
 protected:
  OutboxTest() : outbox_(Outbox::open(folder_ / "outbox", clock_).value()) {}
  void pass(std::chrono::milliseconds time) { clock_.sleep_for(time, {}); }

  TemporaryFolder folder_;
  SimulatedClock clock_;
  std::unique_ptr<Outbox> outbox_;
};

TEST(DeliveryStates, EveryPairIsDecidedAndNothingIsEverDropped) {
  std::set<std::pair<DeliveryState, DeliveryEvent>> seen;
  for (const DeliveryTransition& t : delivery_transitions()) {
    EXPECT_TRUE(seen.emplace(t.from, t.event).second) << "decided twice";
    EXPECT_NE(t.from, delivered) << "delivered is final";
    EXPECT_EQ(t.to == delivered, t.event == verified) << "delivered without being read back";
  }
  for (const DeliveryState state : delivery_states()) {
    EXPECT_EQ(find_transition(state, retry) != nullptr,
              state == waiting || state == rejected || state == held);
    EXPECT_EQ(find_transition(state, begin) != nullptr, state == queued || state == waiting);
  }
}

TEST_F(OutboxTest, OfANewerProgramIsLeftAlone) {
  outbox_.reset();
  ASSERT_TRUE(Database::open(folder_ / "outbox/outbox.db")->execute("PRAGMA user_version = 9"));
  const auto opened = Outbox::open(folder_ / "outbox", clock_);
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().message(), HasSubstr("outbox.db: has format 9; this program knows 1"));
}

TEST(BackOff, GrowsToAnHourAndIsSpread) {
  for (const int attempts : {1, 2, 5, 9, 10, 50, 1'000'000}) {
    const auto longest =
        std::min<std::chrono::milliseconds>(1h, 10s * (1 << std::min(attempts - 1, 20)));
    std::set<std::int64_t> values;
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
      const auto pause = back_off(attempts, seed);
      EXPECT_GE(pause, longest / 2);
      EXPECT_LE(pause, longest);
      values.insert(pause.count());
    }
    EXPECT_GT(values.size(), 40U);
  }
}

TEST_F(OutboxTest, TheSameDeliveryIsInItOnce) {
  const auto first = outbox_->add(package(), "records").value();
  EXPECT_EQ(first.state, queued);
  EXPECT_EQ(outbox_->add(package(), "records").value().id, first.id);
  EXPECT_NE(outbox_->add(package(), "archive").value().id, first.id);
  EXPECT_NE(outbox_->add(package(std::string(64, 'b')), "records").value().id, first.id);
  EXPECT_EQ(outbox_->list().value().size(), 3U);
}

TEST_F(OutboxTest, GoesItsWayAndTellsTheOldestThatIsNotDelivered) {
  const auto id = outbox_->add(package(), "records").value().id;
  const auto other = outbox_->add(package(), "archive").value().id;
  {
    const auto sending = outbox_->begin_sending().value();
    EXPECT_EQ(sending->due().value().size(), 2U);
    EXPECT_EQ(sending->begin(id).value().attempts, 1);
    const auto failed =
        sending->failed(id, {ErrorKind::hardware, "host", "does not answer", ""}).value();
    EXPECT_EQ(failed.state, waiting);
    EXPECT_THAT(*failed.last_error, HasSubstr("does not answer"));
    EXPECT_EQ(sending->due().value().size(), 1U) << "it waits";
    pass(11s);
    EXPECT_EQ(sending->due().value().size(), 2U);
    ASSERT_TRUE(sending->begin(other));
    EXPECT_EQ(sending->verified(other, "sum").value().read_back_sha256, "sum");
    ASSERT_TRUE(sending->begin(id));
    EXPECT_EQ(sending->failed(id, {ErrorKind::bad_input, "host", "refuses", ""}).value().state,
              rejected);
    EXPECT_TRUE(sending->due().value().empty());
  }
  EXPECT_EQ(outbox_->oldest_undelivered().value()->id, id);
  EXPECT_EQ(outbox_->retry(id).value().state, queued);
  EXPECT_EQ(outbox_->hold(id).value().state, held);
  const auto twice = outbox_->hold(id);
  ASSERT_FALSE(twice);
  EXPECT_THAT(twice.error().message(), HasSubstr("is held: \"hold\" is not possible"));
  EXPECT_FALSE(outbox_->retry(other)) << "what is delivered is not sent again";
  EXPECT_FALSE(outbox_->retry(99));
}

TEST_F(OutboxTest, NeverGivesUp) {
  const auto id = outbox_->add(package(), "records").value().id;
  const auto sending = outbox_->begin_sending().value();
  for (int attempt = 1; attempt <= 200; ++attempt) {
    ASSERT_EQ(sending->due().value().size(), 1U) << attempt;
    ASSERT_TRUE(sending->begin(id));
    ASSERT_TRUE(sending->failed(id, {ErrorKind::hardware, "host", "is down", ""}));
    pass(1h);
  }
  EXPECT_EQ(outbox_->find(id).value().attempts, 200);
  EXPECT_EQ(outbox_->find(id).value().state, waiting);
}

TEST_F(OutboxTest, AClockThatWasWrongKeepsNothingForYears) {
  const auto id = outbox_->add(package(), "records").value().id;
  {
    const auto sending = outbox_->begin_sending().value();
    ASSERT_TRUE(sending->begin(id));
    pass(24h * 3650);  // ten years ahead
    ASSERT_TRUE(sending->failed(id, {ErrorKind::hardware, "host", "is down", ""}));
  }
  const SimulatedClock right;
  const auto outbox = Outbox::open(folder_ / "outbox", right).value();
  EXPECT_EQ(outbox->begin_sending().value()->due().value().size(), 1U);
}

TEST_F(OutboxTest, OneSendsAndWhatWasInterruptedIsQueuedAgain) {
  const auto id = outbox_->add(package(), "records").value().id;
  {
    const auto sending = outbox_->begin_sending().value();
    ASSERT_TRUE(sending->begin(id));
    const auto other = Outbox::open(folder_ / "outbox", clock_).value();
    EXPECT_EQ(other->begin_sending().value(), nullptr);
    EXPECT_FALSE(other->hold(id)) << "not while it is sent";
    EXPECT_EQ(other->find(id).value().state, DeliveryState::sending);
  }
  const auto again = outbox_->begin_sending().value();
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(outbox_->find(id).value().state, queued);
  ASSERT_TRUE(again->begin(id));
  EXPECT_EQ(again->failed(id, {ErrorKind::cancelled, "", "stopped", ""}).value().state, queued);
}

TEST_F(OutboxTest, DamageAndForeignStatesAreNamed) {
  ASSERT_TRUE(write_file_durably(folder_ / "bad/outbox.db", "") ||
              make_writable_folder(folder_ / "bad"));
  ASSERT_TRUE(write_file_durably(folder_ / "bad/outbox.db", std::string(4096, 'x')));
  const auto damaged = Outbox::open(folder_ / "bad", clock_);
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.error().message(), HasSubstr("outbox.db"));
  ASSERT_TRUE(outbox_->add(package(), "records"));
  auto database = Database::open(folder_ / "outbox/outbox.db");
  ASSERT_TRUE(database->execute("UPDATE deliveries SET state = 'teleported'"));
  EXPECT_THAT(outbox_->list().error().message(), HasSubstr("teleported"));
}

}  // namespace
}  // namespace skullstation
