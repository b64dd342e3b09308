#include "render/bsdf/albedo_table.h"

#include <cstdint>

#include "render/bsdf/bsdf_dielectric.h"
#include "render/bsdf/microfacet.h"

namespace drench::render {

namespace {

/// Points of the quadrature, a Fibonacci lattice: where total reflection begins and only one of the
/// two coordinates matters, each point has its own.
constexpr int lattice_points = 4181, lattice_step = 2584;

}  // namespace

AlbedoTable::Albedo AlbedoTable::at(float cos) const {
  const float x = std::sqrt(std::clamp(cos, 0.f, 1.f)) * nodes;
  const int k = std::min(int(x), nodes - 1);
  const float t = x - float(k);
  const Albedo &a = albedo_[size_t(k)], &b = albedo_[size_t(k) + 1];
  return {a.reflected + (b.reflected - a.reflected) * t, a.total + (b.total - a.total) * t};
}

/// Over visible normals, where a facet's albedo is Fresnel's times masking: smooth, at most 1, and
/// the same to both sides of the plane that light arrives in.
template <class Fresnel>
AlbedoTable AlbedoTable::integrate(float alpha, float eta, const Fresnel& fresnel) {
  const Ggx ggx{alpha};
  AlbedoTable table;
  for (int node = 0; node <= nodes; ++node) {
    const double root = std::max(double(node) / nodes, 1e-3);
    const float cos = float(root * root);
    const V3f o(std::sqrt(1 - cos * cos), 0, cos);
    const float visible = o.z + ggx.stretch(o);
    double reflected = 0, refracted = 0;
    for (int k = 0; k < lattice_points; ++k) {
      const float around = float(int64_t(k) * lattice_step % lattice_points) / lattice_points;
      const V2f u(0.5f * around, (float(k) + 0.5f) / lattice_points);
      const V3f h = ggx.sample_normal(o, u, 1);
      const float facing = std::min(dot(o, h), 1.f), reflectance = fresnel(facing);
      const V3f mirrored = h * (2 * facing) - o;
      if (mirrored.z > 0)
        reflected += double(reflectance * ggx.masking(o, mirrored) * mirrored.z * visible / 2);
      if (reflectance >= 1) continue;
      const V3f bent = refract_about(o, h, facing, eta);
      if (bent.z < 0)
        refracted += double((1 - reflectance) * ggx.masking(o, bent) * -bent.z * visible / 2);
    }
    table.albedo_[size_t(node)] = {float(reflected / lattice_points),
                                   float((reflected + refracted) / lattice_points)};
  }
  constexpr int steps = 4096;
  double mean_reflected = 0, mean_total = 0;
  for (int k = 0; k < steps; ++k) {
    const double cos = (k + 0.5) / steps;
    const Albedo albedo = table.at(float(cos));
    mean_reflected += 2 * cos * double(albedo.reflected) / double(albedo.total) / steps;
    mean_total += 2 * cos * double(albedo.total) / steps;
  }
  table.mean_reflected_ = float(mean_reflected);
  table.mean_total_ = float(mean_total);
  return table;
}

AlbedoTable AlbedoTable::dielectric(float alpha, float eta) {
  return integrate(alpha, eta, [eta](float cos) { return fresnel_reflectance(cos, eta); });
}

AlbedoTable AlbedoTable::mirrors(float alpha) {
  return integrate(alpha, 1, [](float) { return 1.f; });
}

}  // namespace drench::render
