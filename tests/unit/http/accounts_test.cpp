#include "daemon/http/accounts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/file.h"
#include "daemon/http/approvals.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using skullstation::testing::Medium;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr PasswordCost cheap{64, 1};
const std::string password = "correct horse battery";

class AccountsTest : public ::testing::Test {
 protected:
  std::unique_ptr<Accounts> open() {
    AccountOptions options;
    options.cost = cheap;
    auto opened = Accounts::open(folder_ / "console.db", clock_, options);
    EXPECT_TRUE(opened);
    return opened ? *std::move(opened) : nullptr;
  }

  TemporaryFolder folder_{Medium::memory};
  SimulatedClock clock_;
  std::unique_ptr<Accounts> accounts_ = open();
};

TEST_F(AccountsTest, ArePutOnDiskWithoutTheirPasswords) {
  EXPECT_TRUE(*accounts_->none());
  ASSERT_TRUE(accounts_->add("anna", Role::administrator, password));
  accounts_ = open();
  EXPECT_FALSE(*accounts_->none());
  const auto anna = accounts_->check("anna", password);
  ASSERT_TRUE(anna && *anna);
  EXPECT_EQ((*anna)->role, Role::administrator);
  EXPECT_FALSE(*accounts_->check("anna", "correct horse batterz"));
  EXPECT_FALSE(*accounts_->check("nobody", password));
  EXPECT_FALSE(*accounts_->check("' OR 1=1 --", password));
  std::string kept = *read_file(folder_ / "console.db") + *read_file(folder_ / "console.db-wal");
  EXPECT_THAT(kept, HasSubstr("$argon2id$v=19$m=64,t=1,p=1$"));
  EXPECT_THAT(kept, Not(HasSubstr(password)));
}

TEST_F(AccountsTest, NamesAndPasswordsHaveTheirForm) {
  for (const char* name : {"", "a b", "ä", "a/b", "<b>", "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"}) {
    EXPECT_FALSE(accounts_->add(name, Role::viewer, password)) << name;
  }
  EXPECT_FALSE(accounts_->add("anna", Role::viewer, "short"));
  EXPECT_FALSE(accounts_->add("anna", Role::viewer, std::string(201, 'x')));
  EXPECT_FALSE(accounts_->add("anna", Role::viewer, "not UTF-8 \xff\xff\xff"));
  ASSERT_TRUE(accounts_->add("anna", Role::viewer, password));
  const auto twice = accounts_->add("anna", Role::viewer, password);
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().message(), "account \"anna\": is there already");
  EXPECT_FALSE(accounts_->set_role("berta", Role::viewer));
}

TEST_F(AccountsTest, AnAdministratorStays) {
  ASSERT_TRUE(accounts_->add("anna", Role::administrator, password));
  const auto last = accounts_->set_disabled("anna", true);
  ASSERT_FALSE(last);
  EXPECT_THAT(last.error().message(), HasSubstr("last administrator"));
  EXPECT_FALSE(accounts_->set_role("anna", Role::viewer));
  ASSERT_TRUE(accounts_->add("berta", Role::administrator, password));
  EXPECT_TRUE(accounts_->set_disabled("anna", true));
  EXPECT_FALSE(*accounts_->check("anna", password));
  EXPECT_FALSE(accounts_->set_role("berta", Role::viewer));
  EXPECT_TRUE(accounts_->set_disabled("anna", false));
  EXPECT_TRUE(accounts_->set_role("berta", Role::viewer));
}

TEST_F(AccountsTest, SignInsEnd) {
  ASSERT_TRUE(accounts_->add("anna", Role::examiner, password));
  const auto first = accounts_->sign_in("anna");
  const auto second = accounts_->sign_in("anna");
  ASSERT_TRUE(first && second);
  EXPECT_NE(first->token, second->token);
  EXPECT_EQ((*accounts_->signed_in(first->token))->role, Role::examiner);
  EXPECT_FALSE(*accounts_->signed_in(""));
  EXPECT_FALSE(*accounts_->signed_in(second->sign_in.csrf));

  ASSERT_TRUE(accounts_->sign_out(first->token));
  EXPECT_FALSE(*accounts_->signed_in(first->token));
  EXPECT_TRUE(*accounts_->signed_in(second->token));

  clock_.sleep_for(59min, {});
  EXPECT_TRUE(*accounts_->still_signed_in(second->token)) << "no sign of life";
  clock_.sleep_for(1min, {});
  EXPECT_FALSE(*accounts_->signed_in(second->token)) << "idle";

  const auto third = accounts_->sign_in("anna");
  for (int i = 0; i < 23; ++i) {
    clock_.sleep_for(30min, {});
    EXPECT_TRUE(*accounts_->signed_in(third->token)) << i;
  }
  clock_.sleep_for(30min, {});
  EXPECT_FALSE(*accounts_->signed_in(third->token)) << "never idle, but too long";
}

TEST_F(AccountsTest, SignInsEndWithWhatTheyStandOn) {
  ASSERT_TRUE(accounts_->add("anna", Role::examiner, password));
  auto held = accounts_->sign_in("anna");
  ASSERT_TRUE(accounts_->set_password("anna", "another password"));
  EXPECT_FALSE(*accounts_->signed_in(held->token));
  EXPECT_FALSE(*accounts_->check("anna", password));
  held = accounts_->sign_in("anna");
  accounts_ = open();  // the daemon began anew
  EXPECT_TRUE(*accounts_->signed_in(held->token));
  ASSERT_TRUE(accounts_->set_role("anna", Role::viewer));
  EXPECT_EQ((*accounts_->signed_in(held->token))->role, Role::viewer) << "at once";
  ASSERT_TRUE(accounts_->set_disabled("anna", true));
  EXPECT_FALSE(*accounts_->signed_in(held->token));
  const std::string kept = *read_file(folder_ / "console.db-wal");
  EXPECT_THAT(kept, Not(HasSubstr(held->token)));
}

TEST_F(AccountsTest, OfANewerProgramAreLeftAlone) {
  accounts_.reset();
  auto database = Database::open(folder_ / "console.db");
  ASSERT_TRUE(database->execute("PRAGMA user_version = 9"));
  const auto opened = Accounts::open(folder_ / "console.db", clock_);
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().message(), HasSubstr("has format 9"));
}

TEST_F(AccountsTest, ApprovalsAreGivenOnce) {
  const auto approvals = Approvals::open(folder_ / "console.db", clock_);
  ASSERT_TRUE(approvals);
  EXPECT_FALSE(*(*approvals)->of(3));
  ASSERT_TRUE((*approvals)->approve(3, "anna", "looks right"));
  const auto given = (*approvals)->of(3);
  ASSERT_TRUE(given && *given);
  EXPECT_EQ((*given)->by, "anna");
  EXPECT_EQ((*given)->note, "looks right");
  const auto twice = (*approvals)->approve(3, "berta", "");
  ASSERT_FALSE(twice);
  EXPECT_THAT(twice.error().message(), HasSubstr("was approved by anna"));
}

TEST(SetupCode, IsReadableAndNeverTheSame) {
  std::set<std::string> codes;
  for (int i = 0; i < 100; ++i) {
    const std::string code = random_code();
    EXPECT_THAT(code, ::testing::MatchesRegex("[A-Z2-9]{4}-[A-Z2-9]{4}-[A-Z2-9]{4}"));
    codes.insert(code);
  }
  EXPECT_EQ(codes.size(), 100u);
}

}  // namespace
}  // namespace skullstation
