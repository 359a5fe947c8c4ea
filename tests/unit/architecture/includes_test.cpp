// Reads every include of the product's sources and fails on an arrow that runs back.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace skullstation {
namespace {

namespace fs = std::filesystem;

/// The whole map of the house: what each folder may include besides itself. A folder that is not
/// named here fails the test, so that a new one has to take its place in the order.
const std::map<std::string, std::set<std::string>> allowed = {
    {"core", {}},
    {"core/session", {"core"}},
    {"core/adjustment", {"core"}},
    {"firmware_io", {"core"}},
    {"capture/cameras", {"core", "core/session"}},
    {"capture/calibration", {"core", "core/adjustment", "core/session"}},
    {"capture/simulation", {"core", "core/session", "firmware_io", "capture/cameras"}},
    {"capture/scan",
     {"core", "core/session", "firmware_io", "capture/cameras", "capture/calibration"}},
    {"reconstruction/anatomy", {"core"}},
    {"reconstruction/io", {"core"}},
    {"reconstruction/mesh", {"core"}},
    {"reconstruction/distance", {"core", "reconstruction/io"}},
    {"reconstruction/rendering", {"core"}},
    {"reconstruction/registration",
     {"core", "reconstruction/distance", "reconstruction/mesh", "reconstruction/rendering"}},
    {"reconstruction/statistics",
     {"core", "reconstruction/distance", "reconstruction/mesh", "reconstruction/registration"}},
    {"reconstruction/templates",
     {"core", "reconstruction/io", "reconstruction/mesh", "reconstruction/distance",
      "reconstruction/rendering", "reconstruction/registration", "reconstruction/phantom"}},
    {"reconstruction/volume", {"core", "reconstruction/io", "reconstruction/mesh"}},
    {"reconstruction/approximation",
     {"core", "reconstruction/anatomy", "reconstruction/distance", "reconstruction/mesh",
      "reconstruction/registration", "reconstruction/statistics", "reconstruction/volume"}},
    {"reconstruction/phantom",
     {"core", "reconstruction/anatomy", "reconstruction/io", "reconstruction/mesh",
      "reconstruction/distance", "reconstruction/volume"}},
    {"reconstruction/photogrammetry",
     {"core", "core/adjustment", "core/session", "reconstruction/io", "reconstruction/distance",
      "reconstruction/registration", "reconstruction/mesh"}},
    {"daemon",
     {"daemon/cli", "daemon/delivery", "daemon/http", "daemon/service",
      "reconstruction/rendering"}},
    {"daemon/service",
     {"core", "core/session", "firmware_io", "capture/scan", "daemon/station", "daemon/jobs",
      "daemon/delivery"}},
    {"daemon/web", {"core"}},
    {"daemon/http",
     {"core", "core/session", "daemon/service", "daemon/database", "daemon/delivery", "daemon/jobs",
      "daemon/evidence", "daemon/web"}},
    {"daemon/station",
     {"core", "core/session", "firmware_io", "capture/cameras", "capture/calibration",
      "capture/simulation", "capture/scan", "reconstruction/io", "reconstruction/phantom",
      "daemon/delivery"}},
    {"daemon/database", {"core"}},
    {"daemon/jobs", {"core", "daemon/database"}},
    {"daemon/report", {"core", "core/session", "reconstruction/rendering"}},
    {"daemon/subject",
     {"core", "core/session", "reconstruction/io", "reconstruction/rendering",
      "reconstruction/volume", "daemon/report"}},
    {"daemon/model",
     {"core", "reconstruction/io", "reconstruction/mesh", "reconstruction/phantom",
      "reconstruction/registration", "reconstruction/statistics", "reconstruction/templates",
      "daemon/report"}},
    {"daemon/case",
     {"core", "core/session", "reconstruction/io", "reconstruction/rendering",
      "reconstruction/registration", "reconstruction/statistics", "reconstruction/approximation",
      "daemon/report"}},
    {"daemon/evidence", {"core", "core/session"}},
    {"daemon/exhibit", {"core", "core/session", "reconstruction/io", "daemon/evidence"}},
    {"daemon/delivery",
     {"core", "core/session", "reconstruction/io", "daemon/evidence", "daemon/database"}},
    {"daemon/cli",
     {"core",
      "core/session",
      "firmware_io",
      "capture/cameras",
      "capture/calibration",
      "capture/simulation",
      "capture/scan",
      "reconstruction/io",
      "reconstruction/mesh",
      "reconstruction/distance",
      "reconstruction/rendering",
      "reconstruction/photogrammetry",
      "reconstruction/volume",
      "reconstruction/phantom",
      "reconstruction/registration",
      "reconstruction/templates",
      "reconstruction/statistics",
      "reconstruction/approximation",
      "daemon/station",
      "daemon/subject",
      "daemon/model",
      "daemon/case",
      "daemon/evidence",
      "daemon/exhibit",
      "daemon/delivery",
      "daemon/report"}},
};

/// Headers that take seconds to compile: for their own folder only, behind our own plain types.
const std::vector<std::string> heavy = {
    "CGAL/",        "ceres/",    "opencv2/", "embree3/",   "itk",    "gdcm",
    "boost/",       "exiv2/",    "gpiod",    "libcamera/", "toml",   "CLI/",
    "Eigen/Sparse", "nanoflann", "hdf5",     "hpdf",       "sqlite3"};

struct Include {
  fs::path file;
  int line = 0;
  std::string target;
  bool quoted = false;
};

std::vector<fs::path> sources_below(const fs::path& root) {
  std::vector<fs::path> files;
  for (const char* top : {"core", "firmware_io", "capture", "reconstruction", "daemon"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".h" || extension == ".cpp") {
        files.push_back(fs::relative(entry.path(), root));
      }
    }
  }
  return files;
}

std::vector<Include> includes_of(const fs::path& root, const fs::path& file) {
  static const std::regex directive(R"(^\s*#\s*include\s*(["<])([^">]+)[">])");
  std::vector<Include> includes;
  std::ifstream in(root / file);
  std::string text;
  for (int line = 1; std::getline(in, text); ++line) {
    std::smatch match;
    if (std::regex_search(text, match, directive)) {
      includes.push_back({file, line, match[2], match[1] == "\""});
    }
  }
  return includes;
}

std::vector<Include> all_includes() {
  const fs::path root = SKULLSTATION_SOURCE_DIR;
  std::vector<Include> includes;
  for (const fs::path& file : sources_below(root)) {
    const auto found = includes_of(root, file);
    includes.insert(includes.end(), found.begin(), found.end());
  }
  return includes;
}

std::string place(const Include& include) {
  return include.file.string() + ":" + std::to_string(include.line) + " includes " + include.target;
}

TEST(Architecture, EveryFolderHasItsPlaceInTheOrder) {
  for (const fs::path& file : sources_below(SKULLSTATION_SOURCE_DIR)) {
    EXPECT_TRUE(allowed.contains(file.parent_path().string()))
        << file << ": this folder is not on the map in " << __FILE__;
  }
}

TEST(Architecture, NoArrowRunsBack) {
  int checked = 0;
  for (const Include& include : all_includes()) {
    if (!include.quoted) continue;
    const std::string from = include.file.parent_path().string();
    const std::string to = fs::path(include.target).parent_path().string();
    EXPECT_TRUE(fs::exists(fs::path(SKULLSTATION_SOURCE_DIR) / include.target))
        << place(include) << ": include from the project's root";
    if (from == to || !allowed.contains(from)) continue;
    EXPECT_TRUE(allowed.at(from).contains(to))
        << place(include) << ": " << from << " must not know " << to;
    ++checked;
  }
  EXPECT_GT(checked, 20) << "the test no longer sees the sources";
}

TEST(Architecture, TheMapItselfHasNoCycle) {
  // A folder may only name folders from which it can't be reached.
  for (const auto& [folder, targets] : allowed) {
    std::set<std::string> reached;
    std::vector<std::string> open(targets.begin(), targets.end());
    while (!open.empty()) {
      const std::string next = open.back();
      open.pop_back();
      if (!reached.insert(next).second) continue;
      ASSERT_TRUE(allowed.contains(next)) << next;
      open.insert(open.end(), allowed.at(next).begin(), allowed.at(next).end());
    }
    EXPECT_FALSE(reached.contains(folder)) << folder << " depends on itself";
  }
}

bool is_heavy(const Include& include) {
  return !include.quoted && std::any_of(heavy.begin(), heavy.end(), [&](const std::string& prefix) {
    return include.target.rfind(prefix, 0) == 0;
  });
}

TEST(Architecture, HeavyHeadersReachNobodyOutsideTheirFolder) {
  const std::vector<Include> includes = all_includes();
  std::set<std::string> carriers;  // our headers that bring a heavy one with them
  for (const Include& include : includes) {
    if (include.file.extension() == ".h" && is_heavy(include)) carriers.insert(include.file);
  }
  for (bool grown = true; grown;) {
    grown = false;
    for (const Include& include : includes) {
      if (include.file.extension() == ".h" && carriers.contains(include.target)) {
        grown = carriers.insert(include.file).second || grown;
      }
    }
  }
  for (const Include& include : includes) {
    if (!include.quoted || !carriers.contains(include.target)) continue;
    EXPECT_EQ(include.file.parent_path(), fs::path(include.target).parent_path())
        << place(include) << ", which is heavy: put our own plain types between them";
  }
}

}  // namespace
}  // namespace skullstation
