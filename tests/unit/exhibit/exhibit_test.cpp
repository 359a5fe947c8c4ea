#include "daemon/exhibit/exhibit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/session/image_file.h"
#include "daemon/evidence/package.h"
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
              "https://creativecommons.org/licenses/by-nc/4.0/",
              "https://museum.example/cases/2026-0042/"};
  }
  Result<std::vector<std::string>> exhibit() {
    const auto sealed = write_package(source_, testing::test_keys(), std::nullopt, "test",
                                      SimulatedClock(), folder_ / "package", 1);
    if (!sealed) return forward(sealed);
    return write_exhibit(folder_ / "package", label_, "1.2.3", folder_ / "exhibit");
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
  EXPECT_EQ(manifest["id"], "https://museum.example/cases/2026-0042/manifest.json");
  EXPECT_EQ(manifest["type"], "Manifest");
  EXPECT_EQ(manifest["rights"], label_.rights_url);
  EXPECT_EQ(manifest["requiredStatement"]["value"]["en"][0], label_.rights);
  EXPECT_EQ(manifest["rendering"][1]["id"], "https://museum.example/cases/2026-0042/head.glb");
  const json canvas = manifest["items"][0];
  EXPECT_EQ(canvas["width"], 40);
  EXPECT_EQ(canvas["items"][0]["items"][0]["target"], canvas["id"]);
  EXPECT_EQ(canvas["items"][0]["items"][0]["body"]["height"], 30);
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
  const auto changed = write_exhibit(folder_ / "package", label_, "1.2.3", folder_ / "new");
  ASSERT_FALSE(changed);
  EXPECT_THAT(changed.error().message(), HasSubstr("is not as it was sealed (data/case/head.glb"));
  EXPECT_FALSE(fs::exists(folder_ / "new"));
}

TEST_F(ExhibitTest, ACaseWithAHeadThatIsNoModelIsNamed) {
  for (const std::string& bytes :
       {std::string("not a model"), std::string("glTF\2\0\0\0\x14\0\0\0\xff\0\0\0JSON", 20),
        read_file(folder_ / "case/head.glb")->substr(0, 100)}) {
    ASSERT_TRUE(write_file_durably(folder_ / "case/head.glb", bytes));
    fs::remove_all(folder_ / "package");
    const auto shown = exhibit();
    ASSERT_FALSE(shown);
    EXPECT_THAT(shown.error().message(), HasSubstr("head.glb: is no binary glTF 2.0 file"));
  }
}

}  // namespace
}  // namespace skullstation
