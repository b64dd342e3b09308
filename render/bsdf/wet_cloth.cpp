#include "render/bsdf/wet_cloth.h"

#include "render/bsdf/bsdf_dielectric.h"

namespace drench::render {

namespace {

/// Of cellulose, cotton's and linen's; wool has 1.55, too, polyester more.
constexpr double fibre_index = 1.55;
/// Fractions below it count as none: fibres that only absorb, or a sheet that lets nothing through.
constexpr double min_fraction = 1e-7;

/// What a smooth surface reflects of light from everywhere: the mean of Fresnel's over 2 cos dcos.
double mean_reflectance(double eta) {
  constexpr int steps = 4096;
  double sum = 0;
  for (int k = 0; k < steps; ++k) {
    const double cos = (k + 0.5) / steps;
    sum += 2 * cos * double(fresnel_reflectance(float(cos), float(eta))) / steps;
  }
  return sum;
}

struct Fractions {
  double reflected, transmitted;
};

/// Of a layer with a = 1 + k/s and scattering power s.
Fractions layer(double a_minus_1, double s) {
  const double a = 1 + a_minus_1, b = std::sqrt(a_minus_1 * (a + 1));
  if (b * s < 1e-4) return {s / (1 + a * s), 1 / (1 + a * s)};  // sinh x = x: hardly absorbs
  const double e = std::exp(-2 * b * s), down = a * (1 - e) + b * (1 + e);
  return {(1 - e) / down, 2 * b * std::exp(-b * s) / down};
}

Fractions wet(double r, double t, const WetFibres& fibres) {
  if (r < min_fraction) return {0, std::pow(t, fibres.absorption)};
  const double a_minus_1 = std::max((1 - r - t) * (1 - r + t) / (2 * r), 0.);
  const double wet_a_minus_1 = a_minus_1 * fibres.absorption / fibres.scattering;
  if (t < min_fraction)  // without end: nothing comes from behind
    return {1 / (1 + wet_a_minus_1 + std::sqrt(wet_a_minus_1 * (wet_a_minus_1 + 2))), 0};
  const double b = std::sqrt(a_minus_1 * (a_minus_1 + 2)), y = b * r / t;
  const double s = y < 1e-4 ? r / t : r / t * std::asinh(y) / y;
  return layer(wet_a_minus_1, s * fibres.scattering);
}

}  // namespace

WetFibres::WetFibres(double liquid) {
  const double in_air = mean_reflectance(fibre_index),
               in_liquid = mean_reflectance(fibre_index / liquid);
  scattering = in_liquid / in_air;
  absorption = (1 - in_liquid) / (1 - in_air);
}

SheetColours wet_colours(const SheetColours& dry, const WetFibres& fibres) {
  SheetColours out;
  for (int c = 0; c < 3; ++c) {
    const Fractions fractions =
        wet(double(dry.reflectance[c]), double(dry.transmittance[c]), fibres);
    out.reflectance[c] = float(fractions.reflected);
    out.transmittance[c] = float(fractions.transmitted);
  }
  return out;
}

}  // namespace drench::render
