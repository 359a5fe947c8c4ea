// `skullstation step`, as the daemon calls it: what it says to requests that make no sense.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

class Step : public ::testing::Test {
 protected:
  /// What `skullstation step NAME` says to this request.
  skullstation::testing::ProcessResult step(const std::string& name, json request) {
    if (!request.is_null()) {
      EXPECT_TRUE(write_file_durably(folder_ / "request.json", request.dump()));
    }
    return skullstation::testing::skullstation_cli({"step", name, folder_.path().string()});
  }
  json request(const std::string& name, json inputs, json options) {
    return {{"format", "skullstation-step/1"},
            {"step", name},
            {"inputs", std::move(inputs)},
            {"options", std::move(options)},
            {"station", json::object()},
            {"out", (folder_ / "out").string()},
            {"threads", 1},
            {"seed", 1}};
  }

  TemporaryFolder folder_;
};

TEST_F(Step, ARequestThatMakesNoSenseIsNamed) {
  const json scan = {{"scan", (folder_ / "session").string()}};
  const auto missing = step("reconstruct", nullptr);
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr("request.json: can't be read"));
  const auto unknown = step("dance", request("dance", scan, json::object()));
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("step \"dance\": is not known; use one of: reconstruct"));
  EXPECT_THAT(step("reconstruct", request("approximate", scan, json::object())).err,
              HasSubstr("step: is not \"reconstruct\""));
  EXPECT_THAT(step("reconstruct", request("reconstruct", scan, {{"qualty", "fine"}})).err,
              HasSubstr("qualty"));
  EXPECT_THAT(step("reconstruct", request("reconstruct", scan, {{"quality", "superb"}})).err,
              HasSubstr("must be draft, standard or fine"));
  EXPECT_THAT(step("approximate", request("approximate", {{"reconstruct", folder_.path().string()}},
                                          {{"sex", "yes"}}))
                  .err,
              HasSubstr("must be male or female"));
  const auto no_session = step("reconstruct", request("reconstruct", scan, json::object()));
  EXPECT_EQ(no_session.exit_code, 3);
  EXPECT_THAT(no_session.err, HasSubstr("session"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

}  // namespace
}  // namespace skullstation
