// What one subject of a model costs, and how true its soft tissue is: unseen synthetic people on
// the way that patients go (CT, surfaces, both fits, depths), against the people's own anatomy, as
// Markdown tables (docs/models.md). Usage:
//   bench_subjects [PEOPLE = 6] [SEED = 1000] [TEMPLATES = those of the default model]

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/seconds.h"
#include "core/median.h"
#include "core/random.h"
#include "daemon/model/fitted_subjects.h"
#include "daemon/model/model_source.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/phantom/person_ct.h"
#include "reconstruction/statistics/tissue_thickness.h"
#include "reconstruction/volume/ct_surfaces.h"

namespace skullstation {
namespace {

constexpr double kEdge_mm = 1.0;
const Eigen::Vector3d kSpacing_mm(0.8, 0.8, 1.0);  // as the default model's people

struct Row {
  Seconds surfaces;
  Seconds fits;
  double depths_known = 0.0;       ///< share of the outer vertices
  double depth_error_mm = 0.0;     ///< mean absolute, where a depth is known
  double depth_bias_mm = 0.0;      ///< mean, above 0 where too deep
  double depth_p95_mm = 0.0;       ///< absolute
  double sphere_outside_mm = 0.0;  ///< how far spheres stick out of the fitted head, P95
  double sphere_gap_mm = 0.0;      ///< median distance of a sphere from the fitted head
};

double fraction(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// Depths at the fitted vertices beside those at the places on the person that the vertices stand
/// for: the correspondence's errors count, too.
void compare_depths(const Person& person, const SkullTemplate& skull, const ModelSubject& subject,
                    Row& row) {
  const TriangleBvh skin(person.skin);
  std::vector<double> off;
  double sum = 0.0;
  int outer = 0;
  for (int v = 0; v < skull.boundary_count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    outer += skull.outer[at] ? 1 : 0;
    if (std::isnan(subject.tissue_mm[v])) continue;
    const bool lower = bone_of(skull.region[at]) == SkullBone::mandible;
    const double truth =
        skin.closest(person.bone.on_person(skull.vertices.row(v), lower)).distance_mm;
    off.push_back(std::abs(subject.tissue_mm[v] - truth));
    row.depth_error_mm += off.back();
    sum += subject.tissue_mm[v] - truth;
  }
  const auto count = static_cast<double>(off.size());
  row.depths_known = count / outer;
  row.depth_error_mm /= count;
  row.depth_bias_mm = sum / count;
  row.depth_p95_mm = fraction(std::move(off), 0.95);
}

/// Spheres with the subject's own depths, beside the fitted head.
void compare_spheres(const HeadTemplate& head, const ModelSubject& subject, Row& row) {
  const TriangleMesh fitted = surface_of(head, subject.head);
  const TriangleBvh tree(fitted);
  std::vector<double> outside;
  std::vector<double> gaps;
  for (Eigen::Index v = 0; v < subject.tissue_mm.size(); ++v) {
    const double radius_mm = subject.tissue_mm[v];
    if (std::isnan(radius_mm)) continue;
    const double gap_mm = tree.closest(subject.skull.row(v)).distance_mm - radius_mm;
    outside.push_back(std::max(0.0, -gap_mm));
    gaps.push_back(std::abs(gap_mm));
  }
  row.sphere_outside_mm = fraction(std::move(outside), 0.95);
  row.sphere_gap_mm = median(std::move(gaps));
}

Result<Row> bench_person(const Person& person, const TissueMap& tissue,
                         const Templates& templates) {
  PhantomCtOptions scanner;
  scanner.spacing_mm = kSpacing_mm;
  auto volume = phantom_ct(body_of(person), tissue, scanner);
  if (!volume) return forward(volume);
  Row row;
  const Seconds began = Seconds::now();
  const auto surfaces = extract_ct_surfaces(*std::move(volume), {});
  if (!surfaces) return forward(surfaces);
  const Seconds imported = Seconds::now();
  row.surfaces = imported - began;
  const auto subject =
      fit_subject(surfaces->skull, surfaces->skin, templates.skull, templates.head, {});
  if (!subject) return forward(subject);
  row.fits = Seconds::now() - imported;
  compare_depths(person, templates.skull, *subject, row);
  compare_spheres(templates.head, *subject, row);
  return row;
}

/// Depths of every outer vertex against a skin of about 300,000 triangles.
Result<void> bench_depths_alone(const Person& person, const SkullTemplate& skull) {
  const std::vector<bool> outer(skull.outer.begin(), skull.outer.end());
  TriangleMesh bone = surface_of(skull, skull.vertices);
  for (int v = 0; v < skull.boundary_count; ++v) {
    const bool lower = bone_of(skull.region[static_cast<std::size_t>(v)]) == SkullBone::mandible;
    bone.vertices.row(v) = person.bone.on_person(skull.vertices.row(v), lower).transpose();
  }
  const Seconds began = Seconds::now();
  const auto depths = tissue_thickness(bone, outer, person.skin);
  if (!depths) return forward(depths);
  const Seconds took = Seconds::now() - began;
  fmt::print(
      "\nDepths alone, {} of {} surface vertices against {} triangles of skin: {:.2f} s "
      "(<= 1), {:.2f} processor s\n",
      std::ranges::count(outer, true), skull.boundary_count, person.skin.triangles.rows(),
      took.wall, took.processor);
  return {};
}

int refused(const Error& error) {
  fmt::print(stderr, "{}\n", error.message());
  return exit_code(error.kind);
}

int run(int people, std::uint64_t seed, const std::optional<std::string>& file) {
  const auto templates = load_templates(file);
  if (!templates) return refused(templates.error());
  const PersonMaker maker(kEdge_mm, 0);
  const TissueMap tissue(0);
  fmt::print(
      "| person | surfaces, wall s | processor s | fits and depths, wall s | processor s | depths "
      "known | depths off, mean mm (<= 0.3) | bias | P95 | spheres outside the fitted head, P95 mm "
      "| their median gap |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  Row mean;
  std::optional<Person> last;
  for (int i = 0; i < people; ++i) {
    last = maker.make(draw_person(mix(seed, static_cast<std::uint64_t>(i))), 0);
    const auto row = bench_person(*last, tissue, *templates);
    if (!row) return refused(row.error());
    const auto print = [](const std::string& name, const Row& r) {
      fmt::print(
          "| {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} % | {:.3f} | {:+.3f} | {:.2f} | "
          "{:.3f} | {:.3f} |\n",
          name, r.surfaces.wall, r.surfaces.processor, r.fits.wall, r.fits.processor,
          100.0 * r.depths_known, r.depth_error_mm, r.depth_bias_mm, r.depth_p95_mm,
          r.sphere_outside_mm, r.sphere_gap_mm);
      std::fflush(stdout);
    };
    print(std::to_string(i + 1), *row);
    const double share = 1.0 / people;
    mean.surfaces = mean.surfaces + row->surfaces * share;
    mean.fits = mean.fits + row->fits * share;
    mean.depths_known += share * row->depths_known;
    mean.depth_error_mm += share * row->depth_error_mm;
    mean.depth_bias_mm += share * row->depth_bias_mm;
    mean.depth_p95_mm += share * row->depth_p95_mm;
    mean.sphere_outside_mm += share * row->sphere_outside_mm;
    mean.sphere_gap_mm += share * row->sphere_gap_mm;
    if (i + 1 == people) print("mean", mean);
  }
  if (!last) return 0;
  if (const auto alone = bench_depths_alone(*last, templates->skull); !alone) {
    return refused(alone.error());
  }
  fmt::print("Peak memory with the CT in it: {:.2f} GiB (< 3)\n", peak_memory_gib());
  return 0;
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  std::optional<std::string> file;
  if (argc > 3) file = argv[3];
  return skullstation::run(argc > 1 ? std::atoi(argv[1]) : 6,
                           argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1000, file);
}
