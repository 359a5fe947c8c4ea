#include "reconstruction/phantom/person.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/file.h"
#include "reconstruction/phantom/person_files.h"
#include "reconstruction/phantom/thickness_table.h"
#include "reconstruction/volume/mesh_topology.h"

namespace skullstation {
namespace {

const PersonMaker& maker() {
  static const PersonMaker made(4.0, 2);
  return made;
}

TEST(CraniometricTable, CorrelationIsOne) {
  const Eigen::MatrixXd correlation = craniometric_correlation();
  const auto count = static_cast<Eigen::Index>(craniometric_table().size());
  ASSERT_EQ(correlation.rows(), count);
  EXPECT_TRUE(correlation.diagonal().isOnes());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation).eigenvalues()[0], 1e-3);
}

TEST(PersonParameters, DrawsFollowTheTables) {
  constexpr int kPeople = 4000;
  const auto thickness = thickness_table();
  std::vector<double> sum(thickness.size(), 0.0);
  std::vector<double> squares(thickness.size(), 0.0);
  double lengths = 0.0;
  for (int i = 0; i < kPeople; ++i) {
    const PersonParameters person = draw_person(static_cast<std::uint64_t>(i));
    const Craniometric& length = craniometric_table()[0];
    lengths += (person.craniometrics_mm[0] - length.mean_mm(person.sex)) / length.sd_mm(person.sex);
    for (std::size_t t = 0; t < thickness.size(); ++t) {
      sum[t] += person.thickness_mm[t].left_mm;
      squares[t] += person.thickness_mm[t].left_mm * person.thickness_mm[t].left_mm;
      EXPECT_GT(person.thickness_mm[t].left_mm, 0.0);
    }
  }
  EXPECT_NEAR(lengths / kPeople, 0.0, 0.06);
  for (std::size_t t = 0; t < thickness.size(); ++t) {
    const double mean = sum[t] / kPeople;
    const double sd = std::sqrt(squares[t] / kPeople - mean * mean);
    EXPECT_NEAR(mean, thickness[t].mean_mm, 0.08 * thickness[t].sd_mm) << thickness[t].pair;
    EXPECT_NEAR(sd, thickness[t].sd_mm, 0.1 * thickness[t].sd_mm) << thickness[t].pair;
  }
}

TEST(PersonParameters, TheSameSeedGivesTheSamePerson) {
  EXPECT_EQ(draw_person(5).craniometrics_mm, draw_person(5).craniometrics_mm);
  EXPECT_NE(draw_person(5).craniometrics_mm, draw_person(6).craniometrics_mm);
}

TEST(Person, HasTheDrawnMeasuresAndThicknesses) {
  const PersonParameters average = average_person(Sex::female);
  const Person person = maker().make(average, 2);
  const auto table = craniometric_table();
  for (std::size_t i = 0; i < table.size(); ++i) {
    EXPECT_NEAR(person.bone.measures_mm[i], average.craniometrics_mm[i],
                0.6 * table[i].sd_mm(Sex::female))
        << table[i].code;
  }
  EXPECT_GT(person.bone.least_determinant, 0.2);
  EXPECT_EQ(person.bone.shrinkings, 0);
  EXPECT_TRUE(topology_of(person.skin).is_closed_manifold());
  EXPECT_EQ(person.skin.triangles, maker().make(average_person(Sex::male), 2).skin.triangles);
}

TEST(Person, LiesInItsOwnFrankfurtPlane) {
  const Person person = maker().make(draw_person(11), 2);
  const auto at = [&](const char* name) {
    return person.bone.landmarks[landmark_index(person.bone.landmarks, name)].position_mm;
  };
  EXPECT_NEAR((at("porion left") + at("porion right")).norm(), 0.0, 1e-6);
  EXPECT_NEAR(at("orbitale left").z() + at("orbitale right").z(), 0.0, 1e-6);
  EXPECT_GT(at("porion left").x(), 40.0);
  EXPECT_LT(at("nasion").y(), -60.0);
}

TEST(Person, IsTheSameForAnyNumberOfThreads) {
  const Person one = maker().make(draw_person(12), 1);
  const Person two = maker().make(draw_person(12), 2);
  EXPECT_EQ(one.skull.vertices, two.skull.vertices);
  EXPECT_EQ(one.skin.vertices, two.skin.vertices);
}

TEST(PersonFiles, MakeASubjectFolder) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "person";
  const Person person = maker().make(draw_person(13), 2);
  ASSERT_TRUE(write_person(person, folder).has_value());
  for (const char* name :
       {"skull.ply", "skin.ply", "landmarks.json", "subject.json", "thickness.csv", "truth.json"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
  }
  EXPECT_NE(read_file(folder / "landmarks.json")->find("\"nasion\""), std::string::npos);
  std::filesystem::remove_all(folder);
}

TEST(PersonFiles, AFolderThatCannotBeIsAnError) {
  const auto file = std::filesystem::path(testing::TempDir()) / "no_folder";
  ASSERT_TRUE(write_file_durably(file, "x").has_value());
  const Person person = maker().make(average_person(Sex::male), 2);
  EXPECT_FALSE(write_person(person, file / "person").has_value());
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace skullstation
