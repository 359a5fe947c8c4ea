// How well and how fast templates are registered, as Markdown tables beside the targets of
// docs/registration.md. Usage:
//   bench_registration skulls TEMPLATE [N = 20] [seed = 1000] [smooth|projected-volume|volume]
//                                                                people of a seed of their own
//   bench_registration heads  TEMPLATE [N = 20] [seed = 1000]
//   bench_registration led-heads TEMPLATE [N = 20] [seed = 1000]   heads led by their skulls
//   bench_registration mesh   TEMPLATE SKULL.ply...              real skulls
//   bench_registration poses  TEMPLATE [N = 100] [SKULL.ply...]  poses alone, as fits begin with
// TEMPLATE is a file made by `skullstation template build`.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "bench/seconds.h"
#include "core/random.h"
#include "core/units.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/phantom/person.h"
#include "reconstruction/registration/head_led_by_skull.h"
#include "reconstruction/registration/head_registration.h"
#include "reconstruction/registration/similarity_fit.h"
#include "reconstruction/registration/skull_registration.h"
#include "reconstruction/registration/surface_pose.h"
#include "reconstruction/templates/template_file.h"

namespace skullstation {
namespace {

constexpr double kPersonEdge_mm = 1.0;

Similarity3 random_pose(Random& random) {
  Similarity3 pose;
  pose.rotation =
      Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal())
          .normalized();
  for (int c = 0; c < 3; ++c) pose.translation[c] = random.uniform(-300.0, 300.0);
  return pose;
}

/// Mean over people of what each stage cost.
class StageCosts {
 public:
  void add(const FitStages& stages) {
    for (const FitStage& stage : stages) {
      if (!seconds_.contains(stage.name)) order_.push_back(stage.name);
      seconds_[stage.name] += stage.processor_seconds;
    }
    ++fits_;
  }
  void print() const {
    fmt::print("\n| stage | processor s |\n|---|---|\n");
    double sum = 0.0;
    for (const std::string& name : order_) {
      const double mean = seconds_.at(name) / fits_;
      fmt::print("| {} | {:.2f} |\n", name, mean);
      sum += mean;
    }
    fmt::print("| all | {:.1f} |\n\n", sum);
  }

 private:
  std::vector<std::string> order_;
  std::map<std::string, double> seconds_;
  int fits_ = 0;
};

int bench_skulls(const SkullTemplate& skull, int people, std::uint64_t seed,
                 const SkullRegistrationOptions& options) {
  fmt::print(
      "| person | face mean mm (<= 0.35) | P95 (<= 1.2) | inverted (0) | correspondence mean, "
      "outer "
      "(<= 2) | face | landmarks mean (<= 1.5) | seen | processor s (<= 70) |\n"
      "|---|---|---|---|---|---|---|---|---|\n");
  const PersonMaker maker(kPersonEdge_mm, 0);
  std::vector<double> sums(8, 0.0);
  StageCosts costs;
  int done = 0;
  for (int i = 0; i < people; ++i) {
    const Person person = maker.make(draw_person(mix(seed, static_cast<std::uint64_t>(i))), 0);
    Random random(mix(seed + 1, static_cast<std::uint64_t>(i)));
    const Similarity3 pose = random_pose(random);
    const Seconds began = Seconds::now();
    const auto fit = register_skull(skull, moved(pose, person.skull), options);
    const double seconds = (Seconds::now() - began).processor;
    if (!fit) {
      fmt::print("| {} | {} |\n", i + 1, fit.error().message());
      continue;
    }
    double outer = 0.0;
    double face = 0.0;
    int outer_count = 0;
    int face_count = 0;
    for (int v = 0; v < skull.boundary_count; ++v) {
      const auto at = static_cast<std::size_t>(v);
      if (!skull.outer[at]) continue;
      const Eigen::Vector3d vertex = skull.vertices.row(v);
      const bool lower = bone_of(skull.region[at]) == SkullBone::mandible;
      const Eigen::Vector3d truth = pose * person.bone.on_person(vertex, lower);
      const double error = (fit->vertices.row(v).transpose() - truth).norm();
      outer += error;
      ++outer_count;
      if (!is_facial(skull.region[at])) continue;
      face += error;
      ++face_count;
    }
    double landmarks = 0.0;
    for (const TemplateLandmark& landmark : skull.landmarks) {
      const Eigen::Vector3d place = landmark.place.position(skull.vertices);
      const auto corner = static_cast<std::size_t>(landmark.place.corners[0]);
      const bool lower = bone_of(skull.region[corner]) == SkullBone::mandible;
      const Eigen::Vector3d truth = pose * person.bone.on_person(place, lower);
      landmarks += (landmark.place.position(fit->vertices) - truth).norm();
    }
    const std::vector<double> row = {fit->quality.facial.mean_mm,
                                     fit->quality.facial.p95_mm,
                                     static_cast<double>(fit->quality.inverted_tetrahedra),
                                     outer / outer_count,
                                     face / face_count,
                                     landmarks / static_cast<double>(skull.landmarks.size()),
                                     fit->quality.observed_share,
                                     seconds};
    fmt::print("| {} | {:.3f} | {:.2f} | {:.0f} | {:.2f} | {:.2f} | {:.2f} | {:.3f} | {:.1f} |\n",
               i + 1, row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7]);
    std::fflush(stdout);
    for (std::size_t c = 0; c < row.size(); ++c) sums[c] += row[c];
    costs.add(fit->stages);
    ++done;
  }
  if (done == 0) return 1;
  for (double& sum : sums) sum /= done;
  fmt::print("| mean | {:.3f} | {:.2f} | {:.0f} | {:.2f} | {:.2f} | {:.2f} | {:.3f} | {:.1f} |\n",
             sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], sums[6], sums[7]);
  costs.print();
  return done == people ? 0 : 1;
}

/// With `skull`, each head is led by its skull, as in model building.
int bench_heads(const HeadTemplate& head, const SkullTemplate* skull, int people,
                std::uint64_t seed) {
  fmt::print(
      "| person | weighted RMS mm (<= 0.19) | kept % (>= 90) | face mean | face P95 | "
      "correspondence mean, face | processor s (<= 10) |\n|---|---|---|---|---|---|---|\n");
  const PersonMaker maker(kPersonEdge_mm, 0);
  std::vector<double> sums(6, 0.0);
  StageCosts costs;
  int done = 0;
  for (int i = 0; i < people; ++i) {
    const Person person = maker.make(draw_person(mix(seed, static_cast<std::uint64_t>(i))), 0);
    Random random(mix(seed + 1, static_cast<std::uint64_t>(i)));
    const Similarity3 pose = random_pose(random);
    HeadRegistrationOptions options;
    Similarity3 bone_pose;
    if (skull != nullptr) {
      const auto bone = register_skull(*skull, moved(pose, person.skull));
      if (!bone) {
        fmt::print("| {} | {} |\n", i + 1, bone.error().message());
        continue;
      }
      options.start = head_led_by_skull(head, *skull, *bone);
      bone_pose = bone->input_from_template;
      options.pose = &bone_pose;
    }
    const Seconds began = Seconds::now();
    const auto fit = register_head(head, moved(pose, person.skin), options);
    const double seconds = (Seconds::now() - began).processor;
    if (!fit) {
      fmt::print("| {} | {} |\n", i + 1, fit.error().message());
      continue;
    }
    double error = 0.0;
    int count = 0;
    for (Eigen::Index v = 0; v < head.vertices.rows(); ++v) {
      const HeadRegion region = head.region[static_cast<std::size_t>(v)];
      if (region == HeadRegion::scalp || region == HeadRegion::neck || region == HeadRegion::ears) {
        continue;
      }
      const Eigen::Vector3d moved_skin = person.face.face_from_canonical(head.vertices.row(v));
      const Eigen::Vector3d truth = pose * person.bone.person_from_canonical(moved_skin);
      error += (fit->vertices.row(v).transpose() - truth).norm();
      ++count;
    }
    const std::vector<double> row = {fit->quality.weighted_rms_mm,
                                     100.0 * fit->quality.kept_share,
                                     fit->quality.facial.mean_mm,
                                     fit->quality.facial.p95_mm,
                                     error / count,
                                     seconds};
    fmt::print("| {} | {:.3f} | {:.1f} | {:.3f} | {:.2f} | {:.2f} | {:.1f} |\n", i + 1, row[0],
               row[1], row[2], row[3], row[4], row[5]);
    std::fflush(stdout);
    for (std::size_t c = 0; c < row.size(); ++c) sums[c] += row[c];
    costs.add(fit->stages);
    ++done;
  }
  if (done == 0) return 1;
  for (double& sum : sums) sum /= done;
  fmt::print("| mean | {:.3f} | {:.1f} | {:.3f} | {:.2f} | {:.2f} | {:.1f} |\n", sums[0], sums[1],
             sums[2], sums[3], sums[4], sums[5]);
  costs.print();
  return done == people ? 0 : 1;
}

int bench_meshes(const SkullTemplate& skull, const std::vector<std::string>& files) {
  fmt::print(
      "| skull | face mean mm (<= 0.5) | P95 (<= 2) | without teeth, mean | P95 | outside mean | "
      "inverted (0) | seen | processor s |\n|---|---|---|---|---|---|---|---|---|\n");
  int failures = 0;
  for (const std::string& file : files) {
    const auto input = read_mesh(file);
    const Seconds began = Seconds::now();
    const Result<FittedSkull> fit =
        input ? register_skull(skull, *input) : Result<FittedSkull>(forward(input));
    if (!fit) {
      fmt::print("| {} | {} |\n", file, fit.error().message());
      ++failures;
      continue;
    }
    const SkullFitQuality& q = fit->quality;
    fmt::print("| {} | {:.3f} | {:.2f} | {:.3f} | {:.2f} | {:.3f} | {} | {:.3f} | {:.1f} |\n", file,
               q.facial.mean_mm, q.facial.p95_mm, q.facial_bone.mean_mm, q.facial_bone.p95_mm,
               q.outer.mean_mm, q.inverted_tetrahedra, q.observed_share,
               (Seconds::now() - began).processor);
  }
  return failures == 0 ? 0 : 1;
}

/// What is left when everything beyond a plane is broken off, `share` of the triangles.
TriangleMesh broken(const TriangleMesh& mesh, const Eigen::Vector3d& normal, double share) {
  std::vector<std::pair<double, Eigen::Index>> order;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    order.emplace_back(mesh.vertices.row(mesh.triangles(f, 0)).dot(normal), f);
  }
  std::ranges::sort(order);
  order.resize(static_cast<std::size_t>((1.0 - share) * static_cast<double>(order.size())));
  TriangleMesh result = mesh;
  result.triangles.resize(static_cast<Eigen::Index>(order.size()), 3);
  for (std::size_t i = 0; i < order.size(); ++i) {
    result.triangles.row(static_cast<Eigen::Index>(i)) = mesh.triangles.row(order[i].second);
  }
  return result;
}

Eigen::Vector3d middle_of(const TriangleMesh& mesh) {
  Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    sum += mesh.vertices.row(mesh.triangles(f, 0));
  }
  return (sum / static_cast<double>(mesh.triangles.rows())).transpose();
}

/// Poses found within 5 deg and 5 mm of where the whole skull in its own pose is found, in the
/// middle of what is left of it; and those within 20 deg and 20 mm, which a fit mends.
void bench_poses_of(const std::string& name, const TriangleMesh& mesh, const TriangleMesh& surface,
                    int poses, double missing) {
  SurfacePoseOptions options;
  const auto reference = find_surface_pose(surface, mesh, options);
  if (!reference) {
    fmt::print("| {} | {} |\n", name, reference.error().message());
    return;
  }
  const Similarity3 template_from_mesh = reference->inverse();
  Random random(17);
  int found = 0;
  int nearly = 0;
  double most_seconds = 0.0;
  const Seconds began = Seconds::now();
  for (int i = 0; i < poses; ++i) {
    const Similarity3 pose = random_pose(random);
    const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
    const TriangleMesh left = missing > 0.0 ? broken(mesh, direction.normalized(), missing) : mesh;
    const Eigen::Vector3d center = middle_of(left);
    const TriangleMesh part = moved(pose, left);
    const Seconds start = Seconds::now();
    options.seed = static_cast<std::uint64_t>(i) + 1;
    const auto fit = find_surface_pose(surface, part, options);
    most_seconds = std::max(most_seconds, (Seconds::now() - start).processor);
    if (!fit) continue;
    const Similarity3 own = fit->inverse() * pose;
    const double angle = degrees(own.rotation.angularDistance(template_from_mesh.rotation));
    const double shift = (own * center - template_from_mesh * center).norm();
    found += angle <= 5.0 && shift <= 5.0 ? 1 : 0;
    nearly += angle <= 20.0 && shift <= 20.0 ? 1 : 0;
  }
  fmt::print("| {} | {:.0f} % | {} of {} | {} | {:.2f} | {:.2f} |\n", name, 100.0 * missing, found,
             poses, nearly, (Seconds::now() - began).processor / poses, most_seconds);
  std::fflush(stdout);
}

int bench_poses(const SkullTemplate& skull, int poses, const std::vector<std::string>& files) {
  const TriangleMesh surface = surface_of(skull, skull.vertices);
  fmt::print(
      "| skull | missing | found | nearly | processor s, mean | most "
      "|\n|---|---|---|---|---|---|\n");
  const Person person = PersonMaker(2.0, 0).make(draw_person(77), 0);
  bench_poses_of("phantom", person.skull, surface, poses, 0.0);
  bench_poses_of("phantom", person.skull, surface, poses, 0.4);
  for (const std::string& file : files) {
    const auto mesh = read_mesh(file);
    if (!mesh) {
      fmt::print("| {} | {} |\n", file, mesh.error().message());
      return 1;
    }
    bench_poses_of(file, *mesh, surface, poses, 0.0);
  }
  return 0;
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 2) {
    fmt::print(stderr,
               "usage: bench_registration skulls|heads|led-heads|mesh|poses TEMPLATE ...\n");
    return 2;
  }
  const auto templates = read_templates(arguments[1]);
  if (!templates) {
    fmt::print(stderr, "{}\n", templates.error().message());
    return 3;
  }
  const std::string& what = arguments[0];
  const std::vector<std::string> rest(arguments.begin() + 2, arguments.end());
  const auto number = [&](std::size_t i, int otherwise) {
    return rest.size() > i ? std::atoi(rest[i].c_str()) : otherwise;
  };
  const auto seed = static_cast<std::uint64_t>(number(1, 1000));
  if (what == "skulls") {
    SkullRegistrationOptions options;
    const std::string regularizer = rest.size() > 2 ? rest[2] : "smooth";
    if (regularizer == "volume") options.regularizer = SkullRegularizer::volume;
    if (regularizer == "projected-volume") options.regularizer = SkullRegularizer::projected_volume;
    return bench_skulls(templates->skull, number(0, 20), seed, options);
  }
  if (what == "heads") return bench_heads(templates->head, nullptr, number(0, 20), seed);
  if (what == "led-heads") {
    return bench_heads(templates->head, &templates->skull, number(0, 20), seed);
  }
  if (what == "mesh") return bench_meshes(templates->skull, rest);
  if (what == "poses") {
    const std::vector<std::string> files(rest.begin() + (rest.empty() ? 0 : 1), rest.end());
    return bench_poses(templates->skull, number(0, 100), files);
  }
  fmt::print(stderr, "no bench named {}\n", what);
  return 2;
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) { return skullstation::run({argv + 1, argv + argc}); }
