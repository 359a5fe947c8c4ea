#include "capture/simulation/specimen_surface.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

namespace skullstation {

using Eigen::Vector3d;

namespace {

/// Rays that are handed to Embree at once.
constexpr std::size_t batch = 64;
/// Embree's distance and the exact one never differ by so much unless the latter has none.
constexpr double edge_on_mm = 0.05;

void fill(RTCRay& ray, const Vector3d& origin, const Vector3d& direction, double length_mm) {
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tnear = 0.0F;
  ray.tfar = static_cast<float>(length_mm);
  ray.time = 0.0F;
  ray.mask = ~0U;
  ray.id = 0;
  ray.flags = 0;
}

}  // namespace

struct SpecimenSurface::EmbreeScene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  EmbreeScene() = default;
  ~EmbreeScene() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;
};

SpecimenSurface::SpecimenSurface(ShadingMesh mesh, std::unique_ptr<EmbreeScene> embree,
                                 const Vector3d& centre, double radius_mm)
    : mesh_(std::move(mesh)), embree_(std::move(embree)), centre_(centre), radius_mm_(radius_mm) {}

SpecimenSurface::~SpecimenSurface() = default;

Result<std::shared_ptr<const SpecimenSurface>> SpecimenSurface::build(ShadingMesh mesh) {
  auto embree = std::make_unique<EmbreeScene>();
  // One thread: the tree, and with it which of two equally near triangles is found, is the same
  // in every run.
  embree->device = rtcNewDevice("threads=1");
  const auto failed = [&](const char* step) {
    return fail(ErrorKind::no_result, "simulated specimen",
                std::string("Embree can't ") + step + " (error " +
                    std::to_string(rtcGetDeviceError(embree->device)) + ")",
                "check the free memory");
  };
  if (!embree->device) return failed("start");

  const Eigen::Index vertex_count = mesh.vertices.rows();
  const Vector3d low = mesh.vertices.colwise().minCoeff();
  const Vector3d high = mesh.vertices.colwise().maxCoeff();
  const Vector3d centre = 0.5 * (low + high);
  double radius_mm = 0.0;

  RTCGeometry geometry = rtcNewGeometry(embree->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                              3 * sizeof(float), static_cast<std::size_t>(vertex_count)));
  auto* triangles = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t),
      static_cast<std::size_t>(mesh.triangles.rows())));
  if (!vertices || !triangles) {
    rtcReleaseGeometry(geometry);
    return failed("hold the mesh");
  }
  for (Eigen::Index v = 0; v < vertex_count; ++v) {
    const Vector3d x = mesh.vertices.row(v).transpose() - centre;
    radius_mm = std::max(radius_mm, x.norm());
    for (int axis = 0; axis < 3; ++axis) vertices[3 * v + axis] = static_cast<float>(x[axis]);
  }
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      triangles[3 * t + corner] = static_cast<std::uint32_t>(mesh.triangles(t, corner));
    }
  }
  rtcCommitGeometry(geometry);
  embree->scene = rtcNewScene(embree->device);
  // Watertight: no ray slips through between two triangles.
  rtcSetSceneFlags(embree->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(embree->scene, RTC_BUILD_QUALITY_MEDIUM);
  rtcAttachGeometry(embree->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(embree->scene);
  if (const RTCError error = rtcGetDeviceError(embree->device); error != RTC_ERROR_NONE) {
    return fail(ErrorKind::no_result, "simulated specimen",
                "Embree can't build its tree (error " + std::to_string(error) + ")",
                "check the free memory");
  }
  return std::shared_ptr<const SpecimenSurface>(
      new SpecimenSurface(std::move(mesh), std::move(embree), centre, 1.0001 * radius_mm + 0.01));
}

bool SpecimenSurface::clip(const SpecimenRay& ray, double& begin_mm, double& end_mm) const {
  const Vector3d origin = ray.origin - centre_;
  const double middle = -origin.dot(ray.direction);
  const double half_squared =
      radius_mm_ * radius_mm_ - (origin + middle * ray.direction).squaredNorm();
  if (half_squared <= 0.0) return false;
  const double half = std::sqrt(half_squared);
  begin_mm = std::max(0.0, middle - half);
  end_mm = std::min(ray.limit_mm, middle + half);
  return begin_mm < end_mm;
}

void SpecimenSurface::intersect(std::span<const SpecimenRay> rays,
                                std::span<SpecimenHit> hits) const {
  std::array<RTCRayHit, batch> queries;
  std::array<std::size_t, batch> owners;
  std::array<double, batch> begins_mm;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;

  const auto trace = [&](std::size_t count) {
    rtcIntersect1M(embree_->scene, &context, queries.data(), static_cast<unsigned>(count),
                   sizeof(RTCRayHit));
    for (std::size_t i = 0; i < count; ++i) {
      if (queries[i].hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
      const SpecimenRay& ray = rays[owners[i]];
      SpecimenHit& hit = hits[owners[i]];
      hit.triangle = static_cast<int>(queries[i].hit.primID);
      const Eigen::Vector3i corners = mesh_.triangles.row(hit.triangle);
      const Vector3d a = mesh_.vertices.row(corners[0]);
      const Vector3d ab = mesh_.vertices.row(corners[1]).transpose() - a;
      const Vector3d ac = mesh_.vertices.row(corners[2]).transpose() - a;
      // Moeller & Trumbore 1997.
      const Vector3d p = ray.direction.cross(ac);
      const double determinant = ab.dot(p);
      const Vector3d from_a = ray.origin - a;
      const Vector3d q = from_a.cross(ab);
      hit.distance_mm = ac.dot(q) / determinant;
      hit.b = std::clamp(from_a.dot(p) / determinant, 0.0, 1.0);
      hit.c = std::clamp(ray.direction.dot(q) / determinant, 0.0, 1.0 - hit.b);
      // A triangle seen edge-on has no such solution; Embree's is what there is.
      const double embree_mm = begins_mm[i] + static_cast<double>(queries[i].ray.tfar);
      if (!(std::abs(hit.distance_mm - embree_mm) < edge_on_mm)) {
        hit.distance_mm = embree_mm;
        hit.b = static_cast<double>(queries[i].hit.u);
        hit.c = static_cast<double>(queries[i].hit.v);
      }
    }
  };

  std::size_t count = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    hits[i] = {};
    double begin_mm = 0.0;
    double end_mm = 0.0;
    if (!clip(rays[i], begin_mm, end_mm)) continue;
    RTCRayHit& query = queries[count];
    fill(query.ray, rays[i].origin - centre_ + begin_mm * rays[i].direction, rays[i].direction,
         end_mm - begin_mm);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    owners[count] = i;
    begins_mm[count] = begin_mm;
    if (++count == batch) {
      trace(count);
      count = 0;
    }
  }
  if (count > 0) trace(count);
}

void SpecimenSurface::occluded(std::span<const SpecimenRay> rays,
                               std::span<std::uint8_t> blocked) const {
  std::array<RTCRay, batch> queries;
  std::array<std::size_t, batch> owners;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;

  const auto trace = [&](std::size_t count) {
    rtcOccluded1M(embree_->scene, &context, queries.data(), static_cast<unsigned>(count),
                  sizeof(RTCRay));
    for (std::size_t i = 0; i < count; ++i) {
      // Embree marks an occluded ray by tfar = -infinity.
      blocked[owners[i]] = queries[i].tfar < 0.0F ? 1 : 0;
    }
  };
  std::size_t count = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    blocked[i] = 0;
    double begin_mm = 0.0;
    double end_mm = 0.0;
    if (!clip(rays[i], begin_mm, end_mm)) continue;
    fill(queries[count], rays[i].origin - centre_ + begin_mm * rays[i].direction, rays[i].direction,
         end_mm - begin_mm);
    owners[count] = i;
    if (++count == batch) {
      trace(count);
      count = 0;
    }
  }
  if (count > 0) trace(count);
}

}  // namespace skullstation
