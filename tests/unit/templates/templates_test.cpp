// The templates, coarse: shared by all tests of this program, since making them takes seconds.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "core/file.h"
#include "reconstruction/phantom/canonical_skin.h"
#include "reconstruction/phantom/canonical_skull.h"
#include "reconstruction/phantom/skull_landmarks.h"
#include "reconstruction/templates/make_templates.h"
#include "reconstruction/templates/template_file.h"

namespace skullstation {
namespace {

const Templates& templates() {
  static const Templates made = [] {
    const auto skull = make_skull_template({.face_edge_mm = 8.0, .threads = 2});
    const auto head = make_head_template({.face_edge_mm = 9.0, .threads = 2});
    EXPECT_TRUE(skull) << (skull ? "" : skull.error().message());
    EXPECT_TRUE(head) << (head ? "" : head.error().message());
    return Templates{skull.value_or(SkullTemplate{}), head.value_or(HeadTemplate{})};
  }();
  return made;
}

const Eigen::Vector3d landmark(const std::vector<TemplateLandmark>& all, const Points3& vertices,
                               const std::string& name) {
  for (const TemplateLandmark& one : all) {
    if (one.name == name) return one.place.position(vertices);
  }
  ADD_FAILURE() << name;
  return Eigen::Vector3d::Zero();
}

TEST(SkullTemplateTest, IsASolidInTwoPieces) {
  const SkullTemplate& skull = templates().skull;
  ASSERT_TRUE(skull.validate());
  std::vector<int> piece(static_cast<std::size_t>(skull.vertices.rows()));
  for (std::size_t v = 0; v < piece.size(); ++v) piece[v] = static_cast<int>(v);
  const auto root = [&](int v) {
    while (piece[static_cast<std::size_t>(v)] != v) v = piece[static_cast<std::size_t>(v)];
    return v;
  };
  for (Eigen::Index t = 0; t < skull.tetrahedra.rows(); ++t) {
    for (int i = 1; i < 4; ++i) {
      piece[static_cast<std::size_t>(root(skull.tetrahedra(t, i)))] = root(skull.tetrahedra(t, 0));
    }
  }
  std::set<int> roots;
  for (int v = 0; v < skull.vertices.rows(); ++v) {
    roots.insert(root(v));
    EXPECT_EQ(bone_of(skull.region[static_cast<std::size_t>(v)]) ==
                  bone_of(skull.region[static_cast<std::size_t>(root(v))]),
              true);
  }
  EXPECT_EQ(roots.size(), 2U);
}

TEST(SkullTemplateTest, HasAClosedSurfaceThatFacesOutwards) {
  const SkullTemplate& skull = templates().skull;
  std::map<std::pair<int, int>, int> directed;
  for (Eigen::Index f = 0; f < skull.boundary.rows(); ++f) {
    for (int i = 0; i < 3; ++i) {
      ++directed[{skull.boundary(f, i), skull.boundary(f, (i + 1) % 3)}];
    }
  }
  for (const auto& [edge, count] : directed) {
    EXPECT_EQ(count, directed[std::pair(edge.second, edge.first)]);
  }
  // By Gauss: the volume of the surface is the tetrahedra's, and positive.
  double volume = 0.0;
  for (Eigen::Index f = 0; f < skull.boundary.rows(); ++f) {
    const Eigen::Vector3d a = skull.vertices.row(skull.boundary(f, 0));
    const Eigen::Vector3d b = skull.vertices.row(skull.boundary(f, 1));
    const Eigen::Vector3d c = skull.vertices.row(skull.boundary(f, 2));
    volume += a.dot(b.cross(c)) / 6.0;
  }
  EXPECT_NEAR(volume, signed_volumes(skull.tetrahedra, skull.vertices).sum(), 1e-6 * volume);
}

TEST(SkullTemplateTest, KnowsInsideFromOutsideAndLeftFromRight) {
  const SkullTemplate& skull = templates().skull;
  int vault_inside = 0;
  int vault_outside = 0;
  for (int v = 0; v < skull.boundary_count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    const Eigen::Vector3d p = skull.vertices.row(v);
    if (p.z() > 90.0) {  // there the inner table is nearer to the middle
      (skull.outer[at] ? vault_outside : vault_inside) += 1;
      EXPECT_TRUE(p.z() <= 117.0 || skull.outer[at]);
    }
    const SkullRegion region = skull.region[at];
    if (region == SkullRegion::orbit_left || region == SkullRegion::ramus_left) {
      EXPECT_GE(p.x(), 0.0);
    }
    Eigen::Vector3d image = skull.mirror[at].position(skull.vertices);
    image.x() = -image.x();
    EXPECT_LT((image - p).norm(), 4.0);
  }
  EXPECT_GT(vault_inside, 10);
  EXPECT_GT(vault_outside, 10);
  const Points3 mirrored = mirrored_surface(skull, skull.vertices);
  EXPECT_LT((mirrored - skull.vertices.topRows(skull.boundary_count)).rowwise().norm().mean(), 1.0);
}

TEST(SkullTemplateTest, CarriesTheCanonicalLandmarks) {
  const SkullTemplate& skull = templates().skull;
  const std::vector<Landmark> canonical = canonical_landmarks();
  ASSERT_EQ(skull.landmarks.size(), canonical.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < canonical.size(); ++i) {
    EXPECT_EQ(skull.landmarks[i].name, canonical[i].name);
    sum += (skull.landmarks[i].place.position(skull.vertices) - canonical[i].position_mm).norm();
  }
  EXPECT_LT(sum / static_cast<double>(canonical.size()), 1.0);
}

TEST(HeadTemplateTest, IsOneSymmetricSheetOpenAtTheNeck) {
  const HeadTemplate& head = templates().head;
  ASSERT_TRUE(head.validate());
  std::map<std::pair<int, int>, int> uses;
  for (Eigen::Index f = 0; f < head.triangles.rows(); ++f) {
    for (int i = 0; i < 3; ++i) {
      ++uses[std::minmax(int{head.triangles(f, i)}, int{head.triangles(f, (i + 1) % 3)})];
    }
  }
  for (const auto& [edge, count] : uses) {
    ASSERT_LE(count, 2);
    EXPECT_TRUE(count == 2 || head.vertices(edge.first, 2) == -108.0);
  }
  // One loop: as many rim vertices as rim edges. (So coarse a grid may bridge a gap behind an ear.)
  std::set<int> rim;
  std::size_t rim_edges = 0;
  for (const auto& [edge, count] : uses) {
    if (count == 2) continue;
    rim.insert({edge.first, edge.second});
    ++rim_edges;
  }
  EXPECT_GT(rim_edges, 10U);
  EXPECT_EQ(rim.size(), rim_edges);
  EXPECT_EQ(mirrored(head, head.vertices), head.vertices);
}

TEST(HeadTemplateTest, LiesOnTheCanonicalSkinWithItsLandmarks) {
  const HeadTemplate& head = templates().head;
  const auto solid = skin_solid();
  double sum = 0.0;
  for (Eigen::Index v = 0; v < head.vertices.rows(); ++v) {
    sum += std::abs(solid->distance_mm(head.vertices.row(v)));
  }
  EXPECT_LT(sum / static_cast<double>(head.vertices.rows()), 0.05);
  EXPECT_EQ(head.landmarks.size(), canonical_skin_landmarks().size());
  const Eigen::Vector3d nose = landmark(head.landmarks, head.vertices, "pronasale");
  EXPECT_LT(nose.y(), landmark(head.landmarks, head.vertices, "stomion").y());
  std::set<HeadRegion> regions(head.region.begin(), head.region.end());
  EXPECT_EQ(static_cast<int>(regions.size()), kHeadRegionCount);
}

TEST(Templates, AreTheSameForAnyNumberOfThreads) {
  const auto one = make_skull_template({.face_edge_mm = 12.0, .threads = 1});
  const auto three = make_skull_template({.face_edge_mm = 12.0, .threads = 3});
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->vertices, three->vertices);
  EXPECT_EQ(one->tetrahedra, three->tetrahedra);
}

TEST(Templates, RefuseEdgesOfNoUse) {
  EXPECT_EQ(make_skull_template({.face_edge_mm = 0.1}).error().kind, ErrorKind::usage);
  EXPECT_EQ(make_head_template({.face_edge_mm = 100.0}).error().kind, ErrorKind::usage);
}

class TemplateFile : public testing::Test {
 protected:
  const std::filesystem::path path_ =
      std::filesystem::path(testing::TempDir()) / "templates_test.bin";
};

TEST_F(TemplateFile, ComesBackAsItWas) {
  ASSERT_TRUE(write_templates(templates(), path_));
  const auto back = read_templates(path_);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->skull.vertices, templates().skull.vertices);
  EXPECT_EQ(back->skull.tetrahedra, templates().skull.tetrahedra);
  EXPECT_EQ(back->skull.boundary, templates().skull.boundary);
  EXPECT_EQ(back->skull.outer, templates().skull.outer);
  EXPECT_EQ(back->skull.region, templates().skull.region);
  EXPECT_EQ(back->skull.landmarks.front().name, templates().skull.landmarks.front().name);
  EXPECT_EQ(mirrored_surface(back->skull, back->skull.vertices),
            mirrored_surface(templates().skull, templates().skull.vertices));
  EXPECT_EQ(back->head.vertices, templates().head.vertices);
  EXPECT_EQ(back->head.mirror, templates().head.mirror);
  EXPECT_EQ(back->head.data_weight, templates().head.data_weight);
}

TEST_F(TemplateFile, RefusesWhatIsTruncatedForeignOrAbsent) {
  ASSERT_TRUE(write_templates(templates(), path_));
  const std::string bytes = *read_file(path_);
  const auto refused = [&](const std::string& content) {
    EXPECT_TRUE(write_file_durably(path_, content));
    const auto read = read_templates(path_);
    EXPECT_FALSE(read);
    return read ? std::string() : read.error().message();
  };
  EXPECT_THAT(refused(bytes.substr(0, bytes.size() / 2)), testing::HasSubstr("truncated"));
  EXPECT_THAT(refused(bytes + "x"), testing::HasSubstr("longer"));
  EXPECT_THAT(refused("ply\n"), testing::HasSubstr("no file of templates"));
  EXPECT_THAT(refused(bytes.substr(0, 40)), testing::HasSubstr("header"));
  std::string huge = bytes;
  huge.replace(huge.find("\"vertices\":"), 11, "\"vertices\":9999999");
  EXPECT_THAT(refused(huge), testing::HasSubstr("damaged"));
  std::filesystem::remove(path_);
  EXPECT_FALSE(read_templates(path_));
}

}  // namespace
}  // namespace skullstation
