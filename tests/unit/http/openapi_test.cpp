// The description says what the routes do: the same paths, methods, roles and bodies.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "daemon/http/console.h"
#include "daemon/web/web_assets.h"

namespace skullstation {
namespace {

using nlohmann::json;

json description() { return json::parse(openapi_description()); }

std::string described_path(const Route& route) {
  return std::regex_replace(std::string(route.path), std::regex(R"(\*\})"), "}");
}

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

std::set<std::string> names_of(Roles roles) {
  if (roles == everybody) return {"everybody"};
  std::set<std::string> names;
  for (const Role role :
       {Role::viewer, Role::operates, Role::examiner, Role::administrator, Role::auditor}) {
    if ((roles & bit(role)) != 0) names.insert(to_string(role));
  }
  return names;
}

/// Every "$ref" leads somewhere.
void check_references(const json& part, const json& whole) {
  if (part.is_object() && part.contains("$ref")) {
    const std::string target = part["$ref"];
    ASSERT_EQ(target.substr(0, 2), "#/") << target;
    EXPECT_TRUE(whole.contains(json::json_pointer(target.substr(1)))) << target;
  }
  if (part.is_structured()) {
    for (const json& child : part) check_references(child, whole);
  }
}

TEST(OpenApi, DescribesEveryRouteAndNoOther) {
  const json whole = description();
  EXPECT_EQ(whole["openapi"], "3.1.0");
  EXPECT_EQ(whole["servers"][0]["url"], "/api/v1");
  EXPECT_TRUE(whole["info"].contains("title") && whole["info"].contains("version"));
  std::size_t described = 0;
  for (const json& path : whole["paths"]) described += path.size();
  EXPECT_EQ(described, api_routes().size());
  for (const Route& route : api_routes()) {
    const std::string path = described_path(route);
    const std::string method = lower(std::string(route.method));
    ASSERT_TRUE(whole["paths"].contains(path) && whole["paths"][path].contains(method))
        << method << " " << path;
    const json& operation = whole["paths"][path][method];
    const std::string name = method + " " + path;
    EXPECT_EQ(operation["x-roles"].get<std::set<std::string>>(), names_of(route.roles)) << name;
    EXPECT_EQ(operation["security"].empty(), route.roles == everybody) << name;
    EXPECT_EQ(operation.contains("requestBody"), route.has_body) << name;
    EXPECT_EQ(operation.value("x-audited", false), !route.audit.empty()) << name;
    EXPECT_FALSE(operation["summary"].get<std::string>().empty()) << name;
    EXPECT_TRUE(operation["responses"].contains("default")) << name;
    EXPECT_GE(operation["responses"].size(), 2u) << name;
    std::set<std::string> parts;
    for (const json& parameter : operation.value("parameters", json::array())) {
      if (parameter.value("in", "") == "path") {
        parts.insert(parameter["name"]);
        EXPECT_EQ(parameter["required"], true) << name;
      }
    }
    std::set<std::string> expected;
    static const std::regex part(R"(\{(\w+)\})");
    for (std::sregex_iterator match(path.begin(), path.end(), part), end; match != end; ++match) {
      expected.insert((*match)[1]);
    }
    EXPECT_EQ(parts, expected) << name;
  }
}

TEST(OpenApi, IsWholeInItself) {
  const json whole = description();
  check_references(whole, whole);
  std::set<std::string> ids;
  for (const json& path : whole["paths"]) {
    for (const json& operation : path) {
      EXPECT_TRUE(ids.insert(operation["operationId"]).second) << operation["operationId"];
    }
  }
  for (const Route& route : api_routes()) {
    EXPECT_TRUE(match_route(
        route.path, std::regex_replace(std::string(route.path), std::regex(R"(\{\w+\*?\})"), "7")))
        << route.path;
  }
}

TEST(Routes, MatchWholePaths) {
  EXPECT_TRUE(match_route("/cases/{case}", "/cases/7"));
  EXPECT_EQ(match_route("/cases/{case}/hold", "/cases/7/hold")->at("case"), "7");
  EXPECT_EQ(match_route("/jobs/{job}/files/{path*}", "/jobs/1/files/a/b c.txt")->at("path"),
            "a/b c.txt");
  for (const char* path :
       {"", "/", "/case/7", "/cases", "/cases/", "/cases/7/", "/cases/7/x", "cases/7"}) {
    EXPECT_FALSE(match_route("/cases/{case}", path)) << path;
  }
  EXPECT_FALSE(match_route("/jobs/{job}/files/{path*}", "/jobs/1/files"));
  EXPECT_FALSE(match_route("/jobs/{job}/files/{path*}", "/jobs/1/files/"));
}

}  // namespace
}  // namespace skullstation
