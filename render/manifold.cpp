#include "render/manifold.h"

#include <limits>

#include "render/bsdf_dielectric.h"

namespace drench {

namespace {

constexpr int kMostSteps = 5;
constexpr int kMostMet = 16;        // contact faces that a ray passes one after the other
constexpr float kArrived = 0.03f;   // of the lamp's extent: so near its point a walk ends
constexpr float kSameWay = 0.15f;   // of it: so near each other two ways arrive that are one
constexpr float kLongStep = 0.3f;   // rad
constexpr float kMostFocus = 2;     // times the light that would come straight: more is photons'
constexpr float kIsSmooth = 1e-4f;  // square of how far two unit normals that are one may differ

/// Where a ray meets the interface and, bent there, the lamp's plane.
struct Arrival {
  Hit hit;
  Surface face;
  float way = 0, beyond = 0;  // m, before the interface and after it; 1 to a sun
  V3f normal, bent;           // unit; the normal that bends, on the ray's side
  float passes = 0;           // Fresnel's share
  V2f miss;                   // from there to the lamp's point
  V3f axis[2];
  V2f slope[2];  // see BentWay
};

/// A body's smooth normal at a point of a triangle, and how it changes along the triangle.
class SmoothNormal {
 public:
  SmoothNormal(const SceneObject& object, const Hit& hit, float time) {
    const auto& t = object.triangle[hit.triangle];
    const V3f a = object.at(t.x, time), na = object.normal_at(t.x, time);
    const V3f ab = object.at(t.y, time) - a, ac = object.at(t.z, time) - a, flat = cross(ab, ac);
    const V3f nab = object.normal_at(t.y, time) - na, nac = object.normal_at(t.z, time) - na;
    const V3f n = na + nab * hit.u + nac * hit.v;
    const float inverse = 1 / std::sqrt(dot(n, n)), scale = inverse / dot(flat, flat);
    unit_ = n * inverse;
    across_u_ = cross(ac, flat) * scale, across_v_ = cross(flat, ab) * scale;
    along_u_ = nab - unit_ * dot(nab, unit_), along_v_ = nac - unit_ * dot(nac, unit_);
  }

  const V3f& unit() const { return unit_; }
  /// @param way  in the triangle's plane
  V3f change(const V3f& way) const {
    return along_u_ * dot(way, across_u_) + along_v_ * dot(way, across_v_);
  }

 private:
  V3f unit_, across_u_, across_v_, along_u_, along_v_;
};

class Walk {
 public:
  Walk(const Scene& scene, const Surface& surface, float time, Bodies in, const LampPoint& lamp,
       uint64_t& rays)
      : scene_(scene),
        surface_(surface),
        time_(time),
        in_(in),
        lamp_(lamp),
        plane_(lamp.normal),
        rays_(rays) {}

  /// False where a ray does not get to the lamp's plane.
  bool shoot(const V3f& direction, Arrival& out) const {
    if (!meet_interface(direction, out)) return false;
    const V3f &flat = out.face.geometric_normal, &p = out.face.position;
    out.normal = interface_normal(direction, flat, out.face.shading_normal);
    const InterfaceSplit split = split_at_interface(direction, out.normal, eta(out));
    if (!(split.reflectance < 1 && dot(split.refracted, flat) > 0)) return false;
    out.bent = split.refracted;
    out.passes = 1 - split.reflectance;
    const float facing = dot(out.bent, lamp_.normal);
    if (!(facing < 0)) return false;
    out.beyond = lamp_.sun ? 1 : dot(lamp_.at - p, lamp_.normal) / facing;
    if (!(out.beyond > 0)) return false;
    out.miss = on_plane(lamp_.sun ? lamp_.at - out.bent : lamp_.at - p - out.bent * out.beyond);
    return differentiate(direction, out);
  }

 private:
  float eta(const Arrival& at) const { return 1 / scene_.medium(at.face.body).ior; }
  V2f on_plane(const V3f& v) const { return {dot(v, plane_.tangent), dot(v, plane_.bitangent)}; }

  /// From within one body straight into the air.
  bool meet_interface(const V3f& direction, Arrival& out) const {
    Ray ray{surface_.leave(direction), direction, time_};
    Bodies in = in_;
    out.way = 0;
    for (int met = 0; met < kMostMet; ++met) {
      out.hit = scene_.intersect(ray, Coherence::incoherent);
      ++rays_;
      if (out.hit.kind != Hit::Kind::object) return false;
      out.face = scene_.surface<true>(ray, out.hit);
      const Surface& face = out.face;
      if (!face.body || face.material->alpha > 0) return false;
      out.way += out.hit.distance;
      in |= face.body;
      if (!face.contact) return in == face.body && dot(direction, face.geometric_normal) > 0;
      ray.origin = face.leave(direction);
    }
    return false;
  }

  /// Fills the slopes. False where the interface is bent by no smooth normal.
  bool differentiate(const V3f& direction, Arrival& out) const {
    const SceneObject& object = scene_.object(out.hit.index);
    if (!object.sphere.empty()) return false;
    const SmoothNormal smooth(object, out.hit, time_);
    const V3f &n = out.normal, &flat = out.face.geometric_normal;
    const float side = dot(smooth.unit(), n) < 0 ? -1.f : 1.f;
    const V3f off = smooth.unit() * side - n;
    if (!(dot(off, off) < kIsSmooth)) return false;
    const float mu = 1 / eta(out), cos = -dot(direction, n), cos_out = -dot(out.bent, n);
    if (!(cos_out > 0)) return false;
    const Basis across(direction);
    out.axis[0] = across.tangent, out.axis[1] = across.bitangent;
    const float inverse = 1 / dot(direction, flat), inverse_out = 1 / cos_out,
                inverse_lamp = 1 / dot(out.bent, lamp_.normal);
    for (int k = 0; k < 2; ++k) {
      const V3f& d = out.axis[k];
      const V3f way = (d - direction * (dot(d, flat) * inverse)) * out.way;
      const V3f turn = smooth.change(way) * side;
      const float d_cos = -dot(d, n) - dot(direction, turn),
                  d_out = mu * mu * cos * d_cos * inverse_out;
      const V3f bend = d * mu + turn * (mu * cos - cos_out) + n * (mu * d_cos - d_out);
      const V3f moved = lamp_.sun ? bend : way + bend * out.beyond;
      out.slope[k] = on_plane(moved - out.bent * (dot(moved, lamp_.normal) * inverse_lamp));
    }
    return true;
  }

  const Scene& scene_;
  const Surface& surface_;
  float time_;
  Bodies in_;
  const LampPoint& lamp_;
  Basis plane_;
  uint64_t& rays_;
};

/// Where level water would show the lamp. @param to  unit, straight to it
V3f level_direction(const V3f& to, float index) {
  if (!(to.y > 0)) return to;
  const float x = to.x / index, z = to.z / index;
  return {x, std::sqrt(1 - x * x - z * z), z};
}

/// Of balls to the near side, not to the disc that was aimed at.
float distance_to(const Lights& lights, const LampPoint& lamp, const Arrival& at) {
  if (lamp.sun) return std::numeric_limits<float>::infinity();
  const ShapeLight& shape = lights.shapes()[lamp.lamp];
  return std::min(at.beyond, shape.intersect(at.face.position, at.bent, at.beyond));
}

}  // namespace

std::optional<BentWay> walk_to_lamp(const Scene& scene, const Surface& surface, float time,
                                    Bodies in, const LampPoint& lamp, uint64_t& rays) {
  const Walk walk(scene, surface, time, in, lamp, rays);
  const V3f way = lamp.sun ? lamp.at : lamp.at - surface.position;
  const float distance2 = dot(way, way);
  const V3f to = way * (1 / std::sqrt(distance2));
  V3f direction = level_direction(to, scene.medium(in ? in : scene.fluid()).ior);
  Arrival at;
  for (int step = 0; step < kMostSteps; ++step) {
    if (!walk.shoot(direction, at)) return {};
    const V2f &a = at.slope[0], &b = at.slope[1], &miss = at.miss;
    const float area = a.x * b.y - a.y * b.x;
    if (miss.length() < kArrived * lamp.extent) {
      const float density = 1 / std::abs(area);
      const float straight = lamp.sun ? 1 : -dot(to, lamp.normal) / distance2;
      const V3f& n = surface.geometric_normal;
      if (!(density < kMostFocus * straight && dot(direction, n) * dot(to, n) > 0)) return {};
      const V3f absorbed = scene.medium(at.face.body).absorption * at.way;
      return BentWay{
          direction,
          V3f(std::exp(-absorbed.x), std::exp(-absorbed.y), std::exp(-absorbed.z)) * at.passes,
          density,
          {at.face.leave(at.bent), at.bent, time},
          distance_to(scene.lights(), lamp, at),
          {at.axis[0], at.axis[1]},
          {a, b}};
    }
    V2f turn((miss.x * b.y - miss.y * b.x) / area, (a.x * miss.y - a.y * miss.x) / area);
    const float angle = turn.length();
    if (!std::isfinite(angle)) return {};
    if (angle > kLongStep) turn *= kLongStep / angle;
    direction = normalized(direction + at.axis[0] * turn.x + at.axis[1] * turn.y);
  }
  return {};
}

std::optional<WalkedLight> walk_to_lamps(const Scene& scene, const Surface& surface, const Ray& ray,
                                         Bodies in, float u_light, const V2f& u, uint64_t& rays) {
  const LampPoint lamp = scene.lights().sample_lamp_point(surface.position, u_light, u);
  if (!(lamp.density > 0)) return {};
  const V3f to = lamp.sun ? lamp.at : lamp.at - surface.position;
  const V3f& n = surface.geometric_normal;
  if (dot(to, n) * dot(ray.direction, n) > 0)
    in &= ~scene.fluid();  // of a sheet's other side its contact says what is there
  else if (in == 0)
    return {};
  const std::optional<BentWay> way = walk_to_lamp(scene, surface, ray.time, in, lamp, rays);
  if (!way) return {};
  ++rays;
  const float open = scene.transmitted(way->beyond, way->distance);
  if (open == 0) return {};
  return WalkedLight{way->direction,
                     way->share * lamp.radiance * (open * way->density / lamp.density)};
}

bool walk_finds(const Scene& scene, const Surface& surface, float time, Bodies in,
                const LampPoint& lamp, const V3f& flight, uint64_t& rays) {
  if (!(lamp.density > 0)) return false;
  const std::optional<BentWay> way = walk_to_lamp(scene, surface, time, in, lamp, rays);
  if (!way) return false;
  const V3f off = -flight - way->direction;
  const V2f apart = way->slope[0] * dot(off, way->axis[0]) + way->slope[1] * dot(off, way->axis[1]);
  return apart.length() < kSameWay * lamp.extent && dot(flight, way->direction) < 0;
}

}  // namespace drench
