#include "reconstruction/volume/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "core/file.h"
#include "reconstruction/volume/volume_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/volume/analytic_volumes.h"

namespace skullstation {
namespace {

using skullstation::testing::grid_of;
using skullstation::testing::noise;
using skullstation::testing::same_place;
using skullstation::testing::TemporaryFolder;
using ::testing::Contains;
using ::testing::HasSubstr;

template <class T>
void patch(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// A NIfTI file's bytes after `change` had them.
Result<Volume> read_changed(const std::function<void(std::string&)>& change,
                            const VolumeReadOptions& options = {}) {
  const TemporaryFolder folder;
  EXPECT_TRUE(write_nifti(noise(grid_of({6, 7, 8}, {0.5, 0.6, 1.5}, 20.0), 1), folder / "a.nii"));
  std::string bytes = *read_file(folder / "a.nii");
  change(bytes);
  EXPECT_TRUE(write_file_durably(folder / "a.nii", bytes));
  return read_volume(folder / "a.nii", options);
}

Result<Volume> read_text(const std::string& name, const std::string& header, std::size_t voxels,
                         const VolumeReadOptions& options = {}) {
  const TemporaryFolder folder;
  std::string bytes = header;
  for (std::size_t i = 0; i < voxels; ++i) {
    bytes += static_cast<char>(i);
    bytes += '\0';
  }
  EXPECT_TRUE(write_file_durably(folder / name, bytes));
  return read_volume(folder / name, options);
}

const std::string nrrd =
    "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 3 4\n"
    "space directions: (0.5,0,0) (0,0.5,0) (0,0,2)\nkinds: domain domain domain\nendian: little\n"
    "encoding: raw\nspace origin: (1,2,3)\n";
const std::string mha =
    "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
    "CompressedData = False\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 1 2 3\n"
    "ElementSpacing = 0.5 0.5 2\nDimSize = 2 3 4\nElementType = MET_SHORT\n"
    "ElementDataFile = LOCAL\n";

std::string without(std::string text, const std::string& line_start) {
  const std::size_t begin = text.find(line_start);
  return text.erase(begin, text.find('\n', begin) + 1 - begin);
}

TEST(ImageFile, NiftiIsReadBackInPlace) {
  const TemporaryFolder folder;
  for (const double angle_deg : {0.0, 25.0, 160.0}) {
    const Volume volume = noise(grid_of({6, 7, 8}, {0.5, 0.6, 1.5}, angle_deg), 1);
    for (const char* name : {"a.nii", "a.nii.gz"}) {
      ASSERT_TRUE(write_nifti(volume, folder / name));
      const auto back = read_volume(folder / name, {});
      ASSERT_TRUE(back) << back.error().message();
      EXPECT_EQ(back->hu, volume.hu);
      EXPECT_TRUE(same_place(back->grid, volume.grid, 1e-5)) << angle_deg;
      EXPECT_TRUE(back->info.warnings.empty());
    }
  }
}

TEST(ImageFile, ALeftHandedNiftiKeepsItsPlace) {
  const TemporaryFolder folder;
  Volume volume = noise(grid_of({6, 7, 8}, {0.5, 0.6, 1.5}, 10.0), 1);
  volume.grid.direction.col(2) *= -1.0;
  ASSERT_TRUE(write_nifti(volume, folder / "a.nii"));
  const auto back = read_volume(folder / "a.nii", {});
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_TRUE(same_place(back->grid, volume.grid, 1e-5));
}

TEST(ImageFile, NiftiUnitsAreHeededAndNeverGuessed) {
  constexpr std::size_t xyzt_units = 123;
  const auto metres = read_changed([](std::string& b) { patch(b, xyzt_units, char{1}); });
  ASSERT_FALSE(metres) << "500 mm voxels";
  EXPECT_THAT(metres.error().message(), HasSubstr("--length-unit"));
  const auto unknown = read_changed([](std::string& b) { patch(b, xyzt_units, char{0}); });
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message(), HasSubstr("declares no unit of length"));
  VolumeReadOptions options;
  options.length_unit = LengthUnit::millimetre;
  for (const char code : {0, 1, 3}) {
    const auto told = read_changed([&](std::string& b) { patch(b, xyzt_units, code); }, options);
    ASSERT_TRUE(told) << told.error().message();
    EXPECT_NEAR(told->grid.spacing_mm.z(), 1.5, 1e-6);
    EXPECT_THAT(told->info.warnings, Contains(HasSubstr("as asked")));
  }
}

TEST(ImageFile, NiftiWithoutOrientationNeedsAWord) {
  const auto forget = [](std::string& b) {
    patch(b, 252, std::int16_t{0});
    patch(b, 254, std::int16_t{0});
  };
  const auto refused = read_changed(forget);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message(), HasSubstr("--assume-patient-axes"));
  VolumeReadOptions options;
  options.assume_patient_axes = true;
  const auto told = read_changed(forget, options);
  ASSERT_TRUE(told) << told.error().message();
  EXPECT_EQ(told->grid.direction, Eigen::Matrix3d::Identity());
  EXPECT_EQ(told->info.warnings.size(), 1U);
}

TEST(ImageFile, NiftiScaleAndInterceptMakeHounsfieldUnits) {
  const auto scaled = read_changed([](std::string& b) {
    patch(b, 112, 2.0F);
    patch(b, 116, -24.0F);
  });
  const auto plain = read_changed([](std::string&) {});
  ASSERT_TRUE(scaled && plain);
  for (std::size_t i = 0; i < plain->hu.size(); ++i) {
    EXPECT_EQ(scaled->hu[i], 2 * plain->hu[i] - 24);
  }
}

TEST(ImageFile, FloatsAreRoundedCutOffAndCheckedForNaN) {
  const auto as_floats = [](const std::vector<float>& values) {
    return read_changed([&](std::string& b) {
      patch(b, 70, std::int16_t{16});
      patch(b, 72, std::int16_t{32});
      b.resize(352);
      b.resize(352 + 4 * 6 * 7 * 8, '\0');
      for (std::size_t i = 0; i < values.size(); ++i) patch(b, 352 + 4 * i, values[i]);
    });
  };
  const auto volume = as_floats({1.6F, -1e6F, 40000.0F});
  ASSERT_TRUE(volume) << volume.error().message();
  EXPECT_EQ(volume->hu[0], 2);
  EXPECT_EQ(volume->hu[1], -32768);
  EXPECT_EQ(volume->hu[2], 32767);
  EXPECT_THAT(volume->info.warnings, Contains(HasSubstr("2 voxels lie beyond")));
  const auto broken = as_floats({1.0F, std::numeric_limits<float>::quiet_NaN()});
  ASSERT_FALSE(broken);
  EXPECT_THAT(broken.error().message(), HasSubstr("voxel 1 is not finite"));
}

TEST(ImageFile, TruncatedAndAbsurdNiftiIsRefused) {
  for (const std::size_t size : {0, 100, 347, 400, 352 + 600}) {
    EXPECT_FALSE(read_changed([&](std::string& b) { b.resize(size); })) << size;
  }
  const auto absurd = read_changed([](std::string& b) {
    for (const std::size_t axis : {42, 44, 46}) patch(b, axis, std::int16_t{32767});
  });
  ASSERT_FALSE(absurd);
  EXPECT_THAT(absurd.error().message(), HasSubstr("more than any head scan has"));
  const auto four = read_changed([](std::string& b) {
    patch(b, 40, std::int16_t{4});
    patch(b, 46, std::int16_t{4});
    patch(b, 48, std::int16_t{2});
  });
  ASSERT_FALSE(four);
  EXPECT_THAT(four.error().message(), HasSubstr("not one 3-D volume"));
}

TEST(ImageFile, NiftiWithoutAPlaceIsRefused) {
  const auto matrix = read_changed([](std::string& b) {
    patch(b, 254, std::int16_t{1});
    patch(b, 300, std::numeric_limits<float>::quiet_NaN());
  });
  ASSERT_FALSE(matrix);
  EXPECT_THAT(matrix.error().message(), HasSubstr("byte 300"));
  const auto quaternion = read_changed([](std::string& b) {
    patch(b, 252, std::int16_t{1});
    patch(b, 256, 1e30F);
  });
  ASSERT_FALSE(quaternion);
  EXPECT_THAT(quaternion.error().message(), HasSubstr("no size or place of voxels"));
  EXPECT_FALSE(read_changed([](std::string& b) { patch(b, 80, 1e30F); }));
}

TEST(ImageFile, NrrdAndMetaImageHaveMillimetresByConvention) {
  const auto a = read_text("a.nrrd", nrrd + "\n", 24);
  const auto b = read_text("a.mha", mha, 24);
  for (const auto* volume : {&a, &b}) {
    ASSERT_TRUE(*volume) << volume->error().message();
    EXPECT_EQ((*volume)->grid.size, Eigen::Vector3i(2, 3, 4));
    EXPECT_EQ((*volume)->grid.spacing_mm, Eigen::Vector3d(0.5, 0.5, 2));
    EXPECT_EQ((*volume)->grid.origin_mm, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ((*volume)->at(1, 2, 3), 23);
    EXPECT_THAT((*volume)->info.warnings, Contains(HasSubstr("no unit of length; mm")));
  }
}

TEST(ImageFile, NrrdStatesItsUnitAndSpace) {
  const auto metres = read_text("a.nrrd", nrrd + "space units: \"m\" \"m\" \"m\"\n\n", 24);
  ASSERT_FALSE(metres);
  EXPECT_THAT(metres.error().message(), HasSubstr("500 x 500 x 2000 mm"));
  std::string ras = nrrd;
  ras.replace(ras.find("left-posterior"), 14, "right-anterior");
  const auto volume = read_text("a.nrrd", ras + "space units: \"mm\" \"mm\" \"mm\"\n\n", 24);
  ASSERT_TRUE(volume) << volume.error().message();
  EXPECT_TRUE(volume->info.warnings.empty());
  EXPECT_EQ(volume->grid.origin_mm, Eigen::Vector3d(-1, -2, 3));
  EXPECT_EQ(volume->grid.direction(0, 0), -1.0);
}

TEST(ImageFile, NrrdAndMetaImageWithoutOrientationNeedAWord) {
  std::string header =
      without(without(without(nrrd, "space:"), "space directions"), "space origin");
  header += "spacings: 0.5 0.5 2\n\n";
  const auto a = read_text("a.nrrd", header, 24);
  ASSERT_FALSE(a);
  EXPECT_THAT(a.error().message(), HasSubstr("which way its axes go"));
  const auto b = read_text("a.mha", without(mha, "TransformMatrix"), 24);
  ASSERT_FALSE(b);
  EXPECT_THAT(b.error().message(), HasSubstr("which way its axes go"));
  VolumeReadOptions options;
  options.assume_patient_axes = true;
  EXPECT_TRUE(read_text("a.nrrd", header, 24, options));
  EXPECT_TRUE(read_text("a.mha", without(mha, "TransformMatrix"), 24, options));
}

TEST(ImageFile, TruncatedNrrdAndMetaImageAreRefused) {
  for (const std::size_t voxels : {0, 5, 23}) {
    EXPECT_FALSE(read_text("a.nrrd", nrrd + "\n", voxels)) << voxels;
    EXPECT_FALSE(read_text("a.mha", mha, voxels)) << voxels;
  }
  EXPECT_FALSE(read_text("a.nrrd", nrrd.substr(0, 40), 0));
  EXPECT_FALSE(read_text("a.mha", mha.substr(0, 40), 0));
}

TEST(ImageFile, AMetaImageOfOtherThanThreeDimensionsIsRefused) {
  for (const char* dimensions : {"4", "3555555555555555", "", "x"}) {
    std::string header = mha;
    header.replace(header.find("NDims = 3"), 9, std::string("NDims = ") + dimensions);
    const auto read = read_text("a.mha", header, 24);
    ASSERT_FALSE(read) << dimensions;
    EXPECT_THAT(read.error().message(), HasSubstr("NDims")) << dimensions;
  }
}

TEST(ImageFile, NamesThatAreNoVolumeAreRefused) {
  const TemporaryFolder folder;
  EXPECT_THAT(read_volume(folder / "a.nii", {}).error().message(), HasSubstr("does not exist"));
  ASSERT_TRUE(write_file_durably(folder / "a.txt", "x"));
  EXPECT_THAT(read_volume(folder / "a.txt", {}).error().message(), HasSubstr(".nii.gz"));
  EXPECT_EQ(write_nifti(noise(grid_of({2, 2, 2}, {1, 1, 1}), 1), folder / "a.nrrd").error().kind,
            ErrorKind::usage);
}

TEST(ImageFile, TheRealHeadIsRead) {
  const auto path = skullstation::testing::real_data_folder() / "ct-head" / "ct-head.nii.gz";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "real data is not here: " << path;
  const auto volume = read_volume(path, {});
  ASSERT_TRUE(volume) << volume.error().message();
  EXPECT_EQ(volume->grid.size, Eigen::Vector3i(256, 256, 113));
  EXPECT_EQ(volume->grid.spacing_mm, Eigen::Vector3d(1, 1, 2));
  EXPECT_EQ(volume->grid.direction, Eigen::Matrix3d::Identity());
}

}  // namespace
}  // namespace skullstation
