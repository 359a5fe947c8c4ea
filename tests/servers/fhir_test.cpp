// FHIR R4 transactions: a double with ifNoneExist.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "tests/servers/servers.h"

namespace skullstation::testing {
namespace {

using ::testing::HasSubstr;

class Fhir : public Servers {
 protected:
  void SetUp() override { need({"/usr/bin/python3"}); }
  TargetConfig fhir() {
    TargetConfig config = target(DeliveryProtocol::fhir, "http://127.0.0.1:19001/fhir");
    config.secret = secret("token-1234");
    return config;
  }
};

TEST_F(Fhir, HoldsThePersonAndTheDocumentsOnce) {
  const auto server = start_fhir(folder_.path(), "token-1234");
  for (int time = 0; time < 3; ++time) EXPECT_EQ(arrives(fhir()), "");
  EXPECT_EQ(probe(fhir(), true), "");
  const auto opened = open_target(fhir()).value();
  const auto object = objects(fhir()).front();
  ASSERT_TRUE(opened->put(object, {})) << "a transaction twice";
  EXPECT_EQ(opened->read_back(object, {}).value(), object.sha256) << "and nothing is doubled";
  TargetConfig config = fhir();
  config.secret = secret("wrong");
  EXPECT_THAT(fails(config, ErrorKind::bad_input), HasSubstr("refuses access"));
}

TEST_F(Fhir, OtherDocumentsUnderTheSameIdentifierAreFound) {
  const auto server = start_fhir(folder_.path(), "token-1234");
  const auto another_package = [](std::string& text) {
    auto bundle = nlohmann::json::parse(text);
    auto& attachment = bundle["entry"].back()["resource"]["content"][0]["attachment"];
    attachment["extension"][0]["valueString"] = std::string(64, '0');
    text = bundle.dump();
  };
  EXPECT_THAT(finds_other_bytes(fhir(), another_package), HasSubstr("holds other bytes"));
}

TEST_F(Fhir, CutConnectionsLoseAndDoubleNothing) {
  const auto server = start_fhir(folder_.path(), "token-1234");
  TargetConfig config = fhir();
  config.address = "http://127.0.0.1:18506/fhir";
  survives_cuts(config, 18506, 19001, 1'500);
}

TEST_F(Fhir, WhatTheServerSaysOfAMistakeIsPassedOn) {
  const auto server = start_fhir(folder_.path(), "token-1234");
  auto object = objects(fhir()).front();
  std::string bundle = read_file(object.file).value();
  bundle.replace(bundle.find("\"current\""), 9, "\"present\"");
  ASSERT_TRUE(write_file_durably(object.file, bundle));
  const auto put = open_target(fhir()).value()->put(object, {});
  ASSERT_FALSE(put);
  EXPECT_THAT(put.error().message(), HasSubstr("HTTP 422): status"));
}

}  // namespace
}  // namespace skullstation::testing
