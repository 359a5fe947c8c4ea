// Does CT import find the surfaces that a CT was made from? Scans synthetic people at 0.5 x 0.5 x
// 1 mm, imports the scans and prints the distances between imported and exact surfaces, and how
// long each step takes. Usage: bench_person_ct [N = 3] [seed = 1] [flaw ...]

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "reconstruction/distance/comparison.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/phantom/person.h"
#include "reconstruction/phantom/person_ct.h"
#include "reconstruction/volume/ct_surfaces.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

/// Walls thinner than two voxels do not keep their density in a scan: the report names them.
constexpr double kThinWall_mm = 2.0;
/// The cut under the mandible makes a surface that nobody has.
constexpr double kCropMargin_mm = 5.0;

/// Processor seconds of all threads.
class Stopwatch {
 public:
  double seconds() const { return static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC; }

 private:
  std::clock_t start_ = std::clock();
};

/// Diameter of the largest ball of bone that touches the surface at each vertex [mm], at most
/// `most_mm`: a ball under the vertex is made smaller until it holds no other part of the surface
/// (Ma et al. 2012).
std::vector<double> wall_thickness(const TriangleMesh& mesh, double most_mm) {
  const TriangleBvh surface(mesh);
  std::vector<double> thickness(static_cast<std::size_t>(mesh.vertices.rows()), most_mm);
  parallel_for(static_cast<int>(thickness.size()), 0, [&](int v) {
    const Vector3d place = mesh.vertices.row(v);
    const Vector3d inwards = -mesh.normals.row(v).transpose();
    double radius_mm = 0.5 * most_mm;
    for (int step = 0; step < 20; ++step) {
      const ClosestPoint nearest = surface.closest(place + radius_mm * inwards);
      if (nearest.distance_mm > 0.99 * radius_mm) break;
      const Vector3d across = nearest.point - place;
      const double depth_mm = across.dot(inwards);
      if (depth_mm <= 0.0) break;
      radius_mm = 0.5 * across.squaredNorm() / depth_mm;
    }
    thickness[static_cast<std::size_t>(v)] = 2.0 * radius_mm;
  });
  return thickness;
}

struct Worst {
  double mean_mm = 0.0;
  double p95_mm = 0.0;

  void take(const DistanceStatistics& d) {
    mean_mm = std::max(mean_mm, d.mean_mm);
    p95_mm = std::max(p95_mm, d.p95_mm);
  }
};

/// Near which landmarks of the skin the counted vertices lie that are 0.5 mm or more off, the most
/// first, on standard error.
void print_places(const std::vector<Landmark>& landmarks, const TriangleMesh& mesh,
                  const std::vector<bool>& region, const std::vector<double>& distance_mm) {
  constexpr double kFar_mm = 0.5;
  struct Place {
    int vertices = 0;
    double farthest_mm = 0.0;
  };
  std::map<std::string, Place> places;
  for (std::size_t v = 0; v < distance_mm.size(); ++v) {
    if (!region[v] || std::abs(distance_mm[v]) < kFar_mm) continue;
    const Vector3d place = mesh.vertices.row(static_cast<Eigen::Index>(v));
    const auto off_mm = [&](const Landmark& l) { return (l.position_mm - place).norm(); };
    Place& near = places[std::ranges::min_element(landmarks, {}, off_mm)->name];
    ++near.vertices;
    near.farthest_mm = std::max(near.farthest_mm, std::abs(distance_mm[v]));
  }
  std::vector<std::pair<std::string, Place>> most(places.begin(), places.end());
  std::ranges::sort(most, std::greater(), [](const auto& place) { return place.second.vertices; });
  fmt::print(stderr, "farther than {} mm, of {} vertices:", kFar_mm, distance_mm.size());
  for (std::size_t i = 0; i < std::min<std::size_t>(most.size(), 8); ++i) {
    const auto& [name, place] = most[i];
    fmt::print(stderr, " {} {} (to {:.1f} mm),", name, place.vertices, place.farthest_mm);
  }
  fmt::print(stderr, "\n");
}

void print_distances(const std::string& what, const TriangleMesh& exact,
                     const TriangleMesh& imported, const std::vector<bool>& region, Worst* worst,
                     const std::vector<Landmark>& landmarks = {}) {
  ComparisonOptions options;
  options.samples_per_mm2 = 0.5;
  options.region = region;
  const auto comparison = compare_surfaces(exact, imported, options);
  if (!comparison) {
    fmt::print("| {} | {} |\n", what, comparison.error().message());
    return;
  }
  const DistanceStatistics& to = comparison->a_to_b;
  const DistanceStatistics& back = comparison->b_to_a;
  fmt::print("| {} | {:.3f} {:.3f} | {:.3f} {:.3f} | {:+.3f} | {:.2f} | {:.1f} |\n", what,
             to.mean_mm, to.p95_mm, back.mean_mm, back.p95_mm, back.signed_mean_mm, to.max_mm,
             to.area_mm2 / 100.0);
  if (!landmarks.empty()) {
    print_places(landmarks, exact, region, comparison->vertex_distance_a_mm);
  }
  if (worst == nullptr) return;
  worst->take(to);
  worst->take(back);
}

/// \returns whether both surfaces are closed and in one piece
bool print_person(int number, const Person& person, const CtSurfaces& surfaces, Worst& skin,
                  Worst& bone) {
  const double low_mm = surfaces.quality.crop_z_mm.value_or(-1000.0) + kCropMargin_mm;
  std::vector<bool> above_cut;
  for (Eigen::Index v = 0; v < person.skin.vertices.rows(); ++v) {
    above_cut.push_back(person.skin.vertices(v, 2) > low_mm);
  }
  const std::string name = fmt::format("{}: ", number);
  print_distances(name + "skin", person.skin, surfaces.skin, above_cut, &skin,
                  person.face.landmarks);
  print_distances(name + "bone, all of it", person.skull, surfaces.skull, {}, nullptr);
  const std::vector<double> wall_mm = wall_thickness(person.skull, 2.0 * kThinWall_mm);
  std::vector<bool> thick;
  for (const double mm : wall_mm) thick.push_back(mm >= kThinWall_mm);
  print_distances(name + "bone of walls from 2 mm", person.skull, surfaces.skull, thick, &bone);
  const CtQuality& q = surfaces.quality;
  return q.skull_closed_manifold && q.skin_closed_manifold && q.skin_components == 1 &&
         q.skull_components == 1 + (q.mandible_apart ? 1 : 0);
}

int run(int count, std::uint64_t seed, const std::vector<std::string>& flaws) {
  const PersonMaker maker(1.5, 0);
  const TissueMap tissue(0);
  Worst skin;
  Worst bone;
  int sound = 0;
  std::string times;
  fmt::print(
      "| person: surface | exact to imported, mean P95 [mm] | imported to exact, mean P95 [mm] | "
      "imported lies outside by [mm] | farthest exact point [mm] | area [cm^2] "
      "|\n|---|---|---|---|---|---|\n");
  for (int i = 0; i < count; ++i) {
    Stopwatch making;
    const Person person = maker.make(draw_person(mix(seed, static_cast<std::uint64_t>(i))), 0);
    const double making_s = making.seconds();
    PhantomCtOptions options;
    options.seed = seed;
    for (const std::string& flaw : flaws) {
      if (const auto added = add_flaw(options, person, flaw); !added) {
        fmt::print(stderr, "{}\n", added.error().message());
        return 2;
      }
    }
    Stopwatch scanning;
    auto volume = phantom_ct(body_of(person), tissue, options);
    if (!volume) {
      fmt::print(stderr, "{}\n", volume.error().message());
      return 5;
    }
    const double scanning_s = scanning.seconds();
    const Eigen::Vector3i size = volume->grid.size;
    Stopwatch importing;
    const auto surfaces = extract_ct_surfaces(*std::move(volume), {});
    if (!surfaces) {
      fmt::print(stderr, "{}\n", surfaces.error().message());
      return 5;
    }
    times += fmt::format("| {} | {:.1f} | {} x {} x {} | {:.0f} | {:.0f} |\n", i + 1, making_s,
                         size.x(), size.y(), size.z(), scanning_s, importing.seconds());
    const bool whole = print_person(i + 1, person, *surfaces, skin, bone);
    sound += whole ? 1 : 0;
    const CtQuality& q = surfaces->quality;
    fmt::print(stderr, "{}: skull {} pieces, mandible apart {}, {} openings; skin {} pieces\n",
               i + 1, q.skull_components, q.mandible_apart, q.skull_openings, q.skin_components);
    for (const CtFinding& finding : q.findings) {
      fmt::print(stderr, "{}: {}: {}\n", i + 1, to_string(finding.warning), finding.text);
    }
  }
  fmt::print(
      "\nWorst of all, mean and P95: skin {:.3f} {:.3f} mm, bone {:.3f} {:.3f} mm (at most 0.15 "
      "and 0.5). Closed and in one piece (the mandible may be one of its own): {} of {}.\n\n",
      skin.mean_mm, skin.p95_mm, bone.mean_mm, bone.p95_mm, sound, count);
  fmt::print(
      "| person | surfaces [processor s] | voxels | CT [processor s] | import [processor s] |\n"
      "|---|---|---|---|---|\n{}",
      times);
  return 0;
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 3;
  const int seed = argc > 2 ? std::atoi(argv[2]) : 1;
  std::vector<std::string> flaws;
  for (int i = 3; i < argc; ++i) flaws.emplace_back(argv[i]);
  return skullstation::run(count, static_cast<std::uint64_t>(seed), flaws);
}
