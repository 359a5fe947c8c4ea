#include "daemon/delivery/fhir_bundle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/delivery/sealed_case.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using Json = nlohmann::ordered_json;

TEST(FhirBundle, IsATransactionThatDoublesNothing) {
  const TemporaryFolder folder(testing::Medium::memory);
  const auto package = testing::seal_small_case(folder.path());
  ASSERT_TRUE(make_writable_folder(folder / "work"));
  const auto objects = write_fhir_bundle(package, folder / "work").value();
  ASSERT_EQ(objects.size(), 1U);
  const Json bundle = Json::parse(read_file(objects[0].file).value());
  EXPECT_EQ(bundle["type"], "transaction");
  ASSERT_EQ(bundle["entry"].size(), 3U);
  const Json& patient = bundle["entry"][0]["resource"];
  EXPECT_EQ(patient["resourceType"], "Patient");
  EXPECT_EQ(patient["identifier"][0]["value"], "2026-0042");
  for (const Json& entry : bundle["entry"]) {
    EXPECT_EQ(entry["request"]["ifNoneExist"], "identifier=" + fhir_identifier(entry["resource"]));
    if (entry["resource"].contains("subject")) {
      EXPECT_EQ(entry["resource"]["subject"]["reference"], bundle["entry"][0]["fullUrl"]);
    }
  }
  const auto documents = fhir_documents(bundle);
  ASSERT_EQ(documents.size(), 2U);
  const Json& attachment = documents[0]["content"][0]["attachment"];
  EXPECT_EQ(attachment["size"], 21);
  EXPECT_EQ(attachment["data"], "JVBERi0xLjQKb2RkCiUlRU9GCi4u");  // base64 of the report
  EXPECT_EQ(attachment["extension"][0]["valueString"],
            sha256_of_file(folder / "case/report.pdf").value());
  EXPECT_EQ(documents[1]["identifier"][0]["value"], package.sha256);
}

TEST(FhirBundle, ItsSumFollowsWhatTheDocumentsCarry) {
  const TemporaryFolder folder(testing::Medium::memory);
  const auto probe = write_fhir_probe("ST-01", folder.path()).value();
  const Json bundle = Json::parse(read_file(probe.file).value());
  auto documents = fhir_documents(bundle);
  EXPECT_EQ(fhir_sum(documents), probe.sha256);
  documents[0]["id"] = "17";  // what a server adds
  documents[0]["meta"] = {{"versionId", "1"}};
  EXPECT_EQ(fhir_sum(documents), probe.sha256);
  documents[0]["content"][0]["attachment"]["data"] = "AAAA";
  EXPECT_NE(fhir_sum(documents), probe.sha256);
  EXPECT_TRUE(fhir_documents(Json::parse("[1]")).empty());
  EXPECT_TRUE(fhir_documents(Json::parse(R"({"entry":[{"resource":3},7]})")).empty());
}

}  // namespace
}  // namespace skullstation
