#include "reconstruction/photogrammetry/sfm_rings.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "core/units.h"
#include "reconstruction/photogrammetry/sfm_frame.h"

namespace skullstation {
namespace {

constexpr int view_count = 24;
constexpr double step_deg = 360.0 / view_count;
constexpr int knocked = 7;  ///< the camera stood elsewhere there

/// A ball of features on a turntable before one camera, as structure from motion might have found
/// it: poses that have drifted, sights with noise, some of them wrong matches.
struct TurnedBall {
  std::vector<Rigid3> truth;
  SfmModel found;
  RingMembers members;

  TurnedBall() {
    Random random(5);
    Lens lens;
    lens.width = 1600;
    lens.height = 1200;
    lens.fx = lens.fy = 2800.0;
    lens.cx = 800.0;
    lens.cy = 600.0;
    lens.k1 = -0.08;
    found.lenses = {lens};
    Eigen::Matrix3d level;  // looks along the table's y, its z being up
    level << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    const Rigid3 camera_from_station{Eigen::Quaterniond(level), {0.0, 90.0, 740.0}};
    Rigid3 knock{Eigen::Quaterniond::Identity(), {4.0, -3.0, 0.0}};
    for (int i = 0; i < view_count; ++i) {
      Rigid3 camera = camera_from_station * rotation_about_z(step_deg * i);
      if (i == knocked) camera = knock * camera;
      truth.push_back(camera);
      const Eigen::Vector3d turn(random.normal(), random.normal(), random.normal());
      const Rigid3 drift{
          Eigen::Quaterniond(Eigen::AngleAxisd(radians(0.1) * turn.norm(), turn.normalized())),
          {random.normal(), random.normal(), random.normal()}};
      found.camera_from_model.emplace_back(drift * camera);
      members.push_back(RingMembership{0, 0, step_deg * i});
    }
    for (int p = 0; p < 600; ++p) {
      const Eigen::Vector3d out =
          Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
      const Eigen::Vector3d x = Eigen::Vector3d(0.0, 0.0, 90.0) + 70.0 * out;
      SfmPoint point;
      point.x_model = x + 0.3 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      for (int i = 0; i < view_count; ++i) {
        const Rigid3& camera = truth[static_cast<std::size_t>(i)];
        const Eigen::Vector3d towards = (camera.inverse().translation - x).normalized();
        if (towards.dot(out) < 0.7) continue;
        const double sd_px = random.uniform() < 0.03 ? 20.0 : 0.4;
        point.sights.push_back({i, lens.project(camera * x) +
                                       sd_px * Eigen::Vector2d(random.normal(), random.normal())});
      }
      if (point.sights.size() >= 2) found.points.push_back(point);
    }
  }

  /// The worst distance of a camera that was not knocked from its true place, once the whole is
  /// laid on the truth [mm].
  double worst_mm() const {
    std::vector<FramePair> pairs;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      pairs.push_back({truth[i], *found.camera_from_model[i]});
    }
    const Similarity3 frame = fit_frame(pairs)->reference_from_model;
    double worst = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (i == knocked) continue;
      const Rigid3 camera = in_reference(*found.camera_from_model[i], frame);
      worst =
          std::max(worst, (camera.inverse().translation - truth[i].inverse().translation).norm());
    }
    return worst;
  }
};

TEST(SfmRings, DriftIsTakenOutAndAKnockedCameraIsFound) {
  TurnedBall ball;
  EXPECT_GT(ball.worst_mm(), 2.0);
  Similarity3 frame;
  adjust_to_rings(ball.found, frame, ball.members);
  EXPECT_LT(ball.worst_mm(), 0.4);
  const auto rings = find_sfm_rings(ball.found, frame, ball.members);
  ASSERT_TRUE(rings);
  for (std::size_t i = 0; i < rings->departures_mm.size(); ++i) {
    if (i == knocked) {
      EXPECT_GT(rings->departures_mm[i], 3.0);
    } else {
      EXPECT_LT(rings->departures_mm[i], 0.3) << i;
    }
  }
}

TEST(SfmRings, WrongMatchesAreTakenOut) {
  TurnedBall ball;
  Similarity3 frame;
  adjust_to_rings(ball.found, frame, ball.members);
  for (const SfmPoint& point : ball.found.points) {
    EXPECT_GE(point.sights.size(), 2U);
    for (const SfmPoint::Sight& sight : point.sights) {
      const Rigid3& camera = *ball.found.camera_from_model[static_cast<std::size_t>(sight.image)];
      const Eigen::Vector2d px = ball.found.lenses[0].project(camera * (frame * point.x_model));
      EXPECT_LT((px - sight.position_px).norm(), 4.0);
    }
  }
}

TEST(SfmRings, WithoutTableAnglesNothingChanges) {
  TurnedBall ball;
  const double before_mm = ball.worst_mm();
  Similarity3 frame;
  adjust_to_rings(ball.found, frame, RingMembers(view_count));
  EXPECT_EQ(ball.worst_mm(), before_mm);
  EXPECT_FALSE(find_sfm_rings(ball.found, frame, RingMembers(view_count)));
}

}  // namespace
}  // namespace skullstation
