#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;
using testing::ProcessResult;
using testing::skullstation_cli;
using testing::TemporaryFolder;

constexpr const char* triangle =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

TEST(Approximate, SaysWhatIsWrongWithItsInputs) {
  const TemporaryFolder folder;
  const std::string skull = (folder / "skull.ply").string();
  const std::string model = (folder / "model.h5").string();
  const std::string out = (folder / "case").string();
  ASSERT_TRUE(write_file_durably(skull, triangle));
  const auto approximate = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"approximate", skull, "--model", model, "--out", out};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return skullstation_cli(arguments);
  };
  ProcessResult result = approximate({});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("model.h5"));

  ASSERT_TRUE(write_file_durably(model, "no model at all"));
  result = approximate({});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("not a whole HDF5 file"));

  result = approximate({"--age", "7"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("age: must be 15 to 110"));
  EXPECT_EQ(approximate({"--sex", "unknown"}).exit_code, 2);

  ASSERT_TRUE(make_writable_folder(out));
  ASSERT_TRUE(write_file_durably(folder / "case/notes.txt", "keep me"));
  result = approximate({});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("is not empty"));
  EXPECT_FALSE(std::filesystem::exists(folder / "case/report.html"));
}

TEST(ModelCommands, NameWhatTheyCantRead) {
  const TemporaryFolder folder;
  ProcessResult result = skullstation_cli({"model", "info", (folder / "none.h5").string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("none.h5"));
  result = skullstation_cli({"model", "build", "--subjects", folder.path().string(), "--template",
                             (folder / "none.bin").string(), "--fits", (folder / "fits").string(),
                             "--out", (folder / "model.h5").string(), "--card", "nobody"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("none.bin"));
}

}  // namespace
}  // namespace skullstation
