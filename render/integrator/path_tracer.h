#pragma once
// A path: one camera sample, traced ray by ray. For path.cpp, which has several in flight.
//
// Radiance inside water is carried divided by the squared index (basic radiance), which stays
// constant through interfaces. So lights inside water are given as basic radiance, and a camera
// under water sees what one behind a flat glass port sees.

#include <algorithm>
#include <optional>
#include <type_traits>

#include "render/bsdf/bsdf_cloth.h"
#include "render/bsdf/bsdf_coated.h"
#include "render/bsdf/bsdf_dielectric.h"
#include "render/bsdf/bsdf_metal.h"
#include "render/bsdf/bsdf_rough.h"
#include "render/integrator/manifold.h"
#include "render/integrator/path_film.h"
#include "render/integrator/refracted_light_guide.h"
#include "render/scene/fabric.h"

namespace drench::render {

template <unsigned features>
class PathTracer {
  static constexpr bool has_motion = features & Feature::motion_blur;
  static constexpr bool has_water = features & Feature::dielectric;
  static constexpr bool has_sampled_lights = features & Feature::sampled_lights;
  static constexpr bool has_facets = features & Feature::glossy;
  static constexpr bool has_plate = features & Feature::mattes;
  static constexpr CameraMotion motion = has_motion ? CameraMotion::moving : CameraMotion::still;
  static constexpr Lens lens = features & Feature::thin_lens ? Lens::thin : Lens::pinhole;

 public:
  PathTracer(const Scene& scene, const PathSettings& settings, const CameraSample& sample)
      : scene_(scene), settings_(settings), sampler_(sample.sampler), film_(sample.record) {
    const V2f& at = sample.film;
    const float time = has_motion ? scene_.camera().time(sampler_.one(time_dimension), at) : 0.f;
    const V2f on_lens = lens == Lens::thin ? sampler_.two(lens_dimension) : V2f(0);
    state_.ray = scene_.camera().template ray<motion, lens>(at, on_lens, time);
    state_.vertex = state_.ray.origin;
    if (has_water) state_.in = settings_.camera_in;
    if constexpr (has_plate) {
      state_.clear = true;
      film_.plate.view = state_.ray.direction;
    }
    going_ = finite(state_.ray.direction + state_.ray.origin);
  }

  bool going() const { return going_; }
  PathSample sample() const { return film_.sample(); }
  uint64_t rays() const { return rays_; }

  /// Traces the next ray, and then asks for what it met: others are traced meanwhile.
  void find() {
    const Coherence coherence = state_.vertices == 0 ? Coherence::coherent : Coherence::incoherent;
    // Constructed in place: a copy of what is just being written would wait for it.
    new (&hit_) Hit(scene_.intersect(state_.ray, coherence, film_.world()));
    ++rays_;
    scene_.prefetch_triangle(hit_);
  }
  void fetch() const { scene_.prefetch_vertices(hit_); }

  /// Goes on from there.
  void shade() {
    going_ = rays_ < max_rays && meet(state_, hit_);
    ++state_.vertices;
    while (!(going_ &= finite(state_.ray.direction + state_.ray.origin)))
      if (!(going_ = begin_next())) return;
  }

 private:
  bool meet(PathState& state, const Hit& hit) {
    if (hit.kind == Hit::Kind::nothing || hit.kind == Hit::Kind::light) {
      if constexpr (has_water)
        if (hit.kind == Hit::Kind::light) absorb(state, hit.distance);
      add_emission(state, hit);
      return false;
    }
    const Surface surface = scene_.surface(state.ray, hit);
    if (has_water && surface.contact && !enters_by_gap(state, surface)) {
      pass_contact(state, surface, hit.distance);
      return true;
    }
    if (has_facets && surface.material->gap > 0 && meets_gap(state, surface))
      return pass_gap(state, surface, hit);
    return scatter(state, surface, hit) && survives(state);
  }

  /// What is left to trace of the sample: the mirrored branch, or from the catcher on by the same
  /// numbers, in the plate's world.
  bool begin_next() {
    if constexpr (has_water)
      if (mirrored_) {
        state_ = *mirrored_;
        mirrored_.reset();
        film_.begin_branch();
        return true;
      }
    if constexpr (has_plate)
      if (film_.plate.caught && film_.plate.world == World::whole) {
        film_.plate.world = World::plate;
        state_ = film_.plate.start;
        if (!scatter_surface(state_, film_.plate.surface, film_.plate.hit)) return false;
        if (!survives(state_)) return false;
        ++state_.vertices;
        return true;
      }
    return false;
  }

  bool scatter(PathState& state, const Surface& surface, const Hit& hit) {
    if constexpr (has_water) {
      // The side that was hit says for certain where the path goes on from. It led through the body
      // only if the path had come in, too: a film that the shutter turns inside out is met from
      // within by rays from far away.
      const bool outwards = dot(state.ray.direction, surface.geometric_normal) > 0;
      if (!outwards) state.in &= ~surface.body;
      absorb(state, hit.distance);
      if (outwards) state.in |= surface.body;
    }
    if constexpr (has_plate)
      if (film_.sees_plate(state)) {
        const Matte matte = scene_.matte(hit);
        if (matte == Matte::holdout) return film_.show_plate(state);
        if (matte == Matte::shadow_catcher && film_.records())
          film_.start_catching(state, surface, hit, scene_.plate_bodies());
      }
    if constexpr (has_water) {
      if (surface.body) {
        if (inside_higher_body(state, surface)) return true;
        film_.record_first(state, surface, hit);
        return scatter_interface(state, surface);
      }
    }
    if constexpr (has_plate) state.clear = false;
    film_.record_first(state, surface, hit);
    return scatter_surface(state, surface, hit);
  }

  bool scatter_surface(PathState& state, const Surface& surface, const Hit& hit) {
    if constexpr (has_sampled_lights)
      if (surface.light >= 0) add_own_light(state, surface, hit.distance);
    if constexpr (has_facets) {
      if (surface.material->type == MaterialType::metal) return scatter_metal(state, surface);
      if (surface.material->type == MaterialType::coated) return scatter_coated(state, surface);
      if (surface.material->type == MaterialType::cloth) {
        const float wetness = scene_.wetness(hit);
        if (surface.material->is_fabric() || wetness > 0)
          return scatter_fabric(state, surface, hit, wetness);
      }
    }
    return scatter_cloth(state, surface);
  }

  /// Goes on through a surface that divides nothing, because a body of higher priority is there.
  bool inside_higher_body(PathState& state, const Surface& surface) {
    const Bodies beyond = state.in ^ surface.body;
    if (&scene_.medium(state.in) != &scene_.medium(beyond)) return false;
    state.in = beyond;
    pass(state, surface);
    return true;
  }

  /// Between water and the sheet it lies on; what little is between counts as water.
  void pass_contact(PathState& state, const Surface& surface, float distance) {
    if (dot(state.ray.direction, surface.geometric_normal) > 0) absorb(state, distance);
    state.in |= surface.body;
    pass(state, surface);
  }

  bool meets_gap(PathState& state, const Surface& surface) const {
    const uint32_t dimension = first_gap_dimension + state.branch * branch_stride + state.sheets++;
    return sampler_.one(dimension) < surface.material->gap;
  }

  /// Whether water that lies on a sheet is met through a gap: there it has a surface.
  static bool enters_by_gap(PathState& state, const Surface& surface) {
    if (!has_facets || !state.dry_gap) return false;
    if (!(dot(state.ray.direction, surface.geometric_normal) < 0)) return false;
    state.has_photons = false;  // no photon goes there
    return true;
  }

  /// Straight on between yarns. Light samples come through there, so that the vertex and the
  /// density of the direction stay. Where water ends at the sheet it has its surface in the gap.
  bool pass_gap(PathState& state, const Surface& surface, const Hit& hit) {
    const V3f& d = state.ray.direction;
    if constexpr (has_water) {
      absorb(state, hit.distance);
      const bool in_fluid = scene_.in_fluid(state.in);
      if (in_fluid && !scene_.fluid_beyond({surface.leave(d), d, state.ray.time})) {
        Surface film = surface;
        film.body = scene_.fluid();
        film.material = &scene_.fluid_material();
        if (dot(d, film.geometric_normal) < 0) {
          film.geometric_normal = -film.geometric_normal;
          film.shading_normal = -film.shading_normal;
        }
        state.has_photons = false;
        return scatter_interface(state, film) && survives(state);
      }
      state.dry_gap = !in_fluid;
    }
    state.before += hit.distance;
    state.ray.origin = surface.leave(d);
    --state.vertices;
    return true;
  }

  /// From the vertex that a light would be sampled at.
  static float flown(const PathState& state, float distance) {
    return has_facets ? state.before + distance : distance;
  }

  /// Straight on through what is no vertex: no light sample does, so light beyond counts whole.
  void pass(PathState& state, const Surface& surface) {
    state.bsdf_pdf = 0;
    state.ray.origin = surface.leave(state.ray.direction);
    --state.vertices;
  }

  void absorb(PathState& state, float distance) {
    const V3f& a = scene_.medium(state.in).absorption;
    if (is_black(a)) return;
    const V3f kept(std::exp(-a.x * distance), std::exp(-a.y * distance), std::exp(-a.z * distance));
    state.throughput *= kept;
    state.survival *= kept;
  }

  /// Weight of light found by a surface sample that light sampling finds with `light_pdf`.
  float emission_weight(const PathState& state, float light_pdf) const {
    if (state.bsdf_pdf == 0 || light_pdf == 0) return 1;
    switch (settings_.estimator) {
      case Estimator::mis:
        return power_heuristic(state.bsdf_pdf, light_pdf);
      case Estimator::light_only:
        return 0;
      case Estimator::bsdf_only:
        return 1;
    }
    return 1;
  }

  /// Whether photons bring what lamps send along this path.
  bool left_to_photons(const PathState& state) const {
    return has_water && state.has_photons && state.interfaces > 0;
  }

  void add_emission(const PathState& state, const Hit& hit) {
    const Lights& lights = scene_.lights();
    const V3f& direction = state.ray.direction;
    if constexpr (has_plate)
      if (settings_.background == Background::clear && hit.kind == Hit::Kind::nothing &&
          film_.sees_plate(state)) {
        film_.show_plate(state);
        return;
      }
    // What mirrors show of the sky and of lamps counts as white, the sky itself as black.
    if (state.vertices > 0 || hit.kind == Hit::Kind::light) film_.record_albedo(state.survival);
    if (hit.kind == Hit::Kind::light) {
      if (left_to_photons(state)) return;
      const float pdf = has_sampled_lights && state.bsdf_pdf > 0
                            ? lights.shape_pdf(int(hit.index), state.vertex, direction,
                                               flown(state, hit.distance))
                            : 0.f;
      film_.deposit(
          state.throughput * lights.shape_radiance(int(hit.index)) * emission_weight(state, pdf),
          lights.shape_group(hit.index));
    } else {
      if (state.vertices == 0 && !lights.has_environment()) film_.show_nothing();
      lights.for_each_infinite(
          state.vertex, direction, state.bsdf_pdf,
          left_to_photons(state) ? Lights::Suns::hidden : Lights::Suns::seen,
          [&](const V3f& radiance, float pdf, uint32_t group) {
            film_.deposit(state.throughput * radiance * emission_weight(state, pdf), group);
          });
    }
  }

  /// Light of a surface's own, from its outer side.
  void add_own_light(const PathState& state, const Surface& surface, float distance) {
    const float facing = -dot(state.ray.direction, surface.geometric_normal);
    if (!(facing > 0)) return;
    const Lights& lights = scene_.lights();
    const float pdf = state.bsdf_pdf > 0
                          ? lights.mesh_pdf(surface.light, surface.triangle, state.vertex,
                                            state.ray.time, flown(state, distance), facing)
                          : 0.f;
    film_.deposit(state.throughput * surface.material->emission * emission_weight(state, pdf),
                  lights.mesh_group(surface.light));
  }

  /// Whether lights are sampled from a point in these bodies: light from outside reaches it only
  /// by refraction, which surface samples find.
  bool samples_lights(Bodies in) const {
    return has_sampled_lights && !(has_water && in && !scene_.lights_in_bodies());
  }

  /// Continues the path along `direction` from the surface.
  void depart(PathState& state, const Surface& surface, const V3f& direction) {
    state.vertex = surface.position;
    surface.send(state.ray, direction);
    state.before = 0;
    state.dry_gap = false;
  }

  bool scatter_interface(PathState& state, const Surface& surface) {
    const V3f d = state.ray.direction;
    if constexpr (has_plate)
      state.clear &= settings_.refraction_alpha == RefractionAlpha::transparent;
    const float eta = scene_.medium(state.in ^ surface.body).ior / scene_.medium(state.in).ior;
    if constexpr (has_facets)
      if (surface.material->alpha > 0) {
        state.has_photons = state.clear = false;  // photons pass smooth bodies only
        const AlbedoTable* albedo = scene_.interface_albedo(surface, state.in);
        if (albedo) return scatter_rough(state, surface, eta, *albedo);
      }
    const V3f flat = state.in & surface.body ? -surface.geometric_normal : surface.geometric_normal;
    InterfaceSplit split = split_at_interface(
        d, interface_normal(d, surface.geometric_normal, surface.shading_normal), eta);
    if (split.reflectance < 1 && !(dot(split.refracted, flat) < 0))
      split = split_at_interface(d, flat, eta);
    state.bsdf_pdf = 0;
    ++state.interfaces;
    // Only mirrors that are within a body which the path has entered.
    const bool clear_mirror =
        has_plate && state.clear && (state.in & ~settings_.camera_in & surface.body) != 0;
    bool reflect = split.reflectance >= 1;
    if (!reflect && settings_.first_interface == FirstInterface::both && state.vertices == 0) {
      const float follow = std::min(split.reflectance / small_branch, 1.f);
      if (follow == 1 || number(state, roulette) < follow) {
        mirrored_ = state;
        mirrored_->throughput *= split.reflectance / follow;
        mirrored_->survival *= split.reflectance / follow;
        mirrored_->branch = 1;
        mirrored_->clear = clear_mirror;
        ++mirrored_->vertices;
        depart(*mirrored_, surface, split.reflected);
      }
      state.throughput *= 1 - split.reflectance;
      state.survival *= 1 - split.reflectance;
    } else if (!reflect) {
      reflect = number(state, scatter_side) < split.reflectance;
    }
    depart(state, surface, reflect ? split.reflected : split.refracted);
    if (reflect) state.clear = clear_mirror;
    if (!reflect) state.in ^= surface.body;
    return true;
  }

  bool scatter_rough(PathState& state, const Surface& surface, float eta,
                     const AlbedoTable& albedo) {
    const RoughBsdf bsdf(-state.ray.direction, surface.geometric_normal, surface.shading_normal,
                         surface.material->alpha, eta, albedo);
    const Bodies beyond = state.in ^ surface.body;
    film_.record_albedo(state.survival);
    const VertexNumbers u = numbers(state);
    add_direct(state, surface, beyond, u, bsdf);
    const Scatter next = bsdf.sample(u[scatter_direction], u[scatter_side].x);
    return follow(state, surface, next, bsdf.through(next.direction) ? beyond : state.in);
  }

  bool scatter_metal(PathState& state, const Surface& surface) {
    const ShadingMaterial& material = *surface.material;
    const MetalBsdf bsdf(-state.ray.direction, surface.geometric_normal, surface.shading_normal,
                         material.alpha,
                         MetalFresnel(material.reflectance_at(surface.uv), material.edge),
                         *material.albedo_outside[0]);
    state.has_photons = false;
    const VertexNumbers u = numbers(state);
    add_direct(state, surface, state.in, u, bsdf);
    state.survival *= bsdf.albedo();
    if (material.alpha > 0) film_.record_albedo(state.survival);  // else it shows other things
    return follow(state, surface, bsdf.sample(u[scatter_direction]), state.in);
  }

  /// One lobe is followed; lights are sampled for both, and photons gathered by the diffuse one.
  bool scatter_coated(PathState& state, const Surface& surface) {
    if (++state.diffuse > settings_.depth) return false;
    const ShadingMaterial& material = *surface.material;
    const auto [side, normal] = surface.normals(-state.ray.direction);
    const CoatedBsdf bsdf(-state.ray.direction, side, normal, material.alpha,
                          material.ior / scene_.medium(state.in).ior,
                          material.reflectance_at(surface.uv),
                          scene_.coat_albedo(material, state.in));
    const CoatLobe coat = bsdf.coat();
    const CoatedBase base = bsdf.base();
    const bool photons = gathers_photons(surface);
    const VertexNumbers u = numbers(state);
    if (photons) add_caustics(state, surface, u, base);
    add_direct(state, surface, state.in, u, coat, base);
    const bool follow_coat = u[scatter_side].x < bsdf.coat_probability();
    state.interfaces = 0;
    state.has_photons = photons && !follow_coat;
    state.survival *= bsdf.albedo();
    film_.record_albedo(state.survival);
    const V2f& to = u[scatter_direction];
    return follow(state, surface, follow_coat ? coat.sample(to) : base.sample(to), state.in);
  }

  /// Continues along a direction drawn from a surface, in the bodies that are there.
  bool follow(PathState& state, const Surface& surface, const Scatter& next, Bodies in) {
    if (!(next.pdf > 0)) return false;
    state.in = in;
    depart(state, surface, next.direction);
    state.throughput *= next.weight;
    state.bsdf_pdf = samples_lights(in) && std::isfinite(next.pdf) ? next.pdf : 0;
    return true;
  }

  bool scatter_cloth(PathState& state, const Surface& surface) {
    if (++state.diffuse > settings_.depth) return false;
    const ShadingMaterial& material = *surface.material;
    const ClothBsdf bsdf(-state.ray.direction, surface.geometric_normal, surface.shading_normal,
                         material.reflectance_at(surface.uv), material.transmittance,
                         surface.lifts() ? ClothBsdf::Sides::smooth : ClothBsdf::Sides::real);
    film_.record_albedo(state.survival * bsdf.albedo());
    if (bsdf.black()) return false;
    state.interfaces = 0;
    state.has_photons = gathers_photons(surface);
    const VertexNumbers u = numbers(state);
    if (state.has_photons) add_caustics(state, surface, u, bsdf);
    const Scatter next = sample_scatter(state, surface, u, bsdf);  // while the light is drawn
    add_direct(state, surface, state.in, u, bsdf);
    state.survival *= bsdf.albedo();
    return follow_from_sheet(state, surface, next);
  }

  /// As coats: one lobe is followed, lights are sampled for both, photons gathered by the soft one.
  bool scatter_fabric(PathState& state, const Surface& surface, const Hit& hit, float wetness) {
    if (++state.diffuse > settings_.depth) return false;
    const auto [side, normal] = surface.normals(-state.ray.direction);
    const FabricBsdf bsdf(-state.ray.direction, side, normal,
                          fabric_at(scene_, surface, hit, state.ray.time, wetness, state.in));
    film_.record_albedo(state.survival * bsdf.albedo());
    const bool photons = gathers_photons(surface);
    const VertexNumbers u = numbers(state);
    if (photons) add_caustics(state, surface, u, bsdf.soft());
    add_direct(state, surface, state.in, u, bsdf.soft(), bsdf.glints());
    const bool glint = u[scatter_side].x < bsdf.glint_probability();
    state.interfaces = 0;
    state.has_photons = photons && !glint;
    state.survival *= bsdf.albedo();
    const V2f& to = u[scatter_direction];
    return follow_from_sheet(state, surface,
                             glint ? bsdf.glints().sample(to) : bsdf.soft().sample(to));
  }

  /// Continues on either side of a sheet.
  bool follow_from_sheet(PathState& state, const Surface& surface, const Scatter& next) {
    if (!(next.pdf > 0)) return false;
    const bool sample_lights = samples_lights(state.in);
    // What goes through a sheet leaves the water on this side; contact on the other says if it
    // enters some there.
    if constexpr (has_water)
      if (!surface.passes_over(next.direction) &&
          dot(next.direction, surface.geometric_normal) *
                  dot(state.ray.direction, surface.geometric_normal) >
              0)
        state.in &= ~scene_.fluid();
    depart(state, surface, next.direction);
    state.throughput *= next.weight;
    state.bsdf_pdf = sample_lights ? next.pdf : 0;
    return true;
  }

  /// The next direction: drawn from the surface, or in water from a mixture with the guide. Its
  /// density is the surface's own in either case: light samples are weighed against that one.
  Scatter sample_scatter(const PathState& state, const Surface& surface, const VertexNumbers& u,
                         const ClothBsdf& bsdf) const {
    const V2f& uv = u[scatter_direction];
    if constexpr (!has_water) return bsdf.sample(uv);
    if (state.in != scene_.fluid() || state.in == 0 ||
        (state.has_photons && scene_.lights().meshes().empty()) ||
        settings_.water_guide == WaterGuide::off)
      return bsdf.sample(uv);
    using Aim = RefractedLightGuide::Aim;
    const RefractedLightGuide guide(scene_.lights(), scene_.medium(state.in).ior,
                                    state.has_photons ? Aim::meshes : Aim::all);
    const float probability = guide.probability(surface.position);
    if (probability == 0) return bsdf.sample(uv);
    return sample_mixed(bsdf, guide, probability, surface.position, u[scatter_side].x, uv);
  }

  bool gathers_photons(const Surface& surface) const {
    return has_water && settings_.photons && !surface.small && film_.world() == World::whole;
  }

  template <class Bsdf>
  void add_caustics(const PathState& state, const Surface& surface, const VertexNumbers& u,
                    const Bsdf& bsdf) {
    const float gathers = state.diffuse > 1 ? later_gather_probability : 1.f;
    if (!(u[light_choice].y < gathers)) return;
    GatheredLight light;
    const V3f &at = surface.position, &normal = surface.geometric_normal;
    const unsigned subset = settings_.photons->subset_at(sampler_.one(time_dimension));
    if constexpr (std::is_same_v<Bsdf, ClothBsdf>)
      light = settings_.photons->irradiance(subset, at, normal, bsdf.front());
    else
      settings_.photons->for_each_near(
          subset, at, normal, [&](const V3f& flight, const V3f& power, float weight, float half) {
            Irradiance one;
            bsdf.receive(one, -flight, power * weight);
            light.all.add(one, 1);
            light.split.add(one, half);
          });
    film_.split(state.throughput * bsdf.radiance(light.split) * (1 / gathers));
    V3f found = bsdf.radiance(light.all);
    if (settings_.walks == ManifoldWalks::some) found += manifold_light(state, surface, u, bsdf);
    film_.deposit(state.throughput * found * (1 / gathers), scene_.lights().caustics_group());
  }

  /// What comes from a lamp by the path that a manifold walk finds.
  template <class Bsdf>
  V3f manifold_light(const PathState& state, const Surface& surface, const VertexNumbers& u,
                     const Bsdf& bsdf) {
    const auto light = sample_manifold(scene_, surface, state.ray, state.in, u[light_choice].x,
                                       u[light_point], rays_);
    float pdf = 0;
    const V3f found = light ? bsdf.value(light->direction, pdf) * light->radiance : V3f(0);
    return finite(found) ? found : V3f(0);
  }

  /// A sampled light's light by each lobe. @param beyond  bodies that the other side is in
  template <class... Lobe>
  void add_direct(const PathState& state, const Surface& surface, Bodies beyond,
                  const VertexNumbers& u, const Lobe&... lobe) {
    if (settings_.estimator == Estimator::bsdf_only) return;
    if (!samples_lights(state.in) && !samples_lights(beyond)) return;
    const LightSample light =
        scene_.lights().sample(surface.position, state.ray.time, u[light_choice].x, u[light_point]);
    if (!(light.pdf > 0)) return;
    if (film_.world() == World::plate && !scene_.in_plate(light)) return;
    Bodies in = state.in;
    if constexpr (has_facets) {
      const V3f& n = surface.geometric_normal;
      if (dot(light.direction, n) * dot(state.ray.direction, n) > 0) in = beyond;
      if (!samples_lights(in)) return;
    }
    V3f found(0);
    const auto add = [&](const auto& bsdf) {
      float bsdf_pdf = 0;
      const V3f value = bsdf.value(light.direction, bsdf_pdf);
      if (is_black(value)) return;
      const float weight =
          settings_.estimator == Estimator::light_only ? 1.f : power_heuristic(light.pdf, bsdf_pdf);
      found += state.throughput * value * light.radiance * (weight / light.pdf);
    };
    (add(lobe), ...);
    if (is_black(found)) return;
    Ray shadow;
    surface.send(shadow, light.direction);
    shadow.time = state.ray.time;
    ++rays_;
    if constexpr (has_facets) {
      found *= scene_.transmitted(shadow, {light.distance, light.lamp}, film_.world());
      if (is_black(found)) return;
    } else if (scene_.occluded(shadow, {light.distance, light.lamp}, film_.world())) {
      return;
    }
    if constexpr (has_water)
      if (in && std::isfinite(light.distance)) {
        const V3f& a = scene_.medium(in).absorption;
        for (int c = 0; c < 3; ++c) found[c] *= std::exp(-a[c] * light.distance);
      }
    if (finite(found)) film_.deposit(found, light.group);
  }

  bool survives(PathState& state) {
    if (state.vertices < roulette_start) return true;
    float keep = std::min(largest(state.survival), 1.f);
    if (state.vertices >= long_path) keep = std::min(keep, long_path_survival);
    if (keep >= 1) return true;
    if (!(number(state, roulette) < keep)) return false;
    state.throughput *= 1 / keep;
    state.survival *= 1 / keep;
    return true;
  }

  float number(const PathState& state, VertexDimension which) const {
    return sampler_.one(state.dimension(which));
  }
  VertexNumbers numbers(const PathState& state) const {
    return sampler_.four(state.dimension(light_choice));
  }

  const Scene& scene_;
  const PathSettings& settings_;
  const Sampler& sampler_;
  PathFilm<has_plate> film_;
  PathState state_;
  std::optional<PathState> mirrored_;  // the other branch of the first interface
  Hit hit_;
  uint64_t rays_ = 0;
  bool going_ = false;
};

}  // namespace drench::render
