#include "daemon/exhibit/exhibit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/session/image_file.h"
#include "daemon/evidence/bag_manifest.h"
#include "daemon/evidence/block_list.h"
#include "daemon/evidence/cms_signature.h"
#include "daemon/evidence/package.h"
#include "daemon/evidence/signature.h"
#include "daemon/exhibit/glb_container.h"
#include "reconstruction/io/glb.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/evidence/small_case.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using skullstation::testing::Medium;
using skullstation::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TriangleMesh tetrahedron(double edge_mm) {
  TriangleMesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << 0, 0, 0, edge_mm, 0, 0, 0, edge_mm, 0, 0, 0, edge_mm;
  mesh.triangles.resize(4, 3);
  mesh.triangles << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
  return mesh;
}

void set_sum(std::vector<ManifestLine>& lines, const std::string& path, const std::string& bytes) {
  std::ranges::find(lines, path, &ManifestLine::path)->sha256 = sha256_hex(bytes);
}

/// Puts other bytes into a package and seals it anew: it is as it was sealed, though by nobody who
/// looked at what he sealed.
void seal_other_bytes(const fs::path& package, const std::string& path, const std::string& bytes) {
  const auto text = [&](const char* file) { return read_file(package / file).value(); };
  const auto put = [&](const char* file, const std::string& content) {
    ASSERT_TRUE(write_file_durably(package / file, content));
  };
  put(path.c_str(), bytes);
  auto payload = parse_manifest(text(manifest_file), "").value();
  set_sum(payload, path, bytes);
  put(manifest_file, format_manifest(payload));
  auto blocks = parse_block_list(text(blocks_file), "").value();
  blocks[path] = {bytes.size(), sha256_hex(bytes), {sha256_hex(bytes)}};
  put(blocks_file, format_block_list(blocks));
  auto tags = parse_manifest(text(tag_manifest_file), "").value();
  for (const char* file : {manifest_file, blocks_file}) set_sum(tags, file, text(file));
  put(tag_manifest_file, format_manifest(tags));
  const std::string sealed = text(tag_manifest_file);
  put(ed25519_file, ed25519_sign(testing::test_keys(), sealed));
  put(cms_file, cms_sign(testing::test_keys(), sealed, SimulatedClock().utc_now()).value());
  auto signatures = parse_manifest(text(signature_sums_file), "").value();
  for (const char* file : {ed25519_file, cms_file}) set_sum(signatures, file, text(file));
  put(signature_sums_file, format_manifest(signatures));
}

class ExhibitTest : public ::testing::Test {
 protected:
  void SetUp() override {
    source_ = testing::write_small_case(folder_.path());
    json record = json::parse(*read_file(folder_ / "case/case.json"));
    // A quarter turn about z, then up by 10 mm.
    record["anatomical_from_input"] = {{0, -1, 0, 1}, {1, 0, 0, 2}, {0, 0, 1, 10}, {0, 0, 0, 1}};
    ASSERT_TRUE(write_file_durably(folder_ / "case/case.json", record.dump()));
    ASSERT_TRUE(write_glb(tetrahedron(200.0), folder_ / "case/head.glb"));
    ASSERT_TRUE(write_glb(tetrahedron(100.0), folder_ / "reconstruction/skull.glb"));
    ASSERT_TRUE(
        write_file_durably(folder_ / "case/preview_face_front.png", encode_png(Image8(40, 30, 3))));
    label_ = {"Museum of Bones", "© Museum of Bones, CC BY-NC 4.0",
              "https://creativecommons.org/licenses/by-nc/4.0/", "https://museum.example/cases"};
  }
  Result<std::vector<std::string>> exhibit() {
    const auto sealed = write_package(source_, {testing::test_keys(), std::nullopt, "test", {}},
                                      SimulatedClock(), folder_ / "package", 1);
    if (!sealed) return forward(sealed);
    return write_exhibit(folder_ / "package", label_, "1.2.3", folder_ / "exhibit");
  }
  std::string refused() {
    const auto shown = write_exhibit(folder_ / "package", label_, "1.2.3", folder_ / "new");
    if (shown) return "it was shown";
    EXPECT_FALSE(fs::exists(folder_ / "new"));
    EXPECT_EQ(shown.error().kind, ErrorKind::bad_input);
    return shown.error().message();
  }
  json shown(const char* file) { return json::parse(*read_file(folder_ / "exhibit" / file)); }

  TemporaryFolder folder_{Medium::memory};
  PackageSource source_;
  ExhibitLabel label_;
};

TEST_F(ExhibitTest, ModelsSayWhoseAndWhatTheyAreAndKeepTheirShape) {
  const auto files = exhibit();
  ASSERT_TRUE(files) << files.error().message();
  EXPECT_THAT(*files, ElementsAre("skull.glb", "head.glb", "preview_face_front.png",
                                  "scene.svx.json", "manifest.json"));
  const std::string sum = *sha256_of_file(folder_ / "package/tagmanifest-sha256.txt");
  for (const auto& [name, sealed] : {std::pair("skull.glb", "reconstruction/skull.glb"),
                                     std::pair("head.glb", "case/head.glb")}) {
    const auto bytes = *read_file(folder_ / "exhibit" / name);
    const auto glb = split_glb(bytes, name);
    ASSERT_TRUE(glb) << glb.error().message();
    const auto before = split_glb(*read_file(folder_ / sealed), name);
    EXPECT_EQ(glb->chunks, before->chunks) << "the surface as it was";
    EXPECT_EQ(glb->gltf["accessors"], before->gltf["accessors"]);
    const json asset = glb->gltf["asset"];
    EXPECT_EQ(asset["version"], "2.0");
    EXPECT_EQ(asset["copyright"], label_.rights);
    EXPECT_EQ(asset["generator"], "skullstation 1.2.3");
    EXPECT_EQ(asset["extras"]["case"], "2026-0042");
    EXPECT_EQ(asset["extras"]["station"], "ST-01");
    EXPECT_EQ(asset["extras"]["units"], "metre");
    EXPECT_EQ(asset["extras"]["package_sha256"], sum);
    EXPECT_THAT(asset["extras"]["warnings"].dump(), HasSubstr("Made of balls."));
    EXPECT_EQ(asset["extensions"]["KHR_xmp_json_ld"]["packet"], 0);
    const json packet = glb->gltf["extensions"]["KHR_xmp_json_ld"]["packets"][0];
    EXPECT_EQ(packet["dc:identifier"], "2026-0042");
    EXPECT_EQ(packet["xmpRights:WebStatement"], label_.rights_url);
    EXPECT_THAT(glb->gltf["extensionsUsed"], ElementsAre("KHR_xmp_json_ld"));
    EXPECT_EQ(bytes.size() % 4, 0U);
    EXPECT_EQ(join_glb(*glb), bytes);
  }
}

TEST_F(ExhibitTest, TheSceneHoldsBothInOneFrame) {
  ASSERT_TRUE(exhibit());
  const json scene = shown("scene.svx.json");
  EXPECT_EQ(scene["asset"]["type"], "application/si-dpo-3d.document+json");
  EXPECT_EQ(scene["setups"][0]["units"], "mm");
  EXPECT_EQ(scene["nodes"][0]["name"], "Skull as scanned");
  // Of glTF's axes x, z, -y, in columns.
  EXPECT_EQ(scene["nodes"][0]["matrix"], json({0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1, 10, -2, 1}));
  EXPECT_FALSE(scene["nodes"][1].contains("matrix"));
  const json model = scene["models"][1];
  EXPECT_EQ(model["units"], "m");
  EXPECT_EQ(model["boundingBox"]["max"], json({0.2F, 0.2F, 0.0F}));
  const json asset = model["derivatives"][0]["assets"][0];
  EXPECT_EQ(asset["uri"], "head.glb");
  EXPECT_EQ(asset["numFaces"], 4);
  EXPECT_EQ(asset["byteSize"], fs::file_size(folder_ / "exhibit/head.glb"));
  EXPECT_EQ(scene["metas"][0]["collection"]["titles"]["EN"],
            "Case 2026-0042: skull and facial approximation");
}

TEST_F(ExhibitTest, TheManifestIsWrittenWhereItsAddressIsKnown) {
  ASSERT_TRUE(exhibit());
  const json manifest = shown("manifest.json");
  EXPECT_EQ(manifest["id"], "https://museum.example/cases/exhibit/manifest.json");
  EXPECT_EQ(manifest["type"], "Manifest");
  EXPECT_EQ(manifest["rights"], "http://creativecommons.org/licenses/by-nc/4.0/")
      << "as the registry spells it";
  EXPECT_EQ(manifest["requiredStatement"]["value"]["en"][0], label_.rights);
  EXPECT_EQ(manifest["rendering"][1]["id"], "https://museum.example/cases/exhibit/head.glb");
  const json canvas = manifest["items"][0];
  EXPECT_EQ(canvas["width"], 40);
  EXPECT_EQ(canvas["items"][0]["items"][0]["target"], canvas["id"]);
  EXPECT_EQ(canvas["items"][0]["items"][0]["body"]["height"], 30);
}

TEST_F(ExhibitTest, ALicenceOfNoRegistryIsToldButNotAsRights) {
  label_.rights_url = "https://museum.example/licence";
  ASSERT_TRUE(exhibit());
  const json manifest = shown("manifest.json");
  EXPECT_FALSE(manifest.contains("rights"));
  EXPECT_THAT(manifest["metadata"].dump(), HasSubstr(label_.rights_url));
}

TEST_F(ExhibitTest, NamesOfAnyKindBecomeAddresses) {
  ASSERT_TRUE(write_file_durably(folder_ / "case/preview_from left #1.png",
                                 *read_file(folder_ / "case/preview_face_front.png")));
  ASSERT_TRUE(exhibit());
  ASSERT_TRUE(write_exhibit(folder_ / "package", label_, "1.2.3", folder_ / "Schädel 7/"));
  const json manifest = json::parse(*read_file(folder_ / "Schädel 7/manifest.json"));
  EXPECT_EQ(manifest["id"], "https://museum.example/cases/Sch%C3%A4del%207/manifest.json");
  EXPECT_EQ(manifest["items"][1]["items"][0]["items"][0]["body"]["id"],
            "https://museum.example/cases/Sch%C3%A4del%207/preview_from%20left%20%231.png");
}

TEST_F(ExhibitTest, WithoutWordsNothingIsSaidAndWithoutReconstructionTheHeadIsAlone) {
  label_ = {};
  source_.reconstruction.reset();
  const auto files = exhibit();
  ASSERT_TRUE(files) << files.error().message();
  EXPECT_THAT(*files, ElementsAre("head.glb", "preview_face_front.png", "scene.svx.json"));
  const auto glb = split_glb(*read_file(folder_ / "exhibit/head.glb"), "head.glb");
  EXPECT_FALSE(glb->gltf["asset"].contains("copyright"));
  EXPECT_THAT(glb->gltf.dump(), Not(HasSubstr("xmpRights:Owner")));
}

TEST_F(ExhibitTest, WhatIsNotAsItWasSealedIsNotShown) {
  ASSERT_TRUE(exhibit());
  const auto again = write_exhibit(folder_ / "package", label_, "1.2.3", folder_ / "exhibit");
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().kind, ErrorKind::usage);
  testing::change_byte(folder_ / "package/data/case/head.glb", 30, 1);
  EXPECT_THAT(refused(), HasSubstr("is not as it was sealed (data/case/head.glb"));
}

TEST_F(ExhibitTest, ASealedRecordThatIsNoCaseIsNamed) {
  ASSERT_TRUE(exhibit());
  const std::string record = "data/case/case.json";
  for (const auto& [bytes, words] :
       {std::pair("[]", "case.json: is no JSON object"), std::pair("7", "is no JSON object"),
        std::pair(R"({"format":)", "case.json: line 1, column 10: is not valid JSON"),
        std::pair(R"({"model":{},"model":{}})", "has the key \"model\" twice"),
        std::pair(R"({"model":7})", "has a \"model\" that is no JSON object"),
        std::pair(R"({"model":null})", "has a \"model\" that is no JSON object")}) {
    seal_other_bytes(folder_ / "package", record, bytes);
    EXPECT_THAT(refused(), HasSubstr(words)) << bytes;
  }
  // Odd, but nothing that is shown depends on it.
  for (const char* bytes : {"{}", R"({"warnings":7,"model":{"card":[]},"anatomical_from_input":7})",
                            R"({"anatomical_from_input":[[1,0,0,"x"]]})"}) {
    seal_other_bytes(folder_ / "package", record, bytes);
    EXPECT_EQ(refused(), "it was shown") << bytes;
    fs::remove_all(folder_ / "new");
  }
}

TEST_F(ExhibitTest, ACaseWithAHeadThatIsNoModelIsNamed) {
  auto odd = split_glb(*read_file(folder_ / "case/head.glb"), "head.glb").value();
  odd.gltf["asset"] = json::array();
  for (const std::string& bytes :
       {std::string("not a model"), std::string("glTF\2\0\0\0\x14\0\0\0\xff\0\0\0JSON", 20),
        read_file(folder_ / "case/head.glb")->substr(0, 100), join_glb(odd)}) {
    ASSERT_TRUE(write_file_durably(folder_ / "case/head.glb", bytes));
    fs::remove_all(folder_ / "package");
    const auto shown = exhibit();
    ASSERT_FALSE(shown);
    EXPECT_THAT(shown.error().message(), HasSubstr("head.glb: is no binary glTF 2.0 file"));
  }
}

}  // namespace
}  // namespace skullstation
