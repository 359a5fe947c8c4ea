#include "reconstruction/phantom/person_parameters.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "reconstruction/phantom/thickness_table.h"

namespace skullstation {

namespace {

constexpr double kMeanAge_years = 51.5;
constexpr double kAgeSd_years = 19.34;  // of a uniform draw from 18 to 85
constexpr double kBmiMean = 25.0;
constexpr double kBmiSd = 4.0;

/// Log-normal with the given mean and SD, at `z` standard deviations of its logarithm.
double log_normal(double mean, double sd, double z) {
  const double variance = std::log1p((sd / mean) * (sd / mean));
  return mean * std::exp(std::sqrt(variance) * z - 0.5 * variance);
}

std::vector<double> draw_craniometrics(Sex sex, Random& random) {
  const auto table = craniometric_table();
  static const Eigen::MatrixXd factor = craniometric_correlation().llt().matrixL();
  Eigen::VectorXd z(factor.rows());
  for (Eigen::Index i = 0; i < z.size(); ++i) z[i] = random.normal();
  const Eigen::VectorXd deviations = factor * z;
  std::vector<double> measures;
  for (std::size_t i = 0; i < table.size(); ++i) {
    measures.push_back(table[i].mean_mm(sex) +
                       table[i].sd_mm(sex) * deviations[static_cast<Eigen::Index>(i)]);
  }
  return measures;
}

/// Neighbours in the table are neighbours in the face, so a residual goes mostly with the one
/// before it; of one landmark the two sides agree to 0.9.
std::vector<ThicknessPair> draw_thicknesses(const PersonParameters& person, double adiposity,
                                            Random& random) {
  constexpr double kWithNeighbour = 0.7;
  constexpr double kWithOtherSide = 0.9;
  const double male = person.sex == Sex::male ? 1.0 : -1.0;
  const double age = (person.age_years - kMeanAge_years) / kAgeSd_years;
  std::vector<ThicknessPair> thicknesses;
  double common = random.normal();
  for (const TissueThickness& row : thickness_table()) {
    common = kWithNeighbour * common +
             std::sqrt(1.0 - kWithNeighbour * kWithNeighbour) * random.normal();
    const double known = row.with_adiposity * adiposity + row.with_male * male + row.with_age * age;
    const double rest = std::sqrt(1.0 - row.with_adiposity * row.with_adiposity -
                                  row.with_male * row.with_male - row.with_age * row.with_age);
    const auto side = [&] {
      const double own = row.bilateral ? std::sqrt(kWithOtherSide) * common +
                                             std::sqrt(1.0 - kWithOtherSide) * random.normal()
                                       : common;
      return log_normal(row.mean_mm, row.sd_mm, known + rest * own);
    };
    const double left = side();
    thicknesses.push_back({left, row.bilateral ? side() : left});
  }
  return thicknesses;
}

}  // namespace

PersonParameters draw_person(std::uint64_t seed) {
  Random random(mix(seed, 1));
  PersonParameters person;
  person.seed = mix(seed, 2);
  person.sex = random.uniform() < 0.5 ? Sex::male : Sex::female;
  person.age_years = random.uniform(18.0, 85.0);
  const double adiposity = random.normal();
  person.bmi = log_normal(kBmiMean, kBmiSd, adiposity);
  person.craniometrics_mm = draw_craniometrics(person.sex, random);
  person.thickness_mm = draw_thicknesses(person, adiposity, random);
  // Rynn et al. 2010 and its validations: within about 2 mm; the rest is our assumption.
  person.features.pronasale_forward_mm = random.normal(0.0, 2.2);
  person.features.pronasale_down_mm = random.normal(0.0, 2.2);
  person.features.alar_width_mm = random.normal(0.0, 2.0);
  person.features.mouth_width_mm = random.normal(0.0, 3.5);
  person.features.ear_length_mm = random.normal(0.0, 4.0);
  person.features.ear_protrusion_mm = random.normal(0.0, 2.5);
  return person;
}

PersonParameters average_person(Sex sex) {
  PersonParameters person;
  person.sex = sex;
  for (const Craniometric& measure : craniometric_table()) {
    person.craniometrics_mm.push_back(measure.mean_mm(sex));
  }
  for (const TissueThickness& row : thickness_table()) {
    person.thickness_mm.push_back({row.mean_mm, row.mean_mm});
  }
  person.bone_freedom = 0.0;
  person.tissue_freedom = 0.0;
  return person;
}

}  // namespace skullstation
