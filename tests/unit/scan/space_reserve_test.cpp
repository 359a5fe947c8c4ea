#include "capture/scan/space_reserve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;

using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::uint64_t bytes_on_disk(const fs::path& file) {
  struct stat status {};
  return ::stat(file.c_str(), &status) == 0 ? static_cast<std::uint64_t>(status.st_blocks) * 512
                                            : 0;
}

TEST(SpaceReserve, HoldsRealSpaceUntilItIsGivenBack) {
  const TemporaryFolder folder;
  const fs::path file = folder / SpaceReserve::file_name;
  {
    Result<SpaceReserve> reserve = SpaceReserve::take(folder.path(), 1'000'000);
    ASSERT_TRUE(reserve) << reserve.error().message();
    EXPECT_GE(bytes_on_disk(file), 1'000'000U);
    reserve->shrink_to(400'000);
    EXPECT_EQ(fs::file_size(file), 400'000U);
    EXPECT_LT(bytes_on_disk(file), 600'000U);
    reserve->shrink_to(900'000);
    EXPECT_EQ(fs::file_size(file), 400'000U);
    const SpaceReserve moved = std::move(*reserve);
    EXPECT_TRUE(fs::exists(file));
  }
  EXPECT_FALSE(fs::exists(file));
}

TEST(SpaceReserve, ALeftOverOneIsTakenOver) {
  const TemporaryFolder folder;
  std::ofstream(folder / SpaceReserve::file_name) << std::string(5'000'000, 'x');
  const Result<SpaceReserve> reserve = SpaceReserve::take(folder.path(), 1000);
  ASSERT_TRUE(reserve);
  EXPECT_EQ(fs::file_size(folder / SpaceReserve::file_name), 1000U);
}

TEST(SpaceReserve, TooMuchIsAnErrorThatSaysHowMuch) {
  const TemporaryFolder folder;
  const Result<SpaceReserve> reserve = SpaceReserve::take(folder.path(), std::uint64_t{1} << 60);
  ASSERT_FALSE(reserve);
  EXPECT_EQ(reserve.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(reserve.error().message(), HasSubstr("has no room for the scan: 1099511627776 MiB"));
  EXPECT_THAT(reserve.error().message(), HasSubstr("free some space"));
  EXPECT_FALSE(fs::exists(folder / SpaceReserve::file_name));
  EXPECT_FALSE(SpaceReserve::take(folder / "nowhere", 1));
}

}  // namespace
}  // namespace skullstation
