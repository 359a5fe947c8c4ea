#include "reconstruction/io/glb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/io/tetrahedron.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using skullstation::testing::tetrahedron;
using ::testing::HasSubstr;

template <class T>
T number_at(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

/// The two chunks of a GLB file whose container is valid.
struct Chunks {
  nlohmann::json json;
  std::string binary;
};

Chunks chunks_of(const std::string& file) {
  EXPECT_EQ(file.substr(0, 4), "glTF");
  EXPECT_EQ(number_at<std::uint32_t>(file, 4), 2U);
  EXPECT_EQ(number_at<std::uint32_t>(file, 8), file.size());
  const auto json_size = number_at<std::uint32_t>(file, 12);
  EXPECT_EQ(json_size % 4, 0U);
  EXPECT_EQ(file.substr(16, 4), "JSON");
  const std::size_t binary_at = 20 + json_size;
  EXPECT_EQ(file.substr(binary_at + 4, 4), std::string("BIN\0", 4));
  EXPECT_EQ(binary_at + 8 + number_at<std::uint32_t>(file, binary_at), file.size());
  return {nlohmann::json::parse(file.substr(20, json_size)), file.substr(binary_at + 8)};
}

TEST(Glb, MillimetresWithZUpBecomeMetresWithYUp) {
  const TemporaryFolder folder;
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.row(1) << 1000, 2000, 3000;
  ASSERT_TRUE(write_glb(mesh, folder / "head.glb"));
  const Chunks chunks = chunks_of(*read_file(folder / "head.glb"));
  const auto& primitive = chunks.json["meshes"][0]["primitives"][0];
  const auto& accessor = chunks.json["accessors"][primitive["attributes"]["POSITION"].get<int>()];
  EXPECT_EQ(accessor["count"], 4);
  const auto& view = chunks.json["bufferViews"][accessor["bufferView"].get<int>()];
  const std::size_t second = view["byteOffset"].get<std::size_t>() + 12;
  EXPECT_EQ(number_at<float>(chunks.binary, second), 1.0F);
  EXPECT_EQ(number_at<float>(chunks.binary, second + 4), 3.0F);
  EXPECT_EQ(number_at<float>(chunks.binary, second + 8), -2.0F);
  EXPECT_EQ(accessor["min"], nlohmann::json({0.0, 0.0, -2.0}));
  EXPECT_EQ(accessor["max"][1], 3.0);
}

TEST(Glb, EveryAccessorLiesInsideTheBufferAndIsAligned) {
  const TemporaryFolder folder;
  TriangleMesh mesh = tetrahedron();
  mesh.normals = vertex_normals(mesh);
  mesh.colors = Colors::Constant(4, 3, 188);
  const MorphTarget mode{"tissue mode 1", Points3::Constant(4, 3, 5.0)};
  ASSERT_TRUE(write_glb(mesh, folder / "head.glb", {mode}));
  const Chunks chunks = chunks_of(*read_file(folder / "head.glb"));
  const auto& json = chunks.json;
  EXPECT_EQ(json["accessors"].size(), 5U);
  std::size_t end = 0;
  for (const auto& view : json["bufferViews"]) {
    EXPECT_EQ(view["byteOffset"].get<std::size_t>(), end);
    EXPECT_EQ(end % 4, 0U);
    end += view["byteLength"].get<std::size_t>();
  }
  EXPECT_EQ(json["buffers"][0]["byteLength"].get<std::size_t>(), end);
  EXPECT_LE(end, chunks.binary.size());
  EXPECT_EQ(json["meshes"][0]["extras"]["targetNames"][0], "tissue mode 1");
  const auto& primitive = json["meshes"][0]["primitives"][0];
  const auto& target = json["accessors"][primitive["targets"][0]["POSITION"].get<int>()];
  EXPECT_FLOAT_EQ(target["max"][0].get<float>(), 0.005F);
  // sRGB 188 is half of white in linear light.
  const auto& color = json["accessors"][primitive["attributes"]["COLOR_0"].get<int>()];
  const auto offset = json["bufferViews"][color["bufferView"].get<int>()]["byteOffset"];
  EXPECT_NEAR(number_at<std::uint16_t>(chunks.binary, offset.get<std::size_t>()), 32768, 400);
}

TEST(Glb, CarriesATextureAsItIs) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = tetrahedron();
  MeshTexture texture{{{0.0F, 0.0F}, {1.0F, 0.0F}, {0.25F, 0.75F}, {1.0F, 1.0F}}, "\xff\xd8 jpeg"};
  ASSERT_TRUE(write_glb(mesh, texture, folder / "skull.glb"));
  const Chunks chunks = chunks_of(*read_file(folder / "skull.glb"));
  const auto& json = chunks.json;
  const auto& attributes = json["meshes"][0]["primitives"][0]["attributes"];
  const auto& coordinates = json["accessors"][attributes["TEXCOORD_0"].get<int>()];
  EXPECT_EQ(coordinates["count"], 4);
  const auto& view = json["bufferViews"][coordinates["bufferView"].get<int>()];
  const std::size_t third = view["byteOffset"].get<std::size_t>() + 16;
  EXPECT_EQ(number_at<float>(chunks.binary, third), 0.25F);
  EXPECT_EQ(number_at<float>(chunks.binary, third + 4), 0.75F);
  const auto& material = json["materials"][0]["pbrMetallicRoughness"];
  const auto& used = json["textures"][material["baseColorTexture"]["index"].get<int>()];
  const auto& image = json["images"][used["source"].get<int>()];
  EXPECT_EQ(image["mimeType"], "image/jpeg");
  const auto& bytes = json["bufferViews"][image["bufferView"].get<int>()];
  EXPECT_EQ(chunks.binary.substr(bytes["byteOffset"].get<std::size_t>(),
                                 bytes["byteLength"].get<std::size_t>()),
            texture.image);
  EXPECT_FALSE(attributes.contains("COLOR_0")) << "it would tint the texture";

  texture.coordinates.pop_back();
  const auto few = write_glb(mesh, texture, folder / "a.glb");
  ASSERT_FALSE(few);
  EXPECT_THAT(few.error().message(), HasSubstr("3 texture coordinates for 4 vertices"));
  texture.coordinates.emplace_back(0.0F, 0.0F);
  texture.image = "GIF89a";
  const auto foreign = write_glb(mesh, texture, folder / "a.glb");
  ASSERT_FALSE(foreign);
  EXPECT_THAT(foreign.error().message(), HasSubstr("neither PNG nor JPEG"));
}

TEST(Glb, WhatCannotBeWrittenIsRefused) {
  const TemporaryFolder folder;
  const auto empty = write_glb(TriangleMesh{}, folder / "a.glb");
  ASSERT_FALSE(empty);
  EXPECT_THAT(empty.error().message(), HasSubstr("without triangles"));
  const auto odd = write_glb(tetrahedron(), folder / "a.glb", {{"m", Points3::Zero(3, 3)}});
  ASSERT_FALSE(odd);
  EXPECT_THAT(odd.error().message(), HasSubstr("\"m\" moves 3 vertices of 4"));
}

}  // namespace
}  // namespace skullstation
