#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "reconstruction/photogrammetry/reconstruct_surface.h"
#include "reconstruction/photogrammetry/surface_extraction.h"
#include "reconstruction/photogrammetry/visual_hull.h"
#include "tests/unit/photogrammetry/ball_scene.h"

namespace skullstation {
namespace {

/// Distances of the vertices from the ball's surface [mm], sorted.
std::vector<double> errors_of(const TriangleMesh& mesh, const BallScene& scene) {
  std::vector<double> errors;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d point = mesh.vertices.row(v);
    errors.push_back(std::abs((point - scene.centre_mm).norm() - scene.radius_mm));
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

/// Each side has at most two triangles, which run along it in opposite directions.
bool is_oriented_manifold(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> sides;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      if (++sides[{mesh.triangles(f, k), mesh.triangles(f, (k + 1) % 3)}] > 1) return false;
    }
  }
  return true;
}

TEST(Fusion, TrueDepthsGiveTheTrueBallOpenBelow) {
  const BallScene scene;
  const auto views = photograph(scene);
  const auto maps = true_depth_maps(scene, views);
  FusionOptions options;
  options.voxel_mm = 1.0;
  const auto volume = fuse_depth_maps(maps, views, options, {});
  ASSERT_TRUE(volume) << volume.error().message();
  const FusedSurface surface = extract_surface(*volume, options.least_weight, 1);
  const auto errors = errors_of(surface.mesh, scene);
  ASSERT_GT(errors.size(), 2000u);
  EXPECT_LT(errors[errors.size() / 2], 0.05);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.25);
  EXPECT_TRUE(is_oriented_manifold(surface.mesh));
  double lowest = 1e9;
  int outward = 0;
  for (Eigen::Index v = 0; v < surface.mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d from_centre =
        Eigen::Vector3d(surface.mesh.vertices.row(v)) - scene.centre_mm;
    lowest = std::min(lowest, from_centre.z() / scene.radius_mm);
    outward += from_centre.dot(surface.mesh.normals.row(v).transpose()) > 0.0 ? 1 : 0;
  }
  EXPECT_EQ(outward, surface.mesh.vertices.rows());
  // Cameras 25 deg above see down to 65 deg below the equator at most, in theory.
  EXPECT_LT(lowest, -0.5);
  EXPECT_GT(lowest, -0.95) << "what no camera sees stays open";
}

TEST(Fusion, IsTheSameForAnyNumberOfThreads) {
  BallScene scene;
  scene.views = 6;
  const auto views = photograph(scene);
  const auto maps = true_depth_maps(scene, views);
  FusionOptions options;
  options.voxel_mm = 2.0;
  options.threads = 1;
  const auto one = fuse_depth_maps(maps, views, options, {});
  options.threads = 3;
  const auto three = fuse_depth_maps(maps, views, options, {});
  ASSERT_TRUE(one && three);
  const TriangleMesh a = extract_surface(*one, 0.3, 1).mesh;
  const TriangleMesh b = extract_surface(*three, 0.3, 3).mesh;
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(Fusion, WithoutDepthsThereIsNoResult) {
  const BallScene scene;
  const auto views = photograph(scene);
  auto maps = true_depth_maps(scene, views);
  for (DepthMap& map : maps) map.planes.assign(map.planes.size(), {});
  const auto volume = fuse_depth_maps(maps, views, {}, {});
  ASSERT_FALSE(volume);
  EXPECT_EQ(volume.error().kind, ErrorKind::no_result);
}

TEST(Fusion, ADepthThatOthersLookThroughMakesNoSurface) {
  const BallScene scene;
  const auto views = photograph(scene);
  auto maps = true_depth_maps(scene, views);
  // One view claims a wall 15 mm before the ball.
  for (InversePlane& plane : maps[0].planes) {
    if (plane.w > 0.0f) plane = {1.0f / (1.0f / plane.w - 15.0f), 0.0f, 0.0f};
  }
  FusionOptions options;
  options.voxel_mm = 1.5;
  const auto volume = fuse_depth_maps(maps, views, options, {});
  ASSERT_TRUE(volume);
  const FusedSurface surface =
      without_small_pieces(extract_surface(*volume, options.least_weight, 1), {});
  EXPECT_LT(errors_of(surface.mesh, scene).back(), 4.0);
}

TEST(Cleaning, DropsSmallPieces) {
  FusedSurface surface;
  surface.mesh.vertices.resize(6, 3);
  surface.mesh.vertices << 0, 0, 0, 10, 0, 0, 0, 10, 0, 50, 0, 0, 50.1, 0, 0, 50, 0.1, 0;
  surface.mesh.triangles.resize(2, 3);
  surface.mesh.triangles << 0, 1, 2, 3, 4, 5;
  surface.weight.assign(6, 1.0f);
  const FusedSurface clean = without_small_pieces(surface, {});
  EXPECT_EQ(clean.mesh.triangles.rows(), 1);
  EXPECT_EQ(clean.mesh.vertices.rows(), 3);
  EXPECT_EQ(clean.weight.size(), 3u);
}

SurfaceOptions small_options(const std::vector<StereoView>& views) {
  SurfaceOptions options = SurfaceOptions::of(ReconstructionQuality::fine, views);
  options.depth.coarsest_level = 2;
  options.depth.hull_resolution = 48;
  options.threads = 1;
  return options;
}

TEST(ReconstructSurface, MeasuresABall) {
  const BallScene scene;
  const auto views = photograph(scene);
  const SurfaceOptions options = small_options(views);
  EXPECT_NEAR(options.fusion.voxel_mm, 1.6 * 260.0 / 420.0, 0.05);
  const auto surface = reconstruct_surface(views, options);
  ASSERT_TRUE(surface) << surface.error().message();
  const auto errors = errors_of(surface->mesh, scene);
  ASSERT_GT(errors.size(), 4000u);
  EXPECT_LT(errors[errors.size() / 2], 0.2);         // a third of a pixel
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.6);  // a pixel
  EXPECT_TRUE(is_oriented_manifold(surface->mesh));
  const auto& coverage = surface->coverage;
  ASSERT_EQ(coverage.views.size(), errors.size());
  std::vector<float> stated;
  for (std::size_t v = 0; v < coverage.views.size(); ++v) {
    if (coverage.views[v] < 3) continue;
    EXPECT_NEAR(coverage.ground_sample_mm[v], 0.55, 0.1);
    stated.push_back(coverage.accuracy_mm[v]);
  }
  ASSERT_GT(stated.size(), errors.size() * 9 / 10);
  std::sort(stated.begin(), stated.end());
  EXPECT_GT(stated[stated.size() / 50], 0.0f) << "hardly any without a statement";
  const double ratio = stated[stated.size() / 2] / (1.4826 * errors[errors.size() / 2]);
  EXPECT_GT(ratio, 0.5);
  EXPECT_LT(ratio, 2.0);
  EXPECT_GT(coverage.open_edge_mm, 20.0);
  EXPECT_EQ(surface->mesh.colors.rows(), surface->mesh.vertices.rows());
}

TEST(ReconstructSurface, ClosesOpeningsOnRequestAndMarksThem) {
  const BallScene scene;
  const auto views = photograph(scene);
  auto maps = true_depth_maps(scene, views);
  // No view knows the depth on a spot of 8 mm across that faces the ring of cameras.
  const Eigen::Vector3d spot =
      scene.centre_mm + scene.radius_mm * Eigen::Vector3d(0.9, 0.0, std::sqrt(0.19));
  for (DepthMap& map : maps) {
    const Rigid3 back = map.camera_from_table.inverse();
    for (int y = 0; y < map.camera.height; ++y) {
      for (int x = 0; x < map.camera.width; ++x) {
        InversePlane& plane = map.planes[map.index(x, y)];
        if (plane.w == 0.0f) continue;
        const Eigen::Vector3d point =
            back * Eigen::Vector3d(map.camera.ray(x + 0.5, y + 0.5) / plane.w);
        if ((point - spot).norm() < 4.0) plane = {};
      }
    }
  }
  SurfaceOptions options = small_options(views);
  options.fusion.voxel_mm = 1.0;
  options.texture.reset();
  const auto open = surface_of_depths(maps, views, options);
  ASSERT_TRUE(open) << open.error().message();
  EXPECT_TRUE(open->filled.vertices.empty());
  options.closed_rim_mm = 60.0;
  const auto closed = surface_of_depths(maps, views, options);
  ASSERT_TRUE(closed) << closed.error().message();
  const FilledOpenings& filled = closed->filled;
  // The ragged border below has pinholes, too.
  EXPECT_GE(filled.closed, 1);
  EXPECT_GE(filled.left_open, 1) << "the large one below";
  EXPECT_GT(filled.area_cm2, 0.3);
  EXPECT_LT(filled.area_cm2, 2.0);
  EXPECT_LT(closed->coverage.open_edge_mm, open->coverage.open_edge_mm - 10.0);
  ASSERT_EQ(filled.vertices.size(), static_cast<std::size_t>(closed->mesh.vertices.rows()));
  int over_the_spot = 0;
  for (std::size_t v = 0; v < filled.vertices.size(); ++v) {
    if (!filled.vertices[v]) continue;
    EXPECT_EQ(closed->coverage.views[v], 0);
    const Eigen::Vector3d point = closed->mesh.vertices.row(static_cast<Eigen::Index>(v));
    over_the_spot += (point - spot).norm() < 5.0 ? 1 : 0;
  }
  EXPECT_GT(over_the_spot, 10);
}

TEST(ReconstructSurface, RefusesWhatItCannotDo) {
  BallScene scene;
  scene.views = 8;  // 45 deg apart on the table
  auto views = photograph(scene);
  const SurfaceOptions options = small_options(views);
  const auto two = reconstruct_surface(std::span(views).first(2), options);
  ASSERT_FALSE(two);
  EXPECT_EQ(two.error().kind, ErrorKind::bad_input);

  const std::vector<StereoView> far_apart = {views[0], views[3], views[6]};
  const auto wide = reconstruct_surface(far_apart, options);
  ASSERT_FALSE(wide);
  EXPECT_EQ(wide.error().where, views[0].name);

  views[4].pass = 1;
  const auto mixed = reconstruct_surface(views, options);
  ASSERT_FALSE(mixed);
  EXPECT_EQ(mixed.error().where, views[4].name);

  SurfaceOptions senseless = options;
  senseless.fusion.voxel_mm = 0.0;
  const auto refused = reconstruct_surface(views, senseless);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::usage);
}

TEST(ReconstructSurface, StopsWhenAsked) {
  const auto views = photograph(BallScene{});
  std::stop_source source;
  source.request_stop();
  Progress progress;
  progress.stop = source.get_token();
  const auto surface = reconstruct_surface(views, small_options(views), progress);
  ASSERT_FALSE(surface);
  EXPECT_EQ(surface.error().kind, ErrorKind::cancelled);
}

TEST(DepthMaps, AreTheSameForAnyNumberOfThreads) {
  BallScene scene;
  scene.width = 70;
  scene.height = 56;
  scene.focal_px = 210.0;
  const auto views = photograph(scene);
  const auto hull = carve_visual_hull(views, 32, 1);
  ASSERT_TRUE(hull);
  DepthMapOptions options;
  options.coarsest_level = 1;
  options.threads = 1;
  const auto one = compute_depth_maps(views, *hull, options, {});
  options.threads = 3;
  const auto three = compute_depth_maps(views, *hull, options, {});
  ASSERT_TRUE(one && three);
  for (std::size_t v = 0; v < one->size(); ++v) {
    ASSERT_EQ((*one)[v].agreement, (*three)[v].agreement);
    for (std::size_t i = 0; i < (*one)[v].planes.size(); ++i) {
      ASSERT_EQ((*one)[v].planes[i].w, (*three)[v].planes[i].w);
    }
  }
}

}  // namespace
}  // namespace skullstation
