// Do the skulls of many synthetic people have the measures of mankind? Draws N people, measures
// their skulls and prints, as a Markdown table, the share of a standard deviation by which the mean
// of each measure is off, the ratio of its standard deviation to the table's, and how far the
// correlations are off. Usage: bench_population [N = 200] [seed = 1]

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "reconstruction/phantom/bone_warp.h"
#include "reconstruction/phantom/canonical_skull.h"
#include "reconstruction/phantom/person_parameters.h"
#include "reconstruction/phantom/skull_landmarks.h"

namespace skullstation {
namespace {

struct Drawn {
  PersonParameters person;
  BoneWarp bone;
};

void print_measures(const std::vector<Drawn>& people) {
  const auto table = craniometric_table();
  const auto count = static_cast<Eigen::Index>(people.size());
  const auto measures = static_cast<Eigen::Index>(table.size());
  // In units of the table: deviation from the sex's mean over the sex's SD.
  Eigen::MatrixXd z(count, measures);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index m = 0; m < measures; ++m) {
      const Sex sex = people[i].person.sex;
      z(i, m) = (people[i].bone.measures_mm[m] - table[m].mean_mm(sex)) / table[m].sd_mm(sex);
    }
  }
  const Eigen::RowVectorXd mean = z.colwise().mean();
  const Eigen::MatrixXd centered = z.rowwise() - mean;
  const Eigen::MatrixXd covariance =
      centered.transpose() * centered / static_cast<double>(count - 1);
  const Eigen::VectorXd sd = covariance.diagonal().cwiseSqrt();
  const Eigen::MatrixXd wanted = craniometric_correlation();

  fmt::print(
      "| measure | men, mean and SD of the table [mm] | women | mean is off by [SD] | SD / "
      "table's |\n|---|---|---|---|---|\n");
  int sound_means = 0;
  int sound_sds = 0;
  for (Eigen::Index m = 0; m < measures; ++m) {
    fmt::print("| {} {} | {:.1f} {:.1f} | {:.1f} {:.1f} | {:+.2f} | {:.2f} |\n", table[m].code,
               table[m].name, table[m].male_mean_mm, table[m].male_sd_mm, table[m].female_mean_mm,
               table[m].female_sd_mm, mean[m], sd[m]);
    sound_means += std::abs(mean[m]) <= 0.2;
    sound_sds += std::abs(sd[m] - 1.0) <= 0.15;
  }
  double worst = 0.0;
  double squares = 0.0;
  for (Eigen::Index a = 0; a < measures; ++a) {
    for (Eigen::Index b = 0; b < a; ++b) {
      const double off = covariance(a, b) / (sd[a] * sd[b]) - wanted(a, b);
      worst = std::max(worst, std::abs(off));
      squares += off * off;
    }
  }
  const double pairs = 0.5 * static_cast<double>(measures * (measures - 1));
  fmt::print(
      "\nMeans within 0.2 SD: {} of {}. SDs within 15 %: {} of {}. Correlations are off by "
      "{:.3f} RMS (chance alone: {:.3f}), {:.2f} at worst.\n",
      sound_means, measures, sound_sds, measures, std::sqrt(squares / pairs),
      1.0 / std::sqrt(static_cast<double>(count)), worst);
}

void print_warps(const std::vector<Drawn>& people) {
  double least = 10.0;
  int shrunk = 0;
  for (const Drawn& drawn : people) {
    least = std::min(least, drawn.bone.least_determinant);
    shrunk += drawn.bone.shrinkings > 0;
  }
  fmt::print("Least determinant of a warp's Jacobian: {:.2f}. Draws that were shrunk: {} of {}.\n",
             least, shrunk, people.size());
}

void run(int count, std::uint64_t seed) {
  const BoneWarpModel model(canonical_landmarks(), skull_meshes(skull_solids(), 3.0, 0).cranium);
  std::vector<Drawn> people(count);
  const auto begin = std::chrono::steady_clock::now();
  parallel_for(count, 0, [&](int i) {
    people[i].person = draw_person(mix(seed, i));
    people[i].bone = model.fit(people[i].person.craniometrics_mm, people[i].person.seed,
                               people[i].person.bone_freedom, 1);
  });
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  fmt::print("{} skulls, seed {}.\n\n", count, seed);
  print_measures(people);
  print_warps(people);
  fmt::print(stderr, "{:.2f} s a skull\n", taken.count() / count);
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 200;
  const int seed = argc > 2 ? std::atoi(argv[2]) : 1;
  skullstation::run(count, static_cast<std::uint64_t>(seed));
}
