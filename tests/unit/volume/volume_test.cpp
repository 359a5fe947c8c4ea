#include "reconstruction/volume/volume.h"

#include <gtest/gtest.h>

#include "tests/unit/volume/analytic_volumes.h"

namespace skullstation {
namespace {

using skullstation::testing::grid_of;
using skullstation::testing::noise;

TEST(Volume, VoxelAndPatientCoordinatesAreInverse) {
  const VoxelGrid grid = grid_of({5, 6, 7}, {0.5, 0.7, 1.2}, 33.0);
  const Eigen::Vector3d voxel(1.5, 2.25, 6.0);
  EXPECT_LT((grid.voxel_from_patient(grid.patient_from_voxel(voxel)) - voxel).norm(), 1e-12);
  EXPECT_LT((grid.patient_from_voxel({2, 2.5, 3})).norm(), 1e-12);
}

TEST(Volume, OrientingMovesNoVoxelInThePatient) {
  // Coronal slices from front to back, rows from the right: i goes right, j down, k posterior.
  Volume volume = noise(grid_of({4, 5, 6}, {0.5, 0.7, 1.2}, 8.0), 1);
  Eigen::Matrix3d axes;
  axes << -1, 0, 0, 0, 0, 1, 0, -1, 0;
  volume.grid.direction = volume.grid.direction * axes;
  const Volume oriented = oriented_to_patient_axes(volume);
  EXPECT_EQ(oriented.grid.size, Eigen::Vector3i(4, 6, 5));
  EXPECT_GT(oriented.grid.direction.diagonal().minCoeff(), 0.9);
  EXPECT_NEAR(oriented.grid.direction.determinant(), 1.0, 1e-12);
  for (int k = 0; k < 5; ++k) {
    for (int j = 0; j < 6; ++j) {
      for (int i = 0; i < 4; ++i) {
        const Eigen::Vector3d point =
            oriented.grid.patient_from_voxel(Eigen::Vector3i(i, j, k).cast<double>());
        const Eigen::Vector3d old = volume.grid.voxel_from_patient(point);
        ASSERT_LT((old - old.array().round().matrix()).norm(), 1e-9);
        ASSERT_EQ(oriented.at(i, j, k), volume.at(static_cast<int>(std::lround(old.x())),
                                                  static_cast<int>(std::lround(old.y())),
                                                  static_cast<int>(std::lround(old.z()))));
      }
    }
  }
}

TEST(Volume, ALeftHandedGridBecomesRightHanded) {
  Volume volume = noise(grid_of({3, 4, 5}, {1, 1, 1}), 2);
  volume.grid.direction.col(0) *= -1.0;
  EXPECT_LT(volume.grid.direction.determinant(), 0.0);
  EXPECT_GT(oriented_to_patient_axes(volume).grid.direction.determinant(), 0.0);
}

TEST(Volume, TheHashTellsVoxelsAndGeometryApart) {
  const Volume volume = noise(grid_of({3, 4, 5}, {1, 1, 1}), 3);
  EXPECT_EQ(volume_sha256(volume), volume_sha256(volume));
  Volume other = volume;
  other.at(1, 1, 1) += 1;
  EXPECT_NE(volume_sha256(volume), volume_sha256(other));
  other = volume;
  other.grid.spacing_mm.z() = 2.0;
  EXPECT_NE(volume_sha256(volume), volume_sha256(other));
}

}  // namespace
}  // namespace skullstation
