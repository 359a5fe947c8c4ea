// What is embedded was made of the sources as they are, and both languages say everything.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "core/file.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

const fs::path web = fs::path(SKULLSTATION_SOURCE_DIR) / "daemon" / "web";

TEST(WebDist, IsMadeOfTheseSources) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(web / "src")) {
    if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), web).string());
  }
  std::ranges::sort(files);
  files.insert(files.begin(), "package-lock.json");
  std::string all;
  for (const std::string& file : files) all += file + "\n" + *read_file(web / file) + "\n";
  EXPECT_EQ(*read_file(web / "dist" / "SOURCES"), sha256_hex(all) + "\n")
      << "the console's sources were changed: run `npm ci && npm run build` in daemon/web";
}

TEST(WebDist, AsksNobodyElse) {
  // The pages may name addresses (licences, XML names); the policy lets them ask the station alone.
  const std::string page = *read_file(web / "dist" / "index.html");
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_THAT(*read_file(web / "dist" / "console.css"), Not(HasSubstr("url(")));
}

std::set<std::string> holes_of(const std::string& message) {
  static const std::regex hole(R"(\{\w+\})");
  std::set<std::string> holes;
  for (std::sregex_iterator match(message.begin(), message.end(), hole), end; match != end;
       ++match) {
    holes.insert(match->str());
  }
  return holes;
}

TEST(WebMessages, AreTheSameInBothLanguages) {
  const json en = json::parse(*read_file(web / "src/messages/en.json"));
  const json de = json::parse(*read_file(web / "src/messages/de.json"));
  EXPECT_EQ(en.size(), de.size());
  for (const auto& [key, message] : en.items()) {
    ASSERT_TRUE(de.contains(key)) << key;
    EXPECT_FALSE(de[key].get<std::string>().empty()) << key;
    EXPECT_EQ(holes_of(message), holes_of(de[key])) << key;
  }
}

/// The sources of what speaks to the person at the table, their string literals joined.
std::string program_text() {
  std::string all;
  for (const char* folder :
       {"capture", "daemon/jobs", "daemon/service", "daemon/station", "firmware_io"}) {
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(SKULLSTATION_SOURCE_DIR) / folder)) {
      if (entry.path().extension() == ".cpp") all += *read_file(entry.path());
    }
  }
  static const std::regex seam("\"\\s*\n\\s*\"");
  static const std::regex quote(R"(\\")");
  return std::regex_replace(std::regex_replace(all, seam, ""), quote, "\"");
}

TEST(WebMessages, KnowWhatTheStationSaysInEnglish) {
  const std::string program = program_text();
  const json german = json::parse(*read_file(web / "src/messages/station_de.json"));
  static const std::regex seam(R"(\{\w+\}|[:;)] )");
  for (const auto& [english, translated] : german.items()) {
    EXPECT_EQ(holes_of(english), holes_of(translated)) << english;
    std::sregex_token_iterator piece(english.begin(), english.end(), seam, -1);
    for (; piece != std::sregex_token_iterator(); ++piece) {
      EXPECT_NE(program.find(*piece), std::string::npos)
          << "nothing says \"" << *piece << "\" of \"" << english << "\"";
    }
  }
}

}  // namespace
}  // namespace skullstation
