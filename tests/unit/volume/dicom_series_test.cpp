#include "reconstruction/volume/dicom_series.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "core/file.h"
#include "reconstruction/volume/dicom_writer.h"
#include "reconstruction/volume/volume_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/volume/analytic_volumes.h"
#include "tests/unit/volume/dicom_edit.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using namespace skullstation::testing;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

Volume small_volume(double angle_deg = 0.0, std::uint64_t seed = 1) {
  return noise(grid_of({12, 10, 6}, {0.5, 0.7, 1.25}, angle_deg), seed);
}

fs::path slice(const fs::path& folder, int number) {
  return folder / ("IM_000" + std::to_string(number) + ".dcm");
}

/// Changes every file of a series with `change(data set, number of the slice from 1)`.
void edit_all(const fs::path& folder, int slices,
              const std::function<void(DicomEdit&, int)>& change) {
  for (int k = 1; k <= slices; ++k) {
    DicomEdit edit(slice(folder, k));
    change(edit, k);
    edit.save(slice(folder, k));
  }
}

TEST(DicomSeries, WhatIsWrittenIsReadBackWithItsGeometry) {
  for (const bool twelve_bit : {false, true}) {
    for (const double angle_deg : {0.0, 17.0, 100.0}) {
      const TemporaryFolder folder;
      Volume volume = small_volume(angle_deg);
      volume.info.age_years = 61;
      volume.info.sex = "F";
      DicomWriteOptions options;
      options.twelve_bit = twelve_bit;
      ASSERT_TRUE(write_dicom_series(volume, folder / "ct", options));
      const auto back = read_volume(folder / "ct", {});
      ASSERT_TRUE(back) << back.error().message();
      EXPECT_EQ(back->hu, volume.hu);
      EXPECT_TRUE(same_place(back->grid, volume.grid, 1e-9)) << angle_deg;
      EXPECT_TRUE(back->info.warnings.empty());
      EXPECT_EQ(back->info.age_years, 61);
      EXPECT_EQ(back->info.sex, "F");
    }
  }
}

TEST(DicomSeries, TheWholeRangeOfSixteenBitsIsReadBack) {
  const TemporaryFolder folder;
  Volume volume = small_volume();
  volume.hu[0] = -32768;
  volume.hu[1] = 32767;
  ASSERT_TRUE(write_dicom_series(volume, folder / "ct"));
  EXPECT_EQ(read_volume(folder / "ct", {})->hu, volume.hu);
}

TEST(DicomSeries, TheSameVolumeGivesTheSameBytes) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_dicom_series(small_volume(), folder / "a"));
  ASSERT_TRUE(write_dicom_series(small_volume(), folder / "b"));
  EXPECT_EQ(*read_file(slice(folder / "a", 3)), *read_file(slice(folder / "b", 3)));
}

TEST(DicomSeries, FileNamesAndFoldersDoNotMatter) {
  const TemporaryFolder folder;
  const Volume volume = small_volume(12.0);
  ASSERT_TRUE(write_dicom_series(volume, folder / "ct"));
  fs::create_directory(folder / "ct" / "b");
  fs::rename(slice(folder / "ct", 1), folder / "ct" / "z");
  fs::rename(slice(folder / "ct", 5), folder / "ct" / "b" / "0");
  ASSERT_TRUE(write_file_durably(folder / "ct" / "README.txt", "not a slice"));
  const auto back = read_volume(folder / "ct", {});
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->hu, volume.hu);
  EXPECT_TRUE(same_place(back->grid, volume.grid, 1e-9));
  EXPECT_THAT(back->info.warnings, Contains(HasSubstr("1 files")));
}

TEST(DicomSeries, OneOfItsFilesStandsForTheSeries) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_dicom_series(small_volume(), folder / "ct"));
  ASSERT_TRUE(write_dicom_series(small_volume(0.0, 2), folder / "ct2"));
  fs::rename(slice(folder / "ct2", 4), folder / "ct" / "x");
  for (int k : {1, 2, 3, 5, 6}) {
    fs::rename(slice(folder / "ct2", k), folder / "ct" / ("x" + std::to_string(k)));
  }
  const auto back = read_volume(folder / "ct" / "x", {});
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->hu, small_volume(0.0, 2).hu);
}

TEST(DicomSeries, LosslessTransferSyntaxesAreDecoded) {
  for (const TransferSyntax syntax :
       {TransferSyntax::jpeg_lossless, TransferSyntax::rle, TransferSyntax::jpeg_ls_lossless}) {
    for (const bool twelve_bit : {true, false}) {
      const TemporaryFolder folder;
      const Volume volume = small_volume(5.0);
      DicomWriteOptions options;
      options.twelve_bit = twelve_bit;
      ASSERT_TRUE(write_dicom_series(volume, folder / "ct", options));
      for (int k = 1; k <= 6; ++k) transcode(slice(folder / "ct", k), syntax);
      const auto back = read_volume(folder / "ct", {});
      ASSERT_TRUE(back) << back.error().message();
      EXPECT_EQ(back->hu, volume.hu) << static_cast<int>(syntax) << twelve_bit;
    }
  }
}

TEST(DicomSeries, BitsAboveTheStoredOnesAreIgnored) {
  const TemporaryFolder folder;
  DicomWriteOptions options;
  options.twelve_bit = true;
  const Volume volume = small_volume();
  ASSERT_TRUE(write_dicom_series(volume, folder / "ct", options));
  edit_all(folder / "ct", 6, [](DicomEdit& edit, int) { edit.fill_unused_bits(); });
  EXPECT_EQ(read_volume(folder / "ct", {})->hu, volume.hu);
}

TEST(DicomSeries, EachSliceHasItsOwnRescale) {
  const TemporaryFolder folder;
  Volume volume = small_volume();
  for (std::int16_t& hu : volume.hu) hu = static_cast<std::int16_t>(hu / 2);
  ASSERT_TRUE(write_dicom_series(volume, folder / "ct"));
  edit_all(folder / "ct", 6, [](DicomEdit& edit, int k) {
    edit.set(0x0028, 0x1053, "2");
    edit.set(0x0028, 0x1052, std::to_string(100 * k));
  });
  const auto back = read_volume(folder / "ct", {});
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->at(3, 4, 0), 2 * volume.at(3, 4, 0) + 100);
  EXPECT_EQ(back->at(3, 4, 5), 2 * volume.at(3, 4, 5) + 600);
}

TEST(DicomSeries, AMissingSliceIsRefusedWithItsPosition) {
  const TemporaryFolder folder;
  const Volume volume = small_volume();
  ASSERT_TRUE(write_dicom_series(volume, folder / "ct"));
  fs::remove(slice(folder / "ct", 3));
  const auto back = read_volume(folder / "ct", {});
  ASSERT_FALSE(back);
  const Eigen::Vector3d missing = volume.grid.patient_from_voxel({0, 0, 2});
  char position[80];
  std::snprintf(position, sizeof position, "(%.2f, %.2f, %.2f) mm", missing.x(), missing.y(),
                missing.z());
  EXPECT_THAT(back.error().message(), AllOf(HasSubstr("a slice is missing"), HasSubstr(position),
                                            HasSubstr("IM_0002.dcm"), HasSubstr("IM_0004.dcm")));
}

TEST(DicomSeries, SeveralSeriesAreListedAndChosen) {
  const TemporaryFolder folder;
  DicomWriteOptions options;
  options.series_number = 4;
  options.series_description = "Bone 1.0";
  ASSERT_TRUE(write_dicom_series(small_volume(), folder / "ct" / "a", options));
  options.series_number = 5;
  options.series_description = "Soft 1.0";
  ASSERT_TRUE(write_dicom_series(small_volume(0.0, 2), folder / "ct" / "b", options));
  const auto both = read_volume(folder / "ct", {});
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().message(),
              AllOf(HasSubstr("2 CT series"), HasSubstr("number 4 \"Bone 1.0\" (6 slices)"),
                    HasSubstr("number 5 \"Soft 1.0\" (6 slices)"), HasSubstr("--series")));
  VolumeReadOptions choice;
  for (const char* word : {"5", "Soft 1.0"}) {
    choice.series = word;
    const auto chosen = read_volume(folder / "ct", choice);
    ASSERT_TRUE(chosen) << chosen.error().message();
    EXPECT_EQ(chosen->hu, small_volume(0.0, 2).hu);
  }
  choice.series = "9";
  EXPECT_THAT(read_volume(folder / "ct", choice).error().message(),
              HasSubstr("no series \"9\"; there are: number"));
}

TEST(DicomSeries, LocalizersAndOtherModalitiesAreLeftOut) {
  const TemporaryFolder folder;
  const Volume volume = small_volume();
  ASSERT_TRUE(write_dicom_series(volume, folder / "ct"));
  DicomEdit localizer(slice(folder / "ct", 1));
  localizer.set(0x0008, 0x0008, "ORIGINAL\\PRIMARY\\LOCALIZER");
  localizer.set(0x0020, 0x0037, "1\\0\\0\\0\\0\\-1");
  localizer.save(folder / "ct" / "scout");
  DicomEdit report(slice(folder / "ct", 1));
  report.set(0x0008, 0x0060, "MR");
  report.set(0x0008, 0x0016, "1.2.840.10008.5.1.4.1.1.4");
  report.save(folder / "ct" / "mr");
  const auto back = read_volume(folder / "ct", {});
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->hu, volume.hu);
  EXPECT_THAT(back->info.warnings, Contains(HasSubstr("1 localizer")));
  EXPECT_THAT(back->info.warnings, Contains(HasSubstr("are no CT images")));
  EXPECT_THAT(read_volume(folder / "ct" / "mr", {}).error().message(), HasSubstr("modality MR"));
  for (int k = 1; k <= 6; ++k) fs::remove(slice(folder / "ct", k));
  fs::remove(folder / "ct" / "scout");
  EXPECT_THAT(read_volume(folder / "ct", {}).error().message(),
              HasSubstr("holds no CT images, but modality MR"));
}

TEST(DicomSeries, ATiltedGantryIsUndoneWithAWarning) {
  const TemporaryFolder folder;
  // A ball, sampled on slices that drift by tan(15 deg) of their distance.
  const VoxelGrid grid = grid_of({60, 60, 31}, {1.0, 1.0, 1.5});
  const double slope = std::tan(radians(15.0));
  const auto ball = [](const Eigen::Vector3d& p) {
    return -1000.0 + 1100.0 * std::exp(-p.squaredNorm() / 100.0);
  };
  const Volume tilted = sampled(grid, [&](const Eigen::Vector3d& p) {
    return ball(p + Eigen::Vector3d(0.0, slope * p.z(), 0.0));
  });
  ASSERT_TRUE(write_dicom_series(tilted, folder / "ct"));
  for (int k = 1; k <= 31; ++k) {
    const fs::path path =
        folder / "ct" / (std::string(k < 10 ? "IM_000" : "IM_00") + std::to_string(k) + ".dcm");
    Eigen::Vector3d position = grid.patient_from_voxel({0, 0, k - 1.0});
    position.y() += slope * position.z();
    DicomEdit edit(path);
    edit.set(0x0020, 0x0032,
             std::to_string(position.x()) + "\\" + std::to_string(position.y()) + "\\" +
                 std::to_string(position.z()));
    edit.save(path);
  }
  const auto back = read_volume(folder / "ct", {});
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_THAT(back->info.warnings, Contains(HasSubstr("tilted by 15.0 degrees")));
  double largest = 0.0;
  for (int k = 0; k < back->grid.size.z(); ++k) {
    for (int j = 12; j < back->grid.size.y() - 12; ++j) {
      const auto p = back->grid.patient_from_voxel(Eigen::Vector3i(30, j, k).cast<double>());
      largest = std::max(largest, std::abs(back->at(30, j, k) - ball(p)));
    }
  }
  EXPECT_LT(largest, 4.0);
}

TEST(DicomSeries, MultiFrameImagesAreRead) {
  const TemporaryFolder folder;
  const Volume volume = small_volume(23.0);
  write_enhanced_ct(volume, folder / "frames.dcm", {4, 0, 5, 2, 1, 3});
  const auto back = read_volume(folder / "frames.dcm", {});
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->hu, volume.hu);
  EXPECT_TRUE(same_place(back->grid, volume.grid, 1e-9));
  write_enhanced_ct(volume, folder / "missing.dcm", {4, 0, 5, 2, 1});
  EXPECT_THAT(read_volume(folder / "missing.dcm", {}).error().message(),
              AllOf(HasSubstr("a slice is missing"), HasSubstr("frame")));
}

TEST(DicomSeries, TheIdentityIsDroppedUnlessAskedFor) {
  const TemporaryFolder folder;
  DicomWriteOptions options;
  options.patient_name = "Doe^Jane";
  options.patient_id = "4711";
  options.series_description = "Head Jane";
  ASSERT_TRUE(write_dicom_series(small_volume(), folder / "ct", options));
  EXPECT_FALSE(read_volume(folder / "ct", {})->info.identity);
  VolumeReadOptions keep;
  keep.keep_identity = true;
  const auto volume = read_volume(folder / "ct", keep);
  ASSERT_TRUE(volume && volume->info.identity);
  EXPECT_EQ(volume->info.identity->name, "Doe^Jane");
  EXPECT_EQ(volume->info.identity->id, "4711");
  EXPECT_EQ(volume->info.identity->series_description, "Head Jane");
}

TEST(DicomSeries, DefectsOfOneSliceAreNamedWithTheFile) {
  const auto error_after = [](const std::function<void(DicomEdit&)>& change) {
    const TemporaryFolder folder;
    EXPECT_TRUE(write_dicom_series(small_volume(), folder / "ct"));
    DicomEdit edit(slice(folder / "ct", 2));
    change(edit);
    edit.save(slice(folder / "ct", 2));
    const auto volume = read_volume(folder / "ct", {});
    EXPECT_FALSE(volume);
    return volume ? std::string() : volume.error().message();
  };
  const auto in_file = HasSubstr("IM_0002.dcm");
  EXPECT_THAT(error_after([](DicomEdit& e) { e.remove(0x0028, 0x1052); }),
              AllOf(in_file, HasSubstr("not in Hounsfield units")));
  EXPECT_THAT(error_after([](DicomEdit& e) { e.set(0x0028, 0x1054, "US"); }),
              AllOf(in_file, HasSubstr("values are in \"US\"")));
  EXPECT_THAT(error_after([](DicomEdit& e) { e.set(0x0020, 0x0032, "1\\2"); }),
              AllOf(in_file, HasSubstr("Image Position")));
  EXPECT_THAT(error_after([](DicomEdit& e) { e.set(0x0020, 0x0037, "1\\0\\0\\1\\0\\0"); }),
              AllOf(in_file, HasSubstr("right angles")));
  EXPECT_THAT(error_after([](DicomEdit& e) { e.set(0x0028, 0x0030, "0.5\\x"); }),
              AllOf(in_file, HasSubstr("Pixel Spacing")));
  EXPECT_THAT(error_after([](DicomEdit& e) { e.set(0x0028, 0x0030, "0.5\\0.5"); }),
              HasSubstr("another pixel spacing"));
  EXPECT_THAT(error_after([](DicomEdit& e) { e.set(0x0020, 0x0037, "0\\1\\0\\-1\\0\\0"); }),
              HasSubstr("another orientation"));
  EXPECT_THAT(error_after([](DicomEdit& e) { e.set(0x0020, 0x0032, "-2.75\\-3.15\\3.125"); }),
              HasSubstr("lies in the same place as"));
  EXPECT_THAT(error_after([](DicomEdit& e) { e.halve_pixels(); }), in_file);
}

TEST(DicomSeries, TruncatedFilesAreNeverReadAsSlices) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_dicom_series(small_volume(), folder / "ct"));
  const std::string bytes = *read_file(slice(folder / "ct", 2));
  for (const double share : {0.0, 0.2, 0.5, 0.7, 0.9, 0.99}) {
    const auto size = static_cast<std::size_t>(share * static_cast<double>(bytes.size()));
    ASSERT_TRUE(write_file_durably(slice(folder / "ct", 2), bytes.substr(0, size)));
    EXPECT_FALSE(read_volume(folder / "ct", {})) << share;
  }
}

TEST(DicomSeries, FoldersWithoutSlicesAndCancellation) {
  const TemporaryFolder folder;
  EXPECT_THAT(read_volume(folder.path(), {}).error().message(), HasSubstr("no DICOM images"));
  ASSERT_TRUE(write_dicom_series(small_volume(), folder / "ct"));
  std::stop_source source;
  source.request_stop();
  Progress progress;
  progress.stop = source.get_token();
  EXPECT_EQ(read_volume(folder / "ct", {}, progress).error().kind, ErrorKind::cancelled);
}

TEST(DicomWriter, WhatASeriesCannotHoldIsRefused) {
  const TemporaryFolder folder;
  EXPECT_FALSE(write_dicom_series(small_volume(), folder.path()));
  Volume volume = small_volume();
  volume.grid.direction.col(0) *= -1.0;
  EXPECT_THAT(write_dicom_series(volume, folder / "a").error().message(), HasSubstr("left-handed"));
  volume = small_volume();
  volume.hu[0] = 4000;
  DicomWriteOptions options;
  options.twelve_bit = true;
  EXPECT_THAT(write_dicom_series(volume, folder / "a", options).error().message(),
              HasSubstr("12 bits"));
  EXPECT_FALSE(fs::exists(folder / "a"));
}

}  // namespace
}  // namespace skullstation
