// Do many synthetic people have the measures of mankind? Makes N people, measures their skulls and
// the tissue at their landmarks and prints, as Markdown tables, the share of a standard deviation
// by which the mean of each measure is off, the ratio of its standard deviation to the table's
// (both of the people and of the parameters that were drawn for them, which tells chance from
// bias), how far the craniometric correlations are off, and how near the skin comes to the bone.
// Usage: bench_population [N = 200] [seed = 1]

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
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/phantom/person.h"
#include "reconstruction/phantom/thickness_table.h"

namespace skullstation {
namespace {

struct Drawn {
  PersonParameters person;
  BoneWarp bone;
  FaceWarp face;
  std::vector<double> closest_mm;  ///< from each bone landmark of thickness_table(), of the left
  double least_skin_mm = 0.0;      ///< from the skin's vertices to the bone's mesh
  double seconds = 0.0;
};

/// Mean and standard deviation of a sample.
struct Spread {
  double mean = 0.0;
  double sd = 0.0;
};

Spread spread_of(const std::vector<double>& samples) {
  const Eigen::Map<const Eigen::ArrayXd> values(samples.data(),
                                                static_cast<Eigen::Index>(samples.size()));
  const double mean = values.mean();
  return {mean, std::sqrt((values - mean).square().sum() / static_cast<double>(values.size() - 1))};
}

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
      "| measure | men, mean and SD of the table [mm] | women | mean is off by [SD] | of the drawn "
      "| SD / table's | of the drawn |\n|---|---|---|---|---|---|---|\n");
  int sound_means = 0;
  int sound_sds = 0;
  for (Eigen::Index m = 0; m < measures; ++m) {
    std::vector<double> drawn;
    for (const Drawn& one : people) {
      const PersonParameters& person = one.person;
      drawn.push_back((person.craniometrics_mm[m] - table[m].mean_mm(person.sex)) /
                      table[m].sd_mm(person.sex));
    }
    const Spread chance = spread_of(drawn);
    fmt::print("| {} {} | {:.1f} {:.1f} | {:.1f} {:.1f} | {:+.2f} | {:+.2f} | {:.2f} | {:.2f} |\n",
               table[m].code, table[m].name, table[m].male_mean_mm, table[m].male_sd_mm,
               table[m].female_mean_mm, table[m].female_sd_mm, mean[m], chance.mean, sd[m],
               chance.sd);
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

/// A line for each landmark pair; of bilateral ones both sides count as one sample each.
void print_thickness(const std::vector<Drawn>& people) {
  fmt::print(
      "\n| tissue | table's mean and SD [mm] | mean and SD of the people | mean is off by [SD] | "
      "of "
      "the drawn | SD / table's | of the drawn | mean of the closest distance |\n"
      "|---|---|---|---|---|---|---|---|\n");
  const auto table = thickness_table();
  int sound_means = 0;
  int sound_sds = 0;
  for (std::size_t t = 0; t < table.size(); ++t) {
    std::vector<double> samples;
    std::vector<double> drawn;
    double closest_mm = 0.0;
    for (const Drawn& one : people) {
      samples.push_back(one.face.thickness_mm[t].left_mm);
      drawn.push_back(one.person.thickness_mm[t].left_mm);
      if (table[t].bilateral) {
        samples.push_back(one.face.thickness_mm[t].right_mm);
        drawn.push_back(one.person.thickness_mm[t].right_mm);
      }
      closest_mm += one.closest_mm[t] / static_cast<double>(people.size());
    }
    const Spread got = spread_of(samples);
    const Spread chance = spread_of(drawn);
    const double off = (got.mean - table[t].mean_mm) / table[t].sd_mm;
    const double ratio = got.sd / table[t].sd_mm;
    fmt::print(
        "| {} {} | {:.1f} {:.1f} | {:.2f} {:.2f} | {:+.2f} | {:+.2f} | {:.2f} | {:.2f} | {:.1f} "
        "|\n",
        table[t].pair, table[t].bone, table[t].mean_mm, table[t].sd_mm, got.mean, got.sd, off,
        (chance.mean - table[t].mean_mm) / table[t].sd_mm, ratio, chance.sd / table[t].sd_mm,
        closest_mm);
    sound_means += std::abs(off) <= 0.2;
    sound_sds += std::abs(ratio - 1.0) <= 0.15;
  }
  fmt::print("\nMeans within 0.2 SD: {} of {}. SDs within 15 %: {} of {}.\n", sound_means,
             table.size(), sound_sds, table.size());
}

void print_warps(const std::vector<Drawn>& people) {
  double least_bone = 10.0;
  double least_face = 10.0;
  double least_mm = 100.0;
  int thin = 0;
  int shrunk_bones = 0;
  int shrunk_faces = 0;
  double seconds = 0.0;
  for (const Drawn& drawn : people) {
    least_bone = std::min(least_bone, drawn.bone.least_determinant);
    least_face = std::min(least_face, drawn.face.least_determinant);
    const double own_mm = std::min(drawn.least_skin_mm, drawn.face.least_thickness_mm);
    least_mm = std::min(least_mm, own_mm);
    thin += own_mm < 1.4;
    shrunk_bones += drawn.bone.shrinkings > 0;
    shrunk_faces += drawn.face.shrinkings > 0;
    seconds += drawn.seconds / static_cast<double>(people.size());
  }
  fmt::print(
      "\nLeast determinant of a warp's Jacobian: bone {:.2f}, face {:.2f}. Draws that were moved "
      "towards the average: {} skulls, {} faces of {}. Least distance of a skin from its bone: "
      "{:.2f} mm; {} people have less than 1.4 mm somewhere.\n",
      least_bone, least_face, shrunk_bones, shrunk_faces, people.size(), least_mm, thin);
  fmt::print(stderr, "{:.2f} s a person on one thread, meshes of 2 mm\n", seconds);
}

void run(int count, std::uint64_t seed) {
  const PersonMaker maker(2.0, 0);
  std::vector<Drawn> people(count);
  parallel_for(count, 0, [&](int i) {
    const auto begin = std::chrono::steady_clock::now();
    const Person person = maker.make(draw_person(mix(seed, i)), 1);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    people[i] = {person.parameters, person.bone, person.face, {}, 1e9, taken.count()};
    const TriangleBvh skin(person.skin);
    for (const TissueThickness& row : thickness_table()) {
      const std::string name = std::string(row.bone) + (row.bilateral ? " left" : "");
      const int landmark = landmark_index(person.bone.landmarks, name);
      people[i].closest_mm.push_back(
          skin.closest(person.bone.landmarks[landmark].position_mm).distance_mm);
    }
    const TriangleBvh bone(person.skull);
    for (Eigen::Index v = 0; v < person.skin.vertices.rows(); ++v) {
      people[i].least_skin_mm =
          std::min(people[i].least_skin_mm,
                   bone.closest(person.skin.vertices.row(v), people[i].least_skin_mm).distance_mm);
    }
  });
  fmt::print("{} people, seed {}.\n\n", count, seed);
  print_measures(people);
  print_thickness(people);
  print_warps(people);
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 200;
  const int seed = argc > 2 ? std::atoi(argv[2]) : 1;
  skullstation::run(count, static_cast<std::uint64_t>(seed));
}
