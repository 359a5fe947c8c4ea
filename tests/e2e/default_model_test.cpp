#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string_view>

#include "core/file.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;
using testing::Process;
using testing::ProcessResult;
using testing::skullstation_cli;
using testing::TemporaryFolder;

/// The command that makes the default model, on a few people who were coarsely scanned.
TEST(MakeDefaultModel, GoesFromPeopleToAModelThatApproximates) {
  const char* wanted = std::getenv("SKULLSTATION_LONG");
  if (wanted == nullptr || std::string_view(wanted) != "1") {
    GTEST_SKIP() << "takes two minutes: ./run-tests --long";
  }
  const TemporaryFolder folder;
  const std::string model = (folder / "model.h5").string();
  ASSERT_EQ(::setenv("SKULLSTATION", testing::skullstation_program().c_str(), 1), 0);
  Process make({SKULLSTATION_SOURCE_DIR "/daemon/model/make-default-model", model, "7", "7",
                (folder / "work").string(), "2 2 2", "7", "10"});
  const ProcessResult made = make.wait();
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("person 003: --flaws cropped-calvaria,head-rest"));

  const ProcessResult info = skullstation_cli({"model", "info", model});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_THAT(info.out, HasSubstr("7 synthetic adults"));
  EXPECT_THAT(info.out, ::testing::ContainsRegex("[67] subjects"));
}

TEST(DefaultModel, IsPartOfTheProgram) {
  const ProcessResult info = skullstation_cli({"model", "info"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_THAT(info.out, HasSubstr("64 synthetic adults"));
}

}  // namespace
}  // namespace skullstation
