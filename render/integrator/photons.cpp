#include "render/integrator/photons.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <atomic>
#include <bit>

#include "render/bsdf/bsdf_dielectric.h"
#include "render/integrator/manifold.h"
#include "render/sampler.h"
#include "render/scene/embree.h"

namespace drench::render {

namespace {

/// Sampling dimensions of a photon; each interface takes two.
struct PhotonDimension {
  enum : uint32_t {
    start,  // within its stretch of the area
    start_point,
    lamp,
    lamp_point,
    time,
    interfaces,
    row = interfaces,  // free: interfaces count from 1
    first_gap = 1u << 16
  };
};
constexpr int max_interfaces = 64, long_flight = 8;
constexpr float long_flight_survival = 0.8f;
constexpr int max_crossings = 1 << 12;  // contact faces and gaps that it passes one after the other
constexpr float max_power = 2;  // of one that falls straight on a body, where discs hold few
/// Of a disc's light that one may bring where they hold many.
constexpr double max_disc_fraction = 0.1;
constexpr float crowd_factor = 4;         // times the photons of the median one's disc
constexpr uint32_t min_crowd = 400;       // photons of a crowded cell: noise above blur
constexpr unsigned max_subsets_log2 = 3;  // log2: any eight samples in a row see all photons
// Rounds after which subsets are twice as many, log2: time is divided ever finer, and noise still
// falls where eight samples in a row then miss photons of a round.
constexpr unsigned rounds_per_doubling_log2 = 4;
constexpr double min_subset_photons = 4;  // photons of the median one's disc in a subset, at least
// Fraction of the light that walks must find to be taken: each costs a path four rays, and where
// much is left to photons the error is theirs (decision 0103).
constexpr double calm_fraction = 0.8;
constexpr uint32_t photon_seed = 0x70686f74u;  // photons and camera paths draw apart

/// Photons that the disc around the median one shall hold: 20 of 1e5, and more of more.
double wanted_count(double photons) { return 20 * std::sqrt(photons / 1e5); }

/// The smooth bodies' triangles by area; those on sheets let light pass and start none.
class InterfacePoints {
 public:
  explicit InterfacePoints(const Scene& scene) : scene_(scene) {
    double sum = 0;
    for (const uint32_t index : scene.bodies()) {
      const SceneObject& body = scene.object(index);
      first_.push_back(upto_.size());
      for (size_t t = 0; t < body.triangle.size(); ++t) {
        if (!scene.is_rough(body) && (body.contact.empty() || !body.contact[t]))
          sum += double(area_of(body, t, 0));
        upto_.push_back(sum);
      }
    }
  }

  /// m^2, at shutter open
  float area() const { return upto_.empty() ? 0.f : float(upto_.back()); }

  /// The triangle at a fraction of the area.
  size_t triangle_at(double u) const {
    const auto found = std::upper_bound(upto_.begin(), upto_.end(), u * upto_.back());
    return std::min(size_t(found - upto_.begin()), upto_.size() - 1);
  }
  struct Start {
    Hit hit;
    float area_ratio;  // of the triangle at this time over shutter open
  };
  /// @param u     fraction of the area
  /// @param from  where the search begins: no triangle behind that of u. Becomes that of u
  Start sample(double u, const V2f& uv, float time, size_t& from) const {
    while (from + 1 < upto_.size() && upto_[from] <= u * upto_.back()) ++from;
    const auto after = std::upper_bound(first_.begin(), first_.end(), from);
    const size_t bit = size_t(after - first_.begin()) - 1, triangle = from - first_[bit];
    const uint32_t index = scene_.bodies()[bit];
    const SceneObject& body = scene_.object(index);
    const float root = std::sqrt(uv.x);  // uniform on the triangle
    const float at_open = area_of(body, triangle, 0);
    return {{.kind = Hit::Kind::object,
             .index = index,
             .triangle = uint32_t(triangle),
             .u = root * (1 - uv.y),
             .v = root * uv.y},
            at_open > 0 ? area_of(body, triangle, time) / at_open : 0.f};
  }

 private:
  static float area_of(const SceneObject& body, size_t triangle, float time) {
    const Packed n = body.corners(uint32_t(triangle), time).across();
    return 0.5f * std::sqrt(dot(n, n));
  }

  const Scene& scene_;
  std::vector<size_t> first_;  // of each body
  std::vector<double> upto_;   // area to the end of each triangle, body after body
};

struct Flight {
  Ray ray;
  V3f power;
  Bodies in = 0;
  int interfaces = 0;
  uint32_t sheets = 0;  // with gaps, that it met,
  uint32_t gaps = 0;    // and gaps that it fell through
  int lamp = 0;
  V3f start, lit_from;  // where it met the body, and from which direction
  float most_gain = 0;  // of flux, that smooth normals instead of the real ones may still add
};

class PhotonTracer {
 public:
  PhotonTracer(const Scene& scene, const InterfacePoints& starts, uint32_t count, int rounds,
               ManifoldWalks walks)
      : scene_(scene),
        starts_(starts),
        count_(count),
        walks_(walks),
        most_power_(
            std::max(max_power, float(max_disc_fraction * wanted_count(double(count) * rounds)))) {}

  enum class Fate { lost, lies, walked };

  /// A photon, if it starts and comes to lie on something, and whether a walk finds its path. In
  /// their order they start along the bodies' surface: an even spread, and neighbours in memory one
  /// after the other.
  /// @param from  triangle of the photon before, or one before that of this
  Fate trace(uint32_t number, const Sampler& sampler, size_t& from, Photon& photon,
             uint64_t& rays) const {
    Flight flight;
    Surface surface;
    if (!start(number, sampler, from, flight, surface, rays)) return Fate::lost;
    while (cross_interface(sampler, flight, surface)) {
      const Hit hit = next(sampler, flight, surface, rays);
      if (hit.kind != Hit::Kind::ground && hit.kind != Hit::Kind::object) return Fate::lost;
      if (surface.body) continue;
      // Paths bring foam and metal what they get.
      if (surface.small || surface.material->type == MaterialType::metal) return Fate::lost;
      const float n = scene_.medium(flight.in).ior;
      // Those that fell through gaps are missing on the yarns, which get what others do.
      const float yarns = 1 - surface.material->gap;
      photon = {surface.position, flight.ray.direction, surface.geometric_normal,
                flight.power * (1 / (n * n * yarns)), sampler.one(PhotonDimension::time)};
      if (!finite(photon.power)) return Fate::lost;
      return is_walked(flight, surface, rays) ? Fate::walked : Fate::lies;
    }
    return Fate::lost;
  }

 private:
  /// From a lamp to a point of a body that it reaches.
  bool start(uint32_t number, const Sampler& sampler, size_t& from, Flight& flight,
             Surface& surface, uint64_t& rays) const {
    const ShutterCurve& curve = scene_.camera().curve();
    flight.ray.time = curve.time(sampler.one(PhotonDimension::time),
                                 curve.rolls() ? sampler.one(PhotonDimension::row) : 0.f);
    const auto [hit, area_ratio] =
        starts_.sample((number + double(sampler.one(PhotonDimension::start))) / count_,
                       sampler.two(PhotonDimension::start_point), flight.ray.time, from);
    surface = scene_.surface(flight.ray, hit);
    const LightSample light =
        scene_.lights().sample_lamps(surface.position, sampler.one(PhotonDimension::lamp),
                                     sampler.two(PhotonDimension::lamp_point));
    const float facing = dot(light.direction, surface.geometric_normal);
    if (!(light.pdf > 0) || !(facing > 0)) return false;
    ++rays;
    const float transmittance =
        scene_.transmitted({surface.leave(light.direction), light.direction, flight.ray.time},
                           {light.distance, light.lamp});
    if (transmittance == 0) return false;
    flight.ray.direction = -light.direction;
    flight.most_gain = most_power_ / facing;
    flight.lamp = light.lamp, flight.start = surface.position, flight.lit_from = light.direction;
    flight.power = light.radiance * (transmittance * facing * area_ratio * starts_.area() /
                                     (light.pdf * float(count_)));
    return true;
  }

  bool is_walked(const Flight& flight, const Surface& surface, uint64_t& rays) const {
    if (walks_ == ManifoldWalks::none || flight.interfaces > 1 || flight.gaps > 0) return false;
    if (!std::has_single_bit(flight.in)) return false;
    const LampPoint lamp = scene_.lights().lamp_point_of(size_t(flight.lamp), surface.position,
                                                         flight.start, flight.lit_from);
    return manifold_walk_finds(scene_, surface, flight.ray.time, flight.in, lamp,
                               flight.ray.direction, rays);
  }

  /// Reflects or refracts at a body's surface. Snell's law keeps n^2 cos dw about the normal
  /// that bends the light; flux through the real surface has the cosine with that one's, so where
  /// the two differ it takes the ratio, and photons carry what paths find in reverse.
  bool cross_interface(const Sampler& sampler, Flight& flight, const Surface& surface) const {
    if (++flight.interfaces > max_interfaces) return false;
    const uint32_t dimension = PhotonDimension::interfaces + 2 * uint32_t(flight.interfaces);
    const V3f d = flight.ray.direction;
    const Medium &before = scene_.medium(flight.in),
                 &after = scene_.medium(flight.in ^ surface.body);
    if (&before == &after) {  // inside a body of higher priority
      flight.in ^= surface.body;
      flight.ray.origin = surface.leave(d);
      return true;
    }
    if (surface.material->alpha > 0) return false;  // paths keep what rough bodies let through
    const float eta = after.ior / before.ior;
    const V3f flat =
        flight.in & surface.body ? -surface.geometric_normal : surface.geometric_normal;
    V3f normal = interface_normal(d, surface.geometric_normal, surface.shading_normal);
    InterfaceSplit split = split_at_interface(d, normal, eta);
    if (split.reflectance < 1 && !(dot(split.refracted, flat) < 0)) {
      normal = flat;
      split = split_at_interface(d, normal, eta);
    }
    const auto reflects = [&] {
      return split.reflectance >= 1 || sampler.one(dimension) < split.reflectance;
    };
    bool reflect = reflects();
    V3f out = reflect ? split.reflected : split.refracted;
    float gain = std::abs(dot(out, flat) * dot(d, normal) / (dot(d, flat) * dot(out, normal)));
    if (!(gain < flight.most_gain)) {  // along the real surface: it would be a white dot
      split = split_at_interface(d, flat, eta);
      reflect = reflects();
      out = reflect ? split.reflected : split.refracted;
      gain = 1;
    }
    flight.power *= gain;
    flight.most_gain /= gain;
    if (flight.interfaces > long_flight) {
      if (!(sampler.one(dimension + 1) < long_flight_survival)) return false;
      flight.power *= 1 / long_flight_survival;
    }
    if (!reflect) flight.in ^= surface.body;
    flight.ray.origin = surface.leave(out);
    flight.ray.direction = out;
    return finite(out) && finite(flight.power);
  }

  /// The next surface but for contact of water with sheets, which light passes, and sheets that
  /// it falls through. Where water has a surface in their gaps paths keep what comes through.
  Hit next(const Sampler& sampler, Flight& flight, Surface& surface, uint64_t& rays) const {
    bool dry_gap = false;
    for (int met = 0; met < max_crossings; ++met) {
      const Hit hit = scene_.intersect(flight.ray, Coherence::incoherent);
      ++rays;
      if (hit.kind != Hit::Kind::ground && hit.kind != Hit::Kind::object) return hit;
      surface = scene_.surface(flight.ray, hit);
      const bool outwards = dot(flight.ray.direction, surface.geometric_normal) > 0;
      if (!outwards) flight.in &= ~surface.body;
      absorb(flight, hit.distance);  // as paths do
      if (outwards) flight.in |= surface.body;
      const float gap = surface.material->gap;
      if (gap > 0 && sampler.one(PhotonDimension::first_gap + flight.sheets++) < gap) {
        ++flight.gaps;
        flight.ray.origin = surface.leave(flight.ray.direction);
        dry_gap = !scene_.in_fluid(flight.in);
        if (!dry_gap && !scene_.fluid_beyond(flight.ray)) return {};
        continue;
      }
      if (!surface.contact) return hit;
      if (dry_gap && !outwards) return {};
      flight.in |= surface.body;
      flight.ray.origin = surface.leave(flight.ray.direction);
    }
    return {};
  }

  void absorb(Flight& flight, float distance) const {
    const V3f& a = scene_.medium(flight.in).absorption;
    if (is_black(a)) return;
    for (int c = 0; c < 3; ++c) flight.power[c] *= std::exp(-a[c] * distance);
  }

  const Scene& scene_;
  const InterfacePoints& starts_;
  uint32_t count_;
  ManifoldWalks walks_;
  float most_power_;
};

uint64_t key_of(const Imath::V3i& cell) {
  const auto bits = [](int v) { return uint64_t(uint32_t(v)) & 0x1fffff; };
  return bits(cell.z) << 42 | bits(cell.y) << 21 | bits(cell.x);
}

/// Photons in the cell of the median photon, cells of the given edge.
double typical_count(const std::vector<Photon>& photons, float edge) {
  std::vector<uint64_t> key(photons.size());
  for (size_t k = 0; k < key.size(); ++k) {
    const V3f p = photons[k].position * (1 / edge);
    key[k] = key_of({int(std::floor(p.x)), int(std::floor(p.y)), int(std::floor(p.z))});
  }
  tbb::parallel_sort(key.begin(), key.end());
  std::vector<uint32_t> run;
  for (size_t k = 0; k < key.size(); ++k)
    if (k > 0 && key[k] == key[k - 1])
      ++run.back();
    else
      run.push_back(1);
  std::sort(run.begin(), run.end());
  size_t seen = 0;
  for (const uint32_t count : run)
    if ((seen += count) * 2 >= key.size()) return count;
  return 1;
}

float choose_radius(const std::vector<Photon>& photons, const Imath::Box3f& bounds) {
  const double wanted = wanted_count(double(photons.size()));
  const float diagonal = std::max((bounds.max - bounds.min).length(), 1e-6f);
  // Cells stay countable, however far from the origin the photons lie.
  const float far = std::max(largest(absolute(bounds.min)), largest(absolute(bounds.max)));
  const float least = std::max(diagonal * 1e-5f, far * 1e-6f);
  float radius = std::max(diagonal / 50, least);
  for (int round = 0; round < 4; ++round) {
    const float edge = 2 * radius;
    const double density = typical_count(photons, edge) / (double(edge) * edge);
    radius = float(std::sqrt(wanted / (double(pi) * density)));
    radius = std::clamp(radius, least, std::max(least, diagonal / 10));
  }
  return radius;
}

}  // namespace

PhotonMap::PhotonMap(const std::vector<Photon>& photons, int samples, int rounds) {
  if (photons.empty()) return;
  size_ = photons.size();
  for (const Photon& p : photons) reach_.extendBy(p.position);
  radius_ = choose_radius(photons, reach_) / std::sqrt(std::sqrt(float(rounds)));
  reach_.min -= V3f(2 * radius_), reach_.max += V3f(2 * radius_);
  inverse_edge_ = 1 / (2 * radius_);
  const unsigned max_log2 =
      max_subsets_log2 + unsigned(std::bit_width(unsigned(rounds)) - 1) / rounds_per_doubling_log2;
  const double wanted = wanted_count(double(size_) * rounds);
  while (subsets_log2_ < max_log2 && int(2 * subsets()) <= samples &&
         wanted >= min_subset_photons * 2 * subsets())
    ++subsets_log2_;
  mask_ = 63;  // the least with which neighbouring rows stay apart
  while ((size_t{mask_} + 1) * subsets() < size_) mask_ = 2 * mask_ + 1;
  choose_radii(photons, rounds);
  sort_into_buckets(photons);
}

void PhotonMap::choose_radii(const std::vector<Photon>& photons, int rounds) {
  std::vector<uint32_t> count(size_t{mask_} + size_t(cell_of(reach_.max).x) + 2);
  for (const Photon& p : photons) ++count[bucket_of(cell_of(p.position))];
  const double wanted = wanted_count(double(size_) * rounds) / rounds;
  const uint32_t crowd =
      std::max({1u, min_crowd / uint32_t(rounds), uint32_t(crowd_factor * 4 / pi * wanted)});
  for (const uint32_t c : count)
    radius2_.push_back(radius_ * radius_ * (c > crowd ? float(crowd) / float(c) : 1.f));
}

void PhotonMap::sort_into_buckets(const std::vector<Photon>& photons) {
  const auto bucket = [&](size_t k) {
    return subset_at(photons[k].time_sample) * buckets() + bucket_of(cell_of(photons[k].position));
  };
  first_.assign(subsets() * buckets() + 1, 0);
  for (size_t k = 0; k < size_; ++k) ++first_[bucket(k) + 1];
  for (size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  pack_.resize((size_ + 7) / 8);
  for (size_t j = 0; j < size_; ++j) {
    const Photon& p = photons[j];
    const V3f power = p.power * float(subsets());
    const uint32_t slot = next[bucket(j)]++, k = slot % 8;
    PhotonPack& pack = pack_[slot / 8];
    pack.x[k] = p.position.x, pack.y[k] = p.position.y, pack.z[k] = p.position.z;
    pack.red[k] = power.x, pack.green[k] = power.y, pack.blue[k] = power.z;
    pack.normal[k] = pack_unit(p.normal);
    pack.flight[k] = pack_unit(p.direction);
  }
}

GatheredLight PhotonMap::irradiance(unsigned subset, const V3f& point, const V3f& normal,
                                    const V3f& front) const {
  __m256 sum[2][3] = {};
  for_each_pack_near(subset, point, normal, [&](const PhotonPack& p, __m256 weight) {
    const __m256 along = unpack_unit<0>(p.flight) * front.x + unpack_unit<1>(p.flight) * front.y +
                         unpack_unit<2>(p.flight) * front.z;
    const __m256 there = _mm256_cmp_ps(along, _mm256_setzero_ps(), _CMP_LT_OQ);
    const __m256 weights[2] = {_mm256_and_ps(there, weight), _mm256_andnot_ps(there, weight)};
    const std::array<float, 8>* const power[3] = {&p.red, &p.green, &p.blue};
    for (int side = 0; side < 2; ++side)
      for (int c = 0; c < 3; ++c) sum[side][c] += weights[side] * _mm256_load_ps(power[c]->data());
  });
  const auto total = [&](int side, const auto& factor) {
    V3f out(0);
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < 8; ++k) out[c] += sum[side][c][k] * factor(k);
    return out;
  };
  const auto all = [](int) { return 1.f; };
  const auto half = [](int k) { return half_sign[k]; };
  return {{total(0, all), total(1, all)}, {total(0, half), total(1, half)}};
}

bool can_trace_photons(const Scene& scene) {
  return !scene.bodies().empty() && scene.lights().lamps() > 0 && !scene.lamps_in_bodies();
}

Caustics trace_photons(const Scene& scene, uint32_t seed, uint32_t count, int samples,
                       ManifoldWalks walks, uint64_t& rays, const PhotonRound& round) {
  constexpr uint32_t chunk = 4096;
  const InterfacePoints starts(scene);
  if (!(starts.area() > 0)) return {};
  const uint32_t index = uint32_t(round.index), slot = index & ((1u << round.slots_log2) - 1);
  const uint32_t round_seed = seed ^ photon_seed ^ hash_bits(index >> round.slots_log2);
  const PhotonTracer tracer(scene, starts, count, round.rounds, walks);
  struct Found {
    Photon photon;
    bool walked;
  };
  std::vector<std::vector<Found>> found((count + chunk - 1) / chunk);
  std::atomic<uint64_t> traced{0};
  tbb::parallel_for(size_t{0}, found.size(), [&](size_t c) {
    const FlushDenormals flush;
    uint64_t chunk_rays = 0;
    size_t from = starts.triangle_at(double(c) * chunk / count);
    for (uint32_t k = uint32_t(c) * chunk; k < std::min(count, (uint32_t(c) + 1) * chunk); ++k) {
      const Sampler sampler(PixelOrder::separate, round_seed, 0, 0, 0,
                            k << round.slots_log2 | slot);
      Photon photon;
      const PhotonTracer::Fate fate = tracer.trace(k, sampler, from, photon, chunk_rays);
      if (fate != PhotonTracer::Fate::lost)
        found[c].push_back({photon, fate == PhotonTracer::Fate::walked});
    }
    traced += chunk_rays;
  });
  rays += traced;
  double light = 0, walked = 0;
  for (const std::vector<Found>& part : found)
    for (const Found& f : part) {
      const V3f& power = f.photon.power;
      const double sum = double(power.x) + double(power.y) + double(power.z);
      light += sum;
      if (f.walked) walked += sum;
    }
  Caustics out;
  if (light > 0) out.walked = float(walked / light);
  if (walks == ManifoldWalks::if_calm)
    walks = out.walked > calm_fraction ? ManifoldWalks::some : ManifoldWalks::none;
  out.walks = walks;
  std::vector<Photon> left;
  for (const std::vector<Found>& part : found)
    for (const Found& f : part)
      if (walks == ManifoldWalks::none || !f.walked) left.push_back(f.photon);
  out.photons = PhotonMap(left, samples, round.rounds);
  return out;
}

}  // namespace drench::render
