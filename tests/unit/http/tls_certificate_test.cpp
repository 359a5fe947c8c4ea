#include "daemon/http/tls_certificate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using skullstation::testing::Medium;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

TEST(TlsCertificate, IsMadeOnce) {
  const TemporaryFolder folder(Medium::memory);
  const SystemClock clock;
  const auto first = own_certificate(folder / "tls", clock);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->fingerprint.size(), 95u);
  EXPECT_EQ(own_certificate(folder / "tls", clock)->fingerprint, first->fingerprint);
  EXPECT_EQ(fs::status(folder / "tls/key.pem").permissions(),
            fs::perms::owner_read | fs::perms::owner_write);
  // A crash between the two files: both are made anew.
  fs::remove(folder / "tls/certificate.pem");
  const auto again = own_certificate(folder / "tls", clock);
  ASSERT_TRUE(again);
  EXPECT_NE(again->fingerprint, first->fingerprint);
}

TEST(TlsCertificate, SaysWhatIsWrong) {
  const TemporaryFolder folder(Medium::memory);
  const SystemClock clock;
  ASSERT_TRUE(own_certificate(folder / "a", clock));
  ASSERT_TRUE(own_certificate(folder / "b", clock));
  const auto message = [&](const fs::path& chain, const fs::path& key) {
    const auto read = read_certificate(folder / chain, folder / key);
    return read ? "no error" : read.error().message();
  };
  EXPECT_THAT(message("a/certificate.pem", "b/key.pem"), HasSubstr("does not belong to the key"));
  EXPECT_THAT(message("a/none.pem", "a/key.pem"), HasSubstr("none.pem"));
  EXPECT_THAT(message("a/key.pem", "a/key.pem"), HasSubstr("holds no certificate"));
  ASSERT_TRUE(write_file_durably(folder / "a/empty.pem", ""));
  fs::permissions(folder / "a/empty.pem", fs::perms::owner_read);
  EXPECT_THAT(message("a/certificate.pem", "a/empty.pem"), HasSubstr("holds no unencrypted"));
  fs::permissions(folder / "b/key.pem", fs::perms::group_read, fs::perm_options::add);
  EXPECT_THAT(message("b/certificate.pem", "b/key.pem"), HasSubstr("others may read"));
}

}  // namespace
}  // namespace skullstation
