#include "reconstruction/phantom/skull_landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

namespace skullstation {
namespace {

using Eigen::Vector3d;

const std::vector<Landmark>& landmarks() {
  static const std::vector<Landmark> all = canonical_landmarks();
  return all;
}

Vector3d at(const std::string& name) {
  const auto found = std::ranges::find(landmarks(), name, &Landmark::name);
  EXPECT_NE(found, landmarks().end()) << name;
  return found == landmarks().end() ? Vector3d(Vector3d::Constant(NAN)) : found->position_mm;
}

double span_mm(const std::string& a, const std::string& b) { return (at(a) - at(b)).norm(); }

TEST(SkullLandmarks, AreManyAndNamedOnce) {
  std::set<std::string> names;
  for (const Landmark& landmark : landmarks()) names.insert(landmark.name);
  EXPECT_EQ(names.size(), landmarks().size());
  EXPECT_GE(names.size(), 25U);
}

TEST(SkullLandmarks, LieOnTheSurface) {
  const SkullSolids skull = skull_solids();
  for (const Landmark& landmark : landmarks()) {
    EXPECT_NEAR(skull_distance_mm(skull, landmark.position_mm), 0.0, 0.01) << landmark.name;
  }
}

TEST(SkullLandmarks, AreSymmetric) {
  for (const Landmark& landmark : landmarks()) {
    const std::size_t side = landmark.name.find(" left");
    if (side == std::string::npos) {
      if (landmark.name.find(" right") == std::string::npos) {
        EXPECT_NEAR(landmark.position_mm.x(), 0.0, 1e-6) << landmark.name;
      }
      continue;
    }
    EXPECT_GT(landmark.position_mm.x(), 0.0) << landmark.name;
    const Vector3d right = at(landmark.name.substr(0, side) + " right");
    EXPECT_NEAR((Vector3d(-right.x(), right.y(), right.z()) - landmark.position_mm).norm(), 0.0,
                0.02)
        << landmark.name;
  }
}

TEST(SkullLandmarks, DefineTheAnatomicalFrame) {
  // Origin between the porions; porions and orbitalia in the plane z = 0.
  EXPECT_NEAR(at("porion left").y(), 0.0, 1e-9);
  EXPECT_NEAR(at("porion left").z(), 0.0, 0.1);
  EXPECT_NEAR(at("orbitale left").z(), 0.0, 0.1);
  EXPECT_LT(at("orbitale left").y(), -60.0);
}

TEST(SkullLandmarks, GiveTheProportionsOfAnAdultMale) {
  // Within three standard deviations of the male means of Howells 1973, 1989.
  EXPECT_NEAR(span_mm("glabella", "opisthocranion"), 183.2, 3 * 7.5);              // GOL
  EXPECT_NEAR(span_mm("euryon left", "euryon right"), 139.1, 3 * 7.1);             // XCB
  EXPECT_NEAR(span_mm("basion", "bregma"), 134.6, 3 * 6.8);                        // BBH
  EXPECT_NEAR(span_mm("zygion left", "zygion right"), 135.2, 3 * 6.5);             // ZYB
  EXPECT_NEAR(span_mm("nasion", "prosthion"), 68.0, 3 * 5.2);                      // NPH
  EXPECT_NEAR(span_mm("basion", "nasion"), 101.6, 3 * 5.4);                        // BNL
  EXPECT_NEAR(span_mm("basion", "prosthion"), 99.8, 3 * 6.2);                      // BPL
  EXPECT_NEAR(span_mm("basion", "opisthion"), 36.6, 3 * 2.5);                      // FOL
  EXPECT_NEAR(span_mm("alare left", "alare right"), 26.8, 3 * 2.3);                // NLB
  EXPECT_NEAR(span_mm("ectoconchion left", "ectoconchion right"), 99.2, 3 * 3.9);  // EKB
}

TEST(SkullLandmarks, ThoseOfTheMandibleMoveWithTheJaw) {
  SkullShape shape;
  shape.mandible_opening_deg = 15.0;
  const std::vector<Landmark> open = canonical_landmarks(shape);
  const SkullSolids skull = skull_solids(shape);
  const Rigid3 opening = mandible_opening(15.0);
  for (std::size_t i = 0; i < open.size(); ++i) {
    const std::string& name = open[i].name;
    const Vector3d closed = landmarks()[i].position_mm;
    if (name == "menton" || name.starts_with("gonion")) {
      EXPECT_NEAR((open[i].position_mm - opening * closed).norm(), 0.0, 1e-9);
      EXPECT_NEAR(skull.mandible->distance_mm(open[i].position_mm), 0.0, 0.01);
    } else if (name == "nasion") {
      EXPECT_EQ(open[i].position_mm, closed);
    }
  }
}

}  // namespace
}  // namespace skullstation
