#include "reconstruction/rendering/ray_scene.h"

#include <embree3/rtcore.h>

#include <cstdint>
#include <limits>
#include <new>

namespace skullstation {

struct RayScene::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~Embree() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

namespace {

/// What can go wrong inside Embree here is want of memory.
void expect_memory(RTCDevice device) {
  if (rtcGetDeviceError(device) != RTC_ERROR_NONE) throw std::bad_alloc();
}

void attach(RTCDevice device, RTCScene scene, unsigned id, const TriangleMesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                              3 * sizeof(float), static_cast<std::size_t>(mesh.vertices.rows())));
  auto* triangles = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t),
      static_cast<std::size_t>(mesh.triangles.rows())));
  if (vertices && triangles) {
    for (Eigen::Index i = 0; i < mesh.vertices.size(); ++i) {
      vertices[i] = static_cast<float>(mesh.vertices.data()[i]);
    }
    for (Eigen::Index i = 0; i < mesh.triangles.size(); ++i) {
      triangles[i] = static_cast<std::uint32_t>(mesh.triangles.data()[i]);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
  }
  rtcReleaseGeometry(geometry);
  expect_memory(device);
}

RTCRay ray_along(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double nearest,
                 double farthest) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tnear = static_cast<float>(nearest);
  ray.tfar = static_cast<float>(farthest);
  ray.mask = ~0U;
  return ray;
}

}  // namespace

RayScene::RayScene(std::span<const TriangleMesh* const> meshes)
    : embree_(std::make_unique<Embree>()) {
  // Embree's own threads are left out: what it builds shall not depend on them.
  embree_->device = rtcNewDevice("threads=1");
  if (!embree_->device) throw std::bad_alloc();
  embree_->scene = rtcNewScene(embree_->device);
  expect_memory(embree_->device);
  rtcSetSceneFlags(embree_->scene, RTC_SCENE_FLAG_ROBUST);
  unsigned id = 0;
  for (const TriangleMesh* mesh : meshes) attach(embree_->device, embree_->scene, id++, *mesh);
  rtcCommitScene(embree_->scene);
  expect_memory(embree_->device);
}

RayScene::~RayScene() = default;

std::optional<RayHit> RayScene::first_hit(const Eigen::Vector3d& origin,
                                          const Eigen::Vector3d& direction,
                                          double nearest_mm) const {
  RTCRayHit query{};
  query.ray = ray_along(origin, direction, nearest_mm, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(embree_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return RayHit{query.ray.tfar, static_cast<int>(query.hit.geomID),
                static_cast<int>(query.hit.primID), query.hit.u, query.hit.v};
}

bool RayScene::blocked(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                       double farthest_mm) const {
  RTCRay ray = ray_along(origin, direction, 0.0, farthest_mm);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(embree_->scene, &context, &ray);
  return ray.tfar < 0.0F;
}

}  // namespace skullstation
