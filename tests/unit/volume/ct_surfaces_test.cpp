#include "reconstruction/volume/ct_surfaces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/volume/volume_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/volume/analytic_head.h"

namespace skullstation {
namespace {

using skullstation::testing::AnalyticHead;
using ::testing::HasSubstr;
using ::testing::Not;

CtSurfaceOptions coarse_options() {
  CtSurfaceOptions options;
  options.decimation.edge_mm = 3.0;
  options.threads = 2;
  return options;
}

Result<CtSurfaces> surfaces_of(const AnalyticHead& head) {
  return extract_ct_surfaces(head.volume(), coarse_options());
}

bool warned(const CtSurfaces& surfaces, CtWarning warning) {
  return std::ranges::any_of(surfaces.quality.findings,
                             [&](const CtFinding& f) { return f.warning == warning; });
}

int count_vertices(const TriangleMesh& mesh,
                   const std::function<bool(const Eigen::Vector3d&)>& which) {
  int count = 0;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    count += which(mesh.vertices.row(v).transpose()) ? 1 : 0;
  }
  return count;
}

TEST(CtSurfaces, SkullWithMandibleWithoutSpine) {
  const auto surfaces = surfaces_of({});
  ASSERT_TRUE(surfaces) << surfaces.error().message();
  const TriangleMesh& skull = surfaces->skull;
  EXPECT_EQ(surfaces->quality.skull_components, 1);
  EXPECT_TRUE(topology_of(skull).is_closed_manifold());
  EXPECT_EQ(count_vertices(skull,
                           [](const auto& p) {
                             return p.z() < -78.0 && std::hypot(p.x(), p.y() - 20.0) < 28.0;
                           }),
            0)
      << "vertebrae are left";
  EXPECT_GT(count_vertices(skull, [](const auto& p) { return p.z() < -100.0 && p.y() < -65.0; }),
            20)
      << "the chin is gone";
  EXPECT_NEAR(skull.vertices.col(2).maxCoeff(), 68.0, 1.5);
  EXPECT_GT(surfaces->quality.spine_removed_mm3, 1e4);
  EXPECT_FALSE(warned(*surfaces, CtWarning::no_mandible));
  ASSERT_TRUE(surfaces->quality.mandible_most_posterior_mm);
  EXPECT_NEAR(surfaces->quality.mandible_most_posterior_mm->y(), -5.0, 3.0);
}

TEST(CtSurfaces, TheVolumeIsCutBelowTheMandible) {
  const auto surfaces = surfaces_of({});
  ASSERT_TRUE(surfaces) << surfaces.error().message();
  ASSERT_TRUE(surfaces->quality.crop_z_mm);
  EXPECT_NEAR(*surfaces->quality.crop_z_mm, -115.0, 3.5);
  EXPECT_NEAR(surfaces->skin.vertices.col(2).minCoeff(), *surfaces->quality.crop_z_mm, 0.3);
  const Volume& cropped = surfaces->volume;
  EXPECT_EQ(cropped.hu.size(), cropped.grid.count());
  EXPECT_GT(surfaces->first_slice, 0);
  EXPECT_EQ(cropped.at(70, 60, 0), AnalyticHead{}.volume().at(70, 60, surfaces->first_slice));
  CtSurfaceOptions options = coarse_options();
  options.crop = false;
  const auto whole = extract_ct_surfaces(AnalyticHead{}.volume(), options);
  ASSERT_TRUE(whole) << whole.error().message();
  EXPECT_FALSE(whole->quality.crop_z_mm);
  EXPECT_NEAR(whole->skin.vertices.col(2).minCoeff(), -140.0, 0.3);
}

TEST(CtSurfaces, TheSkinIsTheOutsideAloneWithNoseAndEars) {
  const auto surfaces = surfaces_of({});
  ASSERT_TRUE(surfaces) << surfaces.error().message();
  const TriangleMesh& skin = surfaces->skin;
  EXPECT_EQ(surfaces->quality.skin_components, 1);
  EXPECT_TRUE(topology_of(skin).is_closed_manifold());
  EXPECT_EQ(topology_of(skin).euler_characteristic, 2);
  EXPECT_LT(skin.vertices.col(1).minCoeff(), -118.0) << "the nose is gone";
  EXPECT_GT(skin.vertices.col(0).maxCoeff(), 93.0) << "an ear is gone";
  EXPECT_LT(skin.vertices.col(0).minCoeff(), -93.0) << "an ear is gone";
  EXPECT_EQ(
      count_vertices(skin, [](const auto& p) { return (p - AnalyticHead::airway()).norm() < 8.5; }),
      0)
      << "the airway is open";
  EXPECT_GT(enclosed_volume(skin), 2e6);
}

TEST(CtSurfaces, TheHeadRestIsGone) {
  const auto surfaces = surfaces_of({});
  ASSERT_TRUE(surfaces) << surfaces.error().message();
  EXPECT_GT(surfaces->quality.surroundings_removed_mm3, 1e5);
  // Where it touches the head its thickness may be left, no more.
  EXPECT_LT(surfaces->skin.vertices.col(1).maxCoeff(), 105.0);
  EXPECT_EQ(count_vertices(surfaces->skin,
                           [](const auto& p) {
                             return AnalyticHead::ellipsoid(p, {0, -2, 0}, {80, 102, 82}) > 1.06 &&
                                    p.y() > 50.0 && p.z() > -40.0;
                           }),
            0);
}

TEST(CtSurfaces, StreaksLeaveNoSpikes) {
  AnalyticHead head;
  head.metal = true;
  const auto surfaces = surfaces_of(head);
  ASSERT_TRUE(surfaces) << surfaces.error().message();
  ASSERT_EQ(surfaces->quality.streaks.size(), 1U);
  EXPECT_TRUE(warned(*surfaces, CtWarning::metal_streaks));
  const auto in_streak = [](const Eigen::Vector3d& p) {
    return AnalyticHead::in_streaked_slices(p) && std::abs(p.y() - AnalyticHead::metal_y) < 4.0;
  };
  EXPECT_EQ(count_vertices(surfaces->skull,
                           [&](const auto& p) { return in_streak(p) && p.x() > 53.0 + 4.5; }),
            0);
  const auto clean = surfaces_of({});
  ASSERT_TRUE(clean);
  const auto widest = [&](const TriangleMesh& mesh) {
    double x = 0.0;
    for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
      const Eigen::Vector3d p = mesh.vertices.row(v);
      if (in_streak(p)) x = std::max(x, p.x());
    }
    return x;
  };
  EXPECT_LT(widest(surfaces->skin), widest(clean->skin) + 3.5);
  EXPECT_EQ(surfaces->quality.skin_components, 1);
}

TEST(CtSurfaces, WhatIsMissingIsTold) {
  AnalyticHead no_mandible;
  no_mandible.mandible = false;
  const auto without = surfaces_of(no_mandible);
  ASSERT_TRUE(without) << without.error().message();
  EXPECT_TRUE(warned(*without, CtWarning::no_mandible));
  EXPECT_FALSE(without->quality.crop_z_mm);

  const auto low = extract_ct_surfaces(AnalyticHead{}.volume(2.0, -140.0, 50.0), coarse_options());
  ASSERT_TRUE(low) << low.error().message();
  EXPECT_TRUE(warned(*low, CtWarning::cropped_vertex));
  EXPECT_TRUE(low->quality.skin_closed_manifold);
  EXPECT_TRUE(low->quality.skull_closed_manifold);

  const auto no_nose =
      extract_ct_surfaces(AnalyticHead{}.volume(2.0, -140.0, 92.0, -110.0), coarse_options());
  ASSERT_TRUE(no_nose) << no_nose.error().message();
  EXPECT_TRUE(warned(*no_nose, CtWarning::cropped_nose));
  EXPECT_FALSE(warned(*no_nose, CtWarning::cropped_vertex));
  EXPECT_TRUE(warned(*no_nose, CtWarning::thick_slices));
}

TEST(CtSurfaces, AScanThatEndsAboveTheSpineKeepsItsSkullBase) {
  AnalyticHead head;
  head.spine = false;
  head.mandible = false;
  const auto surfaces = extract_ct_surfaces(head.volume(2.0, -80.0), coarse_options());
  ASSERT_TRUE(surfaces) << surfaces.error().message();
  EXPECT_EQ(surfaces->quality.spine_removed_mm3, 0.0);
  EXPECT_LT(surfaces->skull.vertices.col(2).minCoeff(), -60.0);
}

TEST(CtSurfaces, TheVolumesAxesDoNotMatter) {
  const Volume volume = AnalyticHead{}.volume();
  // Sagittal slices from the right, rows downwards.
  Volume turned;
  turned.grid.size = {volume.grid.size.y(), volume.grid.size.z(), volume.grid.size.x()};
  turned.grid.spacing_mm = volume.grid.spacing_mm;
  turned.grid.direction << 0, 0, -1, 1, 0, 0, 0, -1, 0;
  turned.grid.origin_mm = volume.grid.patient_from_voxel(
      Eigen::Vector3d(volume.grid.size.x() - 1, 0, volume.grid.size.z() - 1));
  turned.hu.resize(volume.hu.size());
  for (int k = 0; k < turned.grid.size.z(); ++k) {
    for (int j = 0; j < turned.grid.size.y(); ++j) {
      for (int i = 0; i < turned.grid.size.x(); ++i) {
        turned.at(i, j, k) =
            volume.at(volume.grid.size.x() - 1 - k, i, volume.grid.size.z() - 1 - j);
      }
    }
  }
  const auto a = extract_ct_surfaces(volume, coarse_options());
  const auto b = extract_ct_surfaces(turned, coarse_options());
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->skull.triangles, b->skull.triangles);
  EXPECT_LT((a->skull.vertices - b->skull.vertices).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(CtSurfaces, TheSameForAnyNumberOfThreads) {
  CtSurfaceOptions options = coarse_options();
  options.threads = 1;
  const auto one = extract_ct_surfaces(AnalyticHead{}.volume(), options);
  options.threads = 3;
  const auto three = extract_ct_surfaces(AnalyticHead{}.volume(), options);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->skull.vertices, three->skull.vertices);
  EXPECT_EQ(one->skin.vertices, three->skin.vertices);
  EXPECT_EQ(one->skin.triangles, three->skin.triangles);
}

TEST(CtSurfaces, WhatIsNoHeadScanIsRefused) {
  Volume shifted = AnalyticHead{}.volume(4.0);
  for (std::int16_t& hu : shifted.hu) hu = static_cast<std::int16_t>(hu + 1024);
  const auto offset = extract_ct_surfaces(shifted, coarse_options());
  ASSERT_FALSE(offset);
  EXPECT_EQ(offset.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(offset.error().message(), HasSubstr("--hu-offset"));

  Volume apple = AnalyticHead{}.volume(4.0);
  for (std::size_t v = 0; v < apple.hu.size(); ++v) apple.hu[v] = v % 40 == 0 ? 40 : -1000;
  const auto none = extract_ct_surfaces(apple, coarse_options());
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::no_result);

  CtSurfaceOptions options;
  options.bone_hu = 5000;
  EXPECT_EQ(extract_ct_surfaces(Volume{}, options).error().kind, ErrorKind::usage);
  std::stop_source source;
  source.request_stop();
  Progress progress;
  progress.stop = source.get_token();
  const auto cancelled =
      extract_ct_surfaces(AnalyticHead{}.volume(4.0), coarse_options(), progress);
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().kind, ErrorKind::cancelled);
}

TEST(CtSurfaces, TheRealHead) {
  const auto path = skullstation::testing::real_data_folder() / "ct-head" / "ct-head.nii.gz";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "real data is not here: " << path;
  auto volume = read_volume(path, {});
  ASSERT_TRUE(volume) << volume.error().message();
  const VoxelGrid grid = volume->grid;
  CtSurfaceOptions options;
  options.decimation.edge_mm = 2.0;
  const auto surfaces = extract_ct_surfaces(std::move(*volume), options);
  ASSERT_TRUE(surfaces) << surfaces.error().message();
  const CtQuality& quality = surfaces->quality;
  EXPECT_TRUE(quality.skull_closed_manifold);
  EXPECT_TRUE(quality.skin_closed_manifold);
  EXPECT_EQ(quality.skull_components, 1) << "skull and mandible in one piece";
  EXPECT_EQ(quality.skin_components, 1);
  EXPECT_TRUE(warned(*surfaces, CtWarning::thick_slices));
  EXPECT_TRUE(warned(*surfaces, CtWarning::metal_streaks));
  EXPECT_FALSE(warned(*surfaces, CtWarning::no_mandible));
  EXPECT_FALSE(warned(*surfaces, CtWarning::cropped_nose));
  EXPECT_FALSE(warned(*surfaces, CtWarning::cropped_vertex));
  // The head rests on row 237 of the cushion's shell, which begins at row 239; the ears reach out
  // to both sides of columns 40 and 180.
  const auto row = [&](double j) { return grid.patient_from_voxel({0, j, 0}).y(); };
  const auto column = [&](double i) { return grid.patient_from_voxel({i, 0, 0}).x(); };
  EXPECT_LT(surfaces->skin.vertices.col(1).maxCoeff(), row(239));
  EXPECT_LT(surfaces->skin.vertices.col(0).minCoeff(), column(40));
  EXPECT_GT(surfaces->skin.vertices.col(0).maxCoeff(), column(180));
}

}  // namespace
}  // namespace skullstation
