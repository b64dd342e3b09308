#include "render/integrator/manifold.h"

#include <limits>

#include "render/bsdf/bsdf_dielectric.h"

namespace drench::render {

namespace {

constexpr int max_steps = 5;
constexpr int max_contacts = 16;            // contact faces that a ray passes one after the other
constexpr float arrival_tolerance = 0.03f;  // of the lamp's extent: so near its point a walk ends
constexpr float same_path = 0.15f;  // of it: so near each other two paths arrive that are one
constexpr float max_step = 0.3f;    // rad
constexpr float max_focus = 2;      // times the light that would come straight: more is photons'
constexpr float smooth_cosine = 0.99995f;  // cosine between two unit normals that are one

/// Where a ray meets the interface and, bent there, the lamp's plane.
struct Arrival {
  Hit hit;
  Surface face;
  float distance = 0, beyond = 0;         // m, before the interface and after it; 1 to a sun
  float index = 1, cos = 0, cos_out = 0;  // of the body, in air; of both directions and the normal
  Packed normal{V3f(0)}, bent{V3f(0)};    // unit; the normal that bends, on the ray's side
  V2f miss;                               // from there to the lamp's point
  Packed slope[2] = {normal, normal};     // see RefractedPath
};

/// How a body's smooth normal changes along a triangle.
class SmoothNormal {
 public:
  SmoothNormal(const Corners& at, const Hit& hit)
      : ab_(at.position[1] - at.position[0]),
        ac_(at.position[2] - at.position[0]),
        nab_(at.normal[1] - at.normal[0]),
        nac_(at.normal[2] - at.normal[0]),
        unit_(at.normal[0] + nab_ * hit.u + nac_ * hit.v),
        flat_(cross(ab_, ac_)) {
    const float inverse = 1 / std::sqrt(dot(unit_, unit_));
    unit_ = unit_ * inverse;
    flat_ = flat_ * (inverse / dot(flat_, flat_));
  }

  const Packed& unit() const { return unit_; }
  /// Slope along the triangle of the normal's component in a direction across it.
  Packed slope(const Packed& across) const {
    return cross(ac_ * dot(nab_, across) - ab_ * dot(nac_, across), flat_);
  }

 private:
  Packed ab_, ac_, nab_, nac_, unit_, flat_;
};

class ManifoldWalk {
 public:
  ManifoldWalk(const Scene& scene, const Surface& surface, float time, Bodies in,
               const LampPoint& lamp, uint64_t& rays)
      : scene_(scene),
        surface_(surface),
        time_(time),
        in_(in),
        lamp_(lamp),
        at_(lamp.at),
        normal_(lamp.normal),
        axis_{Packed(Basis(lamp.normal).tangent), Packed(Basis(lamp.normal).bitangent)},
        rays_(rays) {}

  /// False where a ray does not get to the lamp's plane.
  bool shoot(const Packed& direction, Arrival& out) const {
    if (!meet_interface(direction.unpacked(), out)) return false;
    const Packed flat = Packed::load(out.face.geometric_normal);
    out.normal = interface_normal(direction, flat, Packed::load(out.face.shading_normal));
    out.index = scene_.medium(out.face.body).ior;
    out.cos = -dot(direction, out.normal);
    const float cos2_out = 1 - (1 - out.cos * out.cos) * out.index * out.index;
    if (!(cos2_out > 0)) return false;
    out.cos_out = std::sqrt(cos2_out);
    out.bent = direction * out.index + out.normal * (out.index * out.cos - out.cos_out);
    const float inverse = 1 / dot(out.bent, normal_);
    if (!(inverse < 0 && dot(out.bent, flat) > 0)) return false;
    const Packed to = lamp_.sun ? at_ : at_ - Packed::load(out.face.position);
    out.beyond = lamp_.sun ? 1 : dot(to, normal_) * inverse;
    if (!(out.beyond > 0)) return false;
    const Packed miss = to - out.bent * out.beyond;
    out.miss = {dot(miss, axis_[0]), dot(miss, axis_[1])};
    return differentiate(direction, flat, inverse, out);
  }

 private:
  /// From within one body straight into the air.
  bool meet_interface(const V3f& direction, Arrival& out) const {
    Ray ray{surface_.leave(direction), direction, time_};
    Bodies in = in_;
    out.distance = 0;
    for (int met = 0; met < max_contacts; ++met) {
      out.hit = scene_.intersect(ray, Coherence::incoherent);
      ++rays_;
      if (out.hit.kind != Hit::Kind::object) return false;
      out.face = scene_.surface(ray, out.hit);
      const Surface& face = out.face;
      if (!face.body || face.material->alpha > 0) return false;
      out.distance += out.hit.distance;
      in |= face.body;
      if (!face.contact) return in == face.body && dot(direction, face.geometric_normal) > 0;
      ray.origin = face.leave(direction);
    }
    return false;
  }

  /// Fills the slopes. False where the interface is bent by no smooth normal.
  /// @param inverse  1 over the cosine between bent ray and lamp's normal
  bool differentiate(const Packed& direction, const Packed& flat, float inverse,
                     Arrival& out) const {
    const SceneObject& object = scene_.object(out.hit.index);
    if (!object.sphere.empty()) return false;
    const SmoothNormal smooth(object.corners(out.hit.triangle, time_), out.hit);
    if (!(dot(smooth.unit(), out.normal) < -smooth_cosine)) return false;
    for (int k = 0; k < 2; ++k) {
      const Packed to_plane = axis_[k] - normal_ * (dot(axis_[k], out.bent) * inverse);
      out.slope[k] = slope_before(direction, flat, to_plane, smooth, out);
    }
    return true;
  }

  /// How a component of the point on the lamp's plane changes with the direction of the ray: taken
  /// from the lamp back to the interface, and from there to the surface.
  /// @param there  its change with the point in space, along bent rays none
  Packed slope_before(const Packed& direction, const Packed& flat, const Packed& there,
                      const SmoothNormal& smooth, const Arrival& at) const {
    const Packed &n = at.normal, bend = there * at.beyond;
    const float bending = at.index * at.cos - at.cos_out,
                with_cos = -at.index * bending / at.cos_out * dot(n, bend);
    const Packed with_normal = bend * bending - direction * with_cos;
    const Packed by_normal = smooth.slope(with_normal - n * dot(n, with_normal));
    const Packed with_point = (lamp_.sun ? Packed(V3f(0)) : there) - by_normal;
    const float along = dot(direction, with_point) / dot(direction, flat);
    return bend * at.index - n * with_cos + (with_point - flat * along) * at.distance;
  }

  const Scene& scene_;
  const Surface& surface_;
  float time_;
  Bodies in_;
  const LampPoint& lamp_;
  Packed at_, normal_, axis_[2];  // the lamp's; the axes are those of its plane
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
  return std::min(at.beyond, shape.intersect(at.face.position, at.bent.unpacked(), at.beyond));
}

}  // namespace

std::optional<RefractedPath> manifold_walk(const Scene& scene, const Surface& surface, float time,
                                           Bodies in, const LampPoint& lamp, uint64_t& rays) {
  const ManifoldWalk walk(scene, surface, time, in, lamp, rays);
  const V3f to_lamp = lamp.sun ? lamp.at : lamp.at - surface.position;
  const float distance2 = dot(to_lamp, to_lamp), arrived = arrival_tolerance * lamp.extent;
  const V3f to = to_lamp * (1 / std::sqrt(distance2));
  Packed direction(level_direction(to, scene.medium(in ? in : scene.fluid()).ior));
  Arrival at;
  for (int step = 0; step < max_steps; ++step) {
    if (!walk.shoot(direction, at)) return {};
    const Packed &a = at.slope[0], &b = at.slope[1];
    const float area = dot(direction, cross(a, b));
    if (at.miss.length2() < arrived * arrived) {
      const float density = 1 / std::abs(area);
      const float straight = lamp.sun ? 1 : -dot(to, lamp.normal) / distance2;
      const V3f &n = surface.geometric_normal, along = direction.unpacked();
      if (!(density < max_focus * straight && dot(along, n) * dot(to, n) > 0)) return {};
      const V3f absorbed = scene.medium(at.face.body).absorption * at.distance,
                bent = at.bent.unpacked();
      const V3f transmittance(std::exp(-absorbed.x), std::exp(-absorbed.y), std::exp(-absorbed.z));
      return RefractedPath{
          .direction = along,
          .transmittance =
              transmittance * (1 - fresnel_reflectance(at.cos, at.cos_out, 1 / at.index)),
          .density = density,
          .beyond = {at.face.leave(bent), bent, time},
          .distance = distance_to(scene.lights(), lamp, at),
          .slope = {a.unpacked(), b.unpacked()}};
    }
    Packed step_angle =
        (cross(b, direction) * at.miss.x + cross(direction, a) * at.miss.y) * (1 / area);
    const float angle2 = dot(step_angle, step_angle);
    if (!std::isfinite(angle2)) return {};
    if (angle2 > max_step * max_step) step_angle = step_angle * (max_step / std::sqrt(angle2));
    direction = normalized(direction + step_angle);
  }
  return {};
}

std::optional<ManifoldSample> sample_manifold(const Scene& scene, const Surface& surface,
                                              const Ray& ray, Bodies in, float u_light,
                                              const V2f& u, uint64_t& rays) {
  const LampPoint lamp = scene.lights().sample_lamp_point(surface.position, u_light, u);
  if (!(lamp.density > 0)) return {};
  const V3f to = lamp.sun ? lamp.at : lamp.at - surface.position;
  const V3f& n = surface.geometric_normal;
  if (dot(to, n) * dot(ray.direction, n) > 0)
    in &= ~scene.fluid();  // of a sheet's other side its contact says what is there
  else if (in == 0)
    return {};
  const std::optional<RefractedPath> path = manifold_walk(scene, surface, ray.time, in, lamp, rays);
  if (!path) return {};
  ++rays;
  const float open = scene.transmitted(path->beyond, {path->distance, int(lamp.lamp)});
  if (open == 0) return {};
  return ManifoldSample{
      path->direction, path->transmittance * lamp.radiance * (open * path->density / lamp.density)};
}

bool manifold_walk_finds(const Scene& scene, const Surface& surface, float time, Bodies in,
                         const LampPoint& lamp, const V3f& flight, uint64_t& rays) {
  if (!(lamp.density > 0)) return false;
  const std::optional<RefractedPath> path = manifold_walk(scene, surface, time, in, lamp, rays);
  if (!path) return false;
  const V3f& to = path->direction;
  const float along = -dot(flight, to);
  const V3f off = -flight - to * along;
  const V2f apart(dot(off, path->slope[0]), dot(off, path->slope[1]));
  return apart.length() < same_path * lamp.extent && along > 0;
}

}  // namespace drench::render
