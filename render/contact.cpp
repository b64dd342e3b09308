#include "render/contact.h"

#include <Imath/ImathBox.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/triangle.h"

namespace drench {

using Imath::V3f;

namespace {

struct Nearest {
  const TriangleMesh* mesh;
  V3f point, found, normal;
  float distance2;
};

bool meet(RTCPointQueryFunctionArguments* arguments) {
  Nearest& nearest = *static_cast<Nearest*>(arguments->userPtr);
  const auto& t = nearest.mesh->triangle[arguments->primID];
  const V3f &a = nearest.mesh->position[t.x], &b = nearest.mesh->position[t.y],
            &c = nearest.mesh->position[t.z];
  const V3f at = closest_on_triangle(nearest.point, a, b, c);
  const float distance2 = (at - nearest.point).length2();
  // Of triangles that share the nearest point, the one that faces it most says on which side it is.
  const V3f normal = (b - a).cross(c - a).normalized();
  const float facing = std::abs(normal.dot(nearest.point - at)),
              before = std::abs(nearest.normal.dot(nearest.point - nearest.found));
  const float tie = 1e-6f * nearest.distance2;
  if (distance2 > nearest.distance2 + tie) return false;
  if (distance2 > nearest.distance2 - tie && facing <= before) return false;
  nearest.found = at, nearest.normal = normal, nearest.distance2 = distance2;
  arguments->query->radius = std::sqrt(distance2) * (1 + 1e-5f);
  return true;
}

EmbreeScene scene_of(RTCDevice device, const TriangleMesh& mesh, std::vector<V3f>& position) {
  position = mesh.position;
  position.push_back(V3f(0));  // Embree reads past the end
  EmbreeGeometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             position.data(), 0, sizeof(V3f), mesh.position.size());
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             mesh.triangle.data(), 0, 3 * sizeof(uint32_t), mesh.triangle.size());
  rtcSetGeometryPointQueryFunction(geometry.get(), meet);
  rtcCommitGeometry(geometry.get());
  EmbreeScene scene(rtcNewScene(device));
  rtcAttachGeometry(scene.get(), geometry.get());
  rtcCommitScene(scene.get());
  return scene;
}

V3f pressed(RTCScene scene, const TriangleMesh& mesh, const V3f& point, float spacing) {
  const float reach = 0.6f * spacing;
  Nearest nearest{&mesh, point, V3f(0), V3f(0), 4 * spacing * spacing};
  RTCPointQuery query{point.x, point.y, point.z, 0, 2 * spacing};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene, &query, &context, nullptr, &nearest);
  if (nearest.normal == V3f(0)) return point;
  const V3f away = point - nearest.found;
  const float side = away.dot(nearest.normal) < 0 ? -1.f : 1.f, length = away.length();
  const float distance = side * length;
  if (distance >= reach) return point;
  const V3f outward = length > 1e-3f * spacing ? away * (side / length) : nearest.normal;
  return point - outward * (0.75f * spacing * (1 - std::max(distance, 0.f) / reach));
}

}  // namespace

TriangleMesh pressed_onto_obstacles(RTCDevice device, const TriangleMesh& fluid,
                                    const std::vector<ObstacleFrame>& obstacles, float spacing) {
  TriangleMesh mesh = fluid;
  for (const ObstacleFrame& obstacle : obstacles) {
    Imath::Box3f bounds;
    for (const V3f& p : obstacle.mesh.position) bounds.extendBy(p);
    bounds.min -= V3f(spacing), bounds.max += V3f(spacing);
    std::vector<V3f> position;
    const EmbreeScene scene = scene_of(device, obstacle.mesh, position);
    tbb::parallel_for(size_t(0), mesh.position.size(), [&](size_t k) {
      V3f& p = mesh.position[k];
      if (bounds.intersects(p)) p = pressed(scene.get(), obstacle.mesh, p, spacing);
    });
  }
  return mesh;
}

}  // namespace drench
