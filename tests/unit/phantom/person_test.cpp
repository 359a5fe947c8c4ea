#include "reconstruction/phantom/person.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/file.h"
#include "core/median.h"
#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/phantom/person_ct.h"
#include "reconstruction/phantom/person_files.h"
#include "reconstruction/phantom/specimen.h"
#include "reconstruction/phantom/thickness_table.h"
#include "reconstruction/phantom/tooth_loss.h"

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

TEST(Person, HasTheSkinOutsideTheBone) {
  for (const std::uint64_t seed : {21, 22, 23}) {
    const Person person = maker().make(draw_person(seed), 2);
    EXPECT_GE(person.face.least_thickness_mm, 1.5) << seed;
    EXPECT_GT(person.face.least_determinant, 0.15) << seed;
    for (const double thickness_mm : skull_to_skin_mm(person, 2)) ASSERT_GT(thickness_mm, 1.2);
  }
}

TEST(Person, OfThinTissueIsNotThinnerThanItsFloor) {
  PersonParameters thin = average_person(Sex::male);
  for (ThicknessPair& pair : thin.thickness_mm) pair = {0.3 * pair.left_mm, 0.3 * pair.right_mm};
  const Person person = maker().make(thin, 2);
  EXPECT_GE(person.face.least_thickness_mm, 1.5);
}

TEST(Person, OpensTheMouthWithTheMandible) {
  PersonParameters parameters = average_person(Sex::male);
  const Person closed = maker().make(parameters, 2);
  parameters.mandible_opening_deg = 5.0;
  const Person open = maker().make(parameters, 2);
  const auto moved_mm = [&](const char* bone, const char* skin) {
    const auto at = [](const std::vector<Landmark>& landmarks, const char* name) {
      return landmarks[landmark_index(landmarks, name)].position_mm;
    };
    return std::pair{(at(open.bone.landmarks, bone) - at(closed.bone.landmarks, bone)).norm(),
                     (at(open.face.landmarks, skin) - at(closed.face.landmarks, skin)).norm()};
  };
  const auto [chin_mm, chin_skin_mm] = moved_mm("gnathion", "gnathion skin");
  EXPECT_GT(chin_mm, 6.0);
  EXPECT_NEAR(chin_skin_mm, chin_mm, 1.5);
  const auto [brow_mm, brow_skin_mm] = moved_mm("glabella", "glabella skin");
  EXPECT_LT(brow_mm, 1e-9);
  EXPECT_LT(brow_skin_mm, 0.5);
  EXPECT_GE(open.face.least_thickness_mm, 1.5);
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

TEST(ToothLoss, GrowsWithAge) {
  const auto mean_loss = [](double age_years) {
    double sum = 0.0;
    for (std::uint64_t seed = 0; seed < 2000; ++seed) {
      sum += static_cast<double>(draw_missing_teeth(age_years, seed).size()) / 2000.0;
    }
    return sum;
  };
  EXPECT_NEAR(mean_loss(42.0), 3.1, 0.5);
  EXPECT_NEAR(mean_loss(73.0), 9.1, 1.0);
  EXPECT_EQ(draw_missing_teeth(60.0, 3), draw_missing_teeth(60.0, 3));
}

TEST(Person, LacksTheTeethThatAreMissingAndCorrespondsStill) {
  PersonParameters parameters = average_person(Sex::male);
  const Person whole = maker().make(parameters, 2);
  parameters.missing_teeth = {11, 36};
  const Person without = maker().make(parameters, 2);
  EXPECT_EQ(without.skull.triangles, whole.skull.triangles);
  EXPECT_EQ(without.skin.vertices, whole.skin.vertices);
  const auto& landmarks = whole.bone.landmarks;
  const auto at = [&](const char* name) {
    return landmarks[landmark_index(landmarks, name)].position_mm;
  };
  // The right central incisor hangs below the prosthion, the left first molar stands in the jaw.
  double farthest_mm = 0.0;
  std::vector<double> rises_mm;
  for (Eigen::Index v = 0; v < whole.skull.vertices.rows(); ++v) {
    const Eigen::Vector3d before = whole.skull.vertices.row(v);
    const double moved_mm = (without.skull.vertices.row(v).transpose() - before).norm();
    farthest_mm = std::max(farthest_mm, moved_mm);
    if (moved_mm < 0.3) continue;
    const bool incisor = (before - at("prosthion")).norm() < 22.0;
    const bool molar = (before - at("lateral infradentale left")).norm() < 30.0;
    EXPECT_TRUE(incisor || molar) << before.transpose();
    if (v < whole.cranium_vertices && before.z() < at("prosthion").z() - 4.0) {
      rises_mm.push_back(without.skull.vertices(v, 2) - before.z());
    }
  }
  EXPECT_GT(median(rises_mm), 2.0);
  EXPECT_GT(std::ranges::min(rises_mm), -1.0) << "along the neighbours' sides";
  EXPECT_GT(farthest_mm, 4.0);
  EXPECT_LT(farthest_mm, 16.0);
}

TEST(Specimen, LacksWhatTheDamageTakes) {
  const Person person = maker().make(average_person(Sex::male), 2);
  const TriangleMesh whole = specimen(person, {}, 1);
  EXPECT_EQ(whole.triangles, person.skull.triangles);
  ASSERT_EQ(whole.colors.rows(), whole.vertices.rows());
  EXPECT_GT(whole.colors.col(0).maxCoeff(), whole.colors.col(0).minCoeff());
  SpecimenDamage damage;
  ASSERT_TRUE(add_damage(damage, "missing-mandible").has_value());
  EXPECT_EQ(specimen(person, damage, 1).vertices.rows(), person.cranium_vertices);
  damage = {};
  ASSERT_TRUE(add_damage(damage, "missing-calvaria").has_value());
  EXPECT_LT(specimen(person, damage, 1).vertices.col(2).maxCoeff(),
            whole.vertices.col(2).maxCoeff() - 30.0);
  damage = {};
  ASSERT_TRUE(add_damage(damage, "hole").has_value());
  const Eigen::Index lost = whole.vertices.rows() - specimen(person, damage, 1).vertices.rows();
  EXPECT_GT(lost, 20);
  EXPECT_LT(lost, whole.vertices.rows() / 20);
  EXPECT_EQ(add_damage(damage, "no-brain").error().kind, ErrorKind::usage);
}

TEST(PersonCt, FlawsAreKnownByTheirWords) {
  const Person person = maker().make(average_person(Sex::male), 2);
  PhantomCtOptions options;
  for (const char* word :
       {"cropped-calvaria", "cropped-nose", "head-rest", "table", "metal", "padding"}) {
    EXPECT_TRUE(add_flaw(options, person, word).has_value()) << word;
  }
  EXPECT_EQ(options.metal_mm.size(), 2U);
  EXPECT_TRUE(options.validate().has_value());
  EXPECT_EQ(add_flaw(options, person, "ghost").error().kind, ErrorKind::usage);
}

TEST(PersonCt, CarriesThePersonBackToTheCanonicalHead) {
  const Person person = maker().make(draw_person(14), 2);
  const PhantomBody body = body_of(person);
  for (const Eigen::Vector3d& place : {Eigen::Vector3d(30, -80, -10), Eigen::Vector3d(0, 20, 60)}) {
    const Eigen::Vector3d patient =
        person.bone.person_from_canonical(person.face.face_from_canonical(place));
    EXPECT_LT((body.canonical_from_patient(patient).soft - place).norm(), 0.5);
    const Eigen::Vector3d bone = person.bone.person_from_canonical(place);
    EXPECT_LT((body.canonical_from_patient(bone).skull - place).norm(), 0.2);
  }
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
