#include "daemon/delivery/secret.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cstdlib>

#include "core/file.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

class SecretTest : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& text, mode_t mode) {
    const auto file = folder_ / "secret";
    EXPECT_TRUE(write_file_durably(file, text));
    ::chmod(file.c_str(), mode);
    return file;
  }
  static std::string fault_of(const std::string& where) {
    const auto secret = read_secret(where);
    return secret ? "" : secret.error().message();
  }

  TemporaryFolder folder_;
};

TEST_F(SecretTest, IsReadFromAFileOfItsOwnerAndNoCoreDumpIsLeft) {
  const auto secret = read_secret(write("open sesame\n", 0600));
  ASSERT_TRUE(secret);
  EXPECT_STREQ(secret->reveal(), "open sesame");
  rlimit cores{};
  ::getrlimit(RLIMIT_CORE, &cores);
  EXPECT_EQ(cores.rlim_max, 0U);
}

TEST_F(SecretTest, IsRefusedWhereOthersMayReadOrWriteIt) {
  for (const mode_t mode : {0640U, 0604U, 0620U, 0602U, 0610U}) {
    EXPECT_THAT(fault_of(write("x", mode)), HasSubstr("that others may read or write")) << mode;
  }
}

TEST_F(SecretTest, NothingAndTooMuchAreNamedWithoutTellingIt) {
  EXPECT_THAT(fault_of(write("\n", 0600)), HasSubstr("in one line"));
  EXPECT_THAT(fault_of(write("open\nsesame", 0600)), HasSubstr("in one line"));
  EXPECT_THAT(fault_of(write("open\nsesame", 0600)), ::testing::Not(HasSubstr("sesame")));
  EXPECT_THAT(fault_of(folder_ / "none"), HasSubstr("none"));
  EXPECT_THAT(fault_of(folder_.path()), HasSubstr("is no file"));
  EXPECT_THAT(fault_of("../x"), HasSubstr("neither an absolute path nor"));
}

TEST_F(SecretTest, ComesFromSystemd) {
  write("open sesame", 0440);
  EXPECT_THAT(fault_of("secret"), HasSubstr("LoadCredential=secret:FILE"));
  ::setenv("CREDENTIALS_DIRECTORY", folder_.path().c_str(), 1);
  EXPECT_EQ(fault_of("secret"), "");
  ::unsetenv("CREDENTIALS_DIRECTORY");
}

TEST(Secret, IsMovedNotCopied) {
  Secret first("open sesame");
  Secret second(std::move(first));
  EXPECT_TRUE(first.empty());  // NOLINT(bugprone-use-after-move): that is what is tested
  first = std::move(second);
  EXPECT_STREQ(first.reveal(), "open sesame");
  EXPECT_TRUE(second.empty());  // NOLINT(bugprone-use-after-move)
}

}  // namespace
}  // namespace skullstation
