// Synthetic people as a user makes them, and their scans as another program reads them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/volume/volume_file.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using skullstation::testing::skullstation_cli;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

/// One person with coarse surfaces and a CT of coarse voxels.
std::vector<std::string> phantom(const fs::path& out, std::vector<std::string> more) {
  more.insert(more.begin(), {"phantom", "--count", "1", "--seed", "4", "--out", out, "--edge", "5",
                             "--spacing", "3", "3", "4"});
  return more;
}

TEST(Phantom, ItsDicomSeriesHoldsTheSameVolumeAsItsNifti) {
  const TemporaryFolder folder;
  const auto nifti = skullstation_cli(phantom(folder / "a", {"--ct"}));
  ASSERT_EQ(nifti.exit_code, 0) << nifti.err;
  const auto dicom = skullstation_cli(phantom(folder / "b", {"--ct", "--dicom"}));
  ASSERT_EQ(dicom.exit_code, 0) << dicom.err;
  const auto a = read_volume(folder / "a" / "person_0001" / "ct.nii.gz", {});
  ASSERT_TRUE(a) << a.error().message();
  const fs::path series = folder / "b" / "person_0001" / "ct";
  const auto b = read_volume(series, {});
  ASSERT_TRUE(b) << b.error().message();
  EXPECT_EQ(a->hu, b->hu);
  EXPECT_EQ(a->grid.size, b->grid.size);
  EXPECT_TRUE(a->grid.spacing_mm.isApprox(Eigen::Vector3d(3, 3, 4), 1e-6));
  EXPECT_TRUE(a->grid.spacing_mm.isApprox(b->grid.spacing_mm, 1e-6));
  EXPECT_TRUE(a->grid.direction.isApprox(b->grid.direction, 1e-6));
  EXPECT_LT((a->grid.origin_mm - b->grid.origin_mm).norm(), 1e-3);  // NIfTI holds floats

  const auto import = skullstation_cli(
      {"ct", "import", series, "--out", folder / "subject", "--edge-mm", "5", "--json"});
  ASSERT_EQ(import.exit_code, 0) << import.err;
  EXPECT_EQ(nlohmann::json::parse(import.out)["skin"]["components"], 1);

  ASSERT_TRUE(fs::remove(series / "IM_0020.dcm"));
  const auto gap =
      skullstation_cli({"ct", "import", series, "--out", folder / "gap", "--edge-mm", "5"});
  EXPECT_EQ(gap.exit_code, 3);
  EXPECT_THAT(gap.err, HasSubstr("a slice is missing"));
}

TEST(Phantom, ItsSpecimenAndTruthAreWritten) {
  const TemporaryFolder folder;
  const auto made =
      skullstation_cli({"phantom", "--count", "1", "--seed", "4", "--out", folder / "a", "--edge",
                        "5", "--damage", "missing-mandible,hole"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const fs::path person = folder / "a" / "person_0001";
  const auto skull = read_mesh(person / "skull.ply");
  const auto specimen = read_mesh(person / "specimen.ply");
  ASSERT_TRUE(skull && specimen);
  EXPECT_LT(specimen->vertices.rows(), skull->vertices.rows());
  EXPECT_EQ(specimen->colors.rows(), specimen->vertices.rows());
  const auto truth = nlohmann::json::parse(read_file(person / "truth.json").value());
  EXPECT_GT(truth["craniometrics"].size(), 30U);
  EXPECT_EQ(skullstation_cli({"phantom", "--out", folder / "b", "--damage", "ghost"}).exit_code, 2);
}

}  // namespace
}  // namespace skullstation
