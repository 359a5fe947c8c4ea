#include "daemon/station/config_toml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

enum class Color { red, green };

struct Lamp {
  std::string name = "lamp";
  Color color = Color::red;
};

struct Example {
  bool on = false;
  int count = 3;
  double length_mm = 1.5;
  std::optional<double> focus;
  std::chrono::milliseconds settle{250};
  std::vector<Lamp> lamps;
};

ConfigWalk walk_of(Example& example) {
  return [&example](ConfigFields& fields) {
    fields.field("on", example.on, "whether it is on");
    fields.table("sizes", [&] {
      fields.field("count", example.count, "how many");
      fields.field("length_mm", example.length_mm, "how long");
      fields.field("focus", example.focus, "where it is sharp");
      fields.field("settle_ms", example.settle, "how long to wait");
    });
    fields.tables(
        "lamp", example.lamps.size(), [&](std::size_t n) { example.lamps.resize(n); },
        [&](std::size_t i) {
          fields.field("name", example.lamps[i].name, "its name");
          fields.field("color", example.lamps[i].color, {"red", "green"}, "its colour");
        });
  };
}

class ConfigToml : public ::testing::Test {
 protected:
  TomlReading read(const std::string& text) {
    EXPECT_TRUE(write_file_durably(folder_ / "s.toml", text));
    return read_toml(folder_ / "s.toml", walk_of(example_));
  }

  /// The only problem's message, without the folder's name.
  std::string problem(const std::string& text) {
    const auto reading = read(text);
    EXPECT_THAT(reading.problems, SizeIs(1));
    if (reading.problems.empty()) return {};
    return reading.problems[0].message().substr(folder_.path().string().size() + 1);
  }

  TemporaryFolder folder_;
  Example example_;
};

TEST_F(ConfigToml, WhatTheFileSaysIsSetAndTheRestKeepsItsDefault) {
  const auto reading = read(
      "on = true\n[sizes]\nlength_mm = 7\nfocus = 0.5\nsettle_ms = 40\n"
      "[[lamp]]\nname = \"a\"\ncolor = \"green\"\n[[lamp]]\n");
  EXPECT_THAT(reading.problems, IsEmpty());
  EXPECT_TRUE(example_.on);
  EXPECT_EQ(example_.count, 3);
  EXPECT_EQ(example_.length_mm, 7.0);
  EXPECT_EQ(example_.focus, 0.5);
  EXPECT_EQ(example_.settle, std::chrono::milliseconds(40));
  ASSERT_THAT(example_.lamps, SizeIs(2));
  EXPECT_EQ(example_.lamps[0].color, Color::green);
  EXPECT_EQ(example_.lamps[1].name, "lamp");
}

TEST_F(ConfigToml, AMistypedKeyIsNamedWithItsLineAndTheKeyThatWasMeant) {
  EXPECT_EQ(problem("[sizes]\ncount = 1\nlenght_mm = 7\n"),
            "s.toml:3: unknown key \"sizes.lenght_mm\"; did you mean \"length_mm\"?");
}

TEST_F(ConfigToml, AnUnknownTableIsNamed) {
  EXPECT_THAT(problem("[engine]\nfuel = 1\n"),
              HasSubstr("unknown key \"engine\"; known keys here: on, sizes, lamp"));
}

TEST_F(ConfigToml, AWrongTypeSaysWhatWasExpectedAndFound) {
  EXPECT_EQ(problem("on = 1\n"), "s.toml:1: on must be true or false, found a whole number");
  EXPECT_EQ(problem("[sizes]\ncount = 1.5\n"),
            "s.toml:2: sizes.count must be a whole number, found a number");
  EXPECT_EQ(problem("[sizes]\nlength_mm = \"7\"\n"),
            "s.toml:2: sizes.length_mm must be a number, found text");
  EXPECT_EQ(problem("sizes = 3\n"),
            "s.toml:1: sizes must be a table: [sizes], found a whole number");
  EXPECT_EQ(problem("lamp = 3\n"),
            "s.toml:1: lamp must be a list of tables: [[lamp]], found a whole number");
  EXPECT_EQ(problem("[[lamp]]\nname = 3\n"),
            "s.toml:2: lamp[0].name must be text in quotes, found a whole number");
}

TEST_F(ConfigToml, AWordThatIsNoChoiceListsTheChoices) {
  EXPECT_EQ(problem("[[lamp]]\ncolor = \"blue\"\n"),
            "s.toml:2: lamp[0].color can't be \"blue\"; use one of: red, green");
}

TEST_F(ConfigToml, AllProblemsAreReportedAtOnce) {
  EXPECT_THAT(read("onn = true\n[sizes]\ncount = true\nfocsu = 1\n").problems, SizeIs(3));
}

TEST_F(ConfigToml, BrokenSyntaxIsNamedWithItsLine) {
  EXPECT_THAT(problem("on = true\n[sizes\n"), HasSubstr("s.toml:2: not valid TOML"));
}

TEST_F(ConfigToml, AMissingFileIsNamed) {
  const auto reading = read_toml(folder_ / "none.toml", walk_of(example_));
  ASSERT_THAT(reading.problems, SizeIs(1));
  EXPECT_THAT(reading.problems[0].message(), HasSubstr("none.toml: can't be read"));
}

TEST_F(ConfigToml, WhatIsShownIsReadBackToTheSameValues) {
  const auto reading = read("[sizes]\nlength_mm = 0.1\n[[lamp]]\ncolor = \"green\"\n");
  const std::string shown = show_toml(walk_of(example_), reading.origins);
  EXPECT_THAT(shown, HasSubstr("length_mm = 0.1"));
  EXPECT_THAT(shown, HasSubstr("s.toml:2]"));
  EXPECT_THAT(shown, HasSubstr("# focus ="));
  Example back;
  ASSERT_TRUE(write_file_durably(folder_ / "shown.toml", shown));
  EXPECT_THAT(read_toml(folder_ / "shown.toml", walk_of(back)).problems, IsEmpty());
  EXPECT_EQ(back.length_mm, 0.1);
  EXPECT_EQ(back.settle, example_.settle);
  ASSERT_THAT(back.lamps, SizeIs(1));
  EXPECT_EQ(back.lamps[0].color, Color::green);
}

TEST_F(ConfigToml, TheJsonFormNamesTheOrigin) {
  const auto reading = read("on = true\n");
  const std::string json = show_json(walk_of(example_), reading.origins);
  EXPECT_THAT(json,
              HasSubstr("\"sizes.count\": {\n    \"value\": 3,\n    \"origin\": \"default\""));
  EXPECT_THAT(json, HasSubstr("s.toml:1"));
}

}  // namespace
}  // namespace skullstation
