// Fabric by itself: wet colours against a layer added up from thin ones, and its lobes' densities,
// energy, reciprocity and limits.

#include "render/bsdf/bsdf_fabric.h"

#include <fmt/format.h>

#include "tests/render/lobes.h"

namespace drench::render::test {
namespace {

constexpr float water = 1.333f;

struct Layer {
  double reflected, transmitted;
};

/// A layer of scattering and absorbing powers s and k: 2^24 thin ones, by doubling.
Layer layer_of_thin_ones(double s, double k) {
  const double thin = 0x1p-24;
  Layer l{s * thin, 1 - (s + k) * thin};
  for (int n = 0; n < 24; ++n) {
    const double again = 1 / (1 - l.reflected * l.reflected);
    l = {l.reflected * (1 + l.transmitted * l.transmitted * again),
         l.transmitted * l.transmitted * again};
  }
  return l;
}

// Of 2^24 thin layers each errs by 2^-48: 1e-6 of rounding is left, and float's of the colours.
TEST(WetColours, AreThoseOfALayerWhosePowersChange) {
  const WetFibres fibres(water);
  for (const double s : {0.01, 0.3, 2., 6.})
    for (const double k : {0., 1e-6, 0.01, 0.3, 2.}) {
      const Layer dry = layer_of_thin_ones(s, k),
                  wet = layer_of_thin_ones(s * fibres.scattering, k * fibres.absorption);
      const SheetColours colours =
          wet_colours({V3f(float(dry.reflected)), V3f(float(dry.transmitted))}, fibres);
      EXPECT_NEAR(colours.reflectance.x, wet.reflected, 1e-5) << s << ' ' << k;
      EXPECT_NEAR(colours.transmittance.x, wet.transmitted, 1e-5) << s << ' ' << k;
    }
}

// Without end, R = 1 + K/S - sqrt((K/S)^2 + 2 K/S); without scattering T falls as e^-K.
TEST(WetColours, HoldForOpaqueAndForClearSheets) {
  const WetFibres fibres(water);
  for (const double r : {1., 0.8, 0.3, 0.02}) {
    const double x = (1 - r) * (1 - r) / (2 * r) * fibres.absorption / fibres.scattering;
    const SheetColours wet = wet_colours({V3f(float(r)), V3f(0)}, fibres);
    EXPECT_NEAR(wet.reflectance.x, 1 + x - std::sqrt(x * x + 2 * x), 1e-5) << r;
    EXPECT_EQ(wet.transmittance.x, 0);
  }
  const SheetColours clear = wet_colours({V3f(0), V3f(0.3f)}, fibres);
  EXPECT_EQ(clear.reflectance.x, 0);
  EXPECT_NEAR(clear.transmittance.x, std::pow(0.3, fibres.absorption), 1e-6);
  const SheetColours black = wet_colours({V3f(0), V3f(0)}, fibres);
  EXPECT_EQ(black.reflectance.x + black.transmittance.x, 0);
}

/// Fresnel's mean over light from everywhere, in closed form. Walsh 1926.
double walsh(double n) {
  const double n2 = n * n, n4 = n2 * n2;
  return 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) * (n + 1)) +
         n2 * (n2 - 1) * (n2 - 1) / std::pow(n2 + 1, 3) * std::log((n - 1) / (n + 1)) -
         2 * n * n2 * (n2 + 2 * n - 1) / ((n2 + 1) * (n4 - 1)) +
         8 * n4 * (n4 + 1) / ((n2 + 1) * (n4 - 1) * (n4 - 1)) * std::log(n);
}

// Cellulose has 1.55: in water its fibres send back 0.379 of what they do in air, and let in 1.07.
TEST(WetFibres, ReflectAsFresnelSays) {
  EXPECT_NEAR(walsh(1.5), 0.0918, 1e-4);  // Judd 1942
  const WetFibres fibres(1.333);
  EXPECT_NEAR(fibres.scattering, walsh(1.55 / 1.333) / walsh(1.55), 1e-4);
  EXPECT_NEAR(fibres.absorption, (1 - walsh(1.55 / 1.333)) / (1 - walsh(1.55)), 1e-4);
}

// Air wets nothing; what has the fibres' index leaves no scattering, a clear sheet.
TEST(WetColours, AreTheDryOnesInAirAndClearInOil) {
  const SheetColours dry{{0.55f, 0.3f, 0.9f}, {0.2f, 0.6f, 0.1f}};
  const SheetColours same = wet_colours(dry, WetFibres(1)), oil = wet_colours(dry, WetFibres(1.55));
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(same.reflectance[c], dry.reflectance[c], 1e-5);
    EXPECT_NEAR(same.transmittance[c], dry.transmittance[c], 1e-5);
    EXPECT_NEAR(oil.reflectance[c], 0, 1e-5);
  }
  const SheetColours wet = wet_colours(dry, WetFibres(water));
  for (int c = 0; c < 3; ++c) {
    EXPECT_LT(wet.reflectance[c], dry.reflectance[c]);
    EXPECT_GT(wet.transmittance[c], dry.transmittance[c]);
    EXPECT_LE(wet.reflectance[c] + wet.transmittance[c], 1.00001f);
  }
}

/// A kind of fabric with the tables it needs.
struct Kind {
  float reflectance = 0.5f, transmittance = 0.2f, wetness = 0, film_alpha = 0.09f, eta = water;
  float sheen = 0, yarn = 0;
  AlbedoTable film = AlbedoTable::dielectric(film_alpha, eta);

  FabricPoint at(float wet) const {
    FabricPoint point;
    point.dry = {V3f(reflectance), V3f(transmittance)};
    point.wet = wet_colours(point.dry, WetFibres(eta));
    point.wetness = wet;
    point.film_alpha = film_alpha;
    point.film_eta = eta;
    point.film = &film;
    static const SheenTable fuzz(0.3f);
    static const YarnTable yarns(0.16f);
    point.sheen = V3f(sheen), point.yarn = V3f(yarn);
    if (sheen > 0) point.fuzz = &fuzz;
    if (yarn > 0) point.yarns = &yarns;
    point.along_u = V3f(2, 0, 0), point.along_v = V3f(0.5f, 1, 0);  // a weave that is sheared
    return point;
  }
  FabricPoint at() const { return at(wetness); }
  FabricBsdf seen(const V3f& outgoing) const { return {outgoing, straight_up, straight_up, at()}; }
};

Kind kind(float reflectance, float transmittance, float wetness, float sheen = 0, float yarn = 0) {
  Kind out;
  out.reflectance = reflectance, out.transmittance = transmittance, out.wetness = wetness;
  out.sheen = sheen, out.yarn = yarn;
  return out;
}

Scatter sample(const FabricBsdf& bsdf, const Draw& u) {
  return u.side < bsdf.glint_probability() ? bsdf.glints().sample(u.point)
                                           : bsdf.soft().sample(u.point);
}

double density(const FabricBsdf& bsdf, const V3f& d) {
  float soft = 0, glints = 0;
  bsdf.soft().value(d, soft), bsdf.glints().value(d, glints);
  return double(soft) + double(glints);
}

/// Value x |cos| of both lobes.
V3f value(const FabricBsdf& bsdf, const V3f& d) {
  float pdf = 0;
  return bsdf.soft().value(d, pdf) + bsdf.glints().value(d, pdf);
}

double furnace(const FabricBsdf& bsdf) {
  return furnace_of([&](const Draw& u) { return sample(bsdf, u); });
}

/// "wetness sheen yarn cosine" of what failed.
std::string told(const Kind& k, float cos) {
  return fmt::format("{} {} {} at {}", k.wetness, k.sheen, k.yarn, cos);
}

/// A direction at an angle around the normal.
V3f towards(float cos, float around) {
  const float sin = std::sqrt(1 - cos * cos);
  return {sin * std::cos(around), sin * std::sin(around), cos};
}

std::vector<Kind> white_kinds() {
  return {kind(0.6f, 0.4f, 0),
          kind(0.6f, 0.4f, 0.4f),
          kind(0.6f, 0.4f, 1),
          kind(1, 0, 1),
          kind(0.6f, 0.4f, 0, 1),
          kind(0.6f, 0.4f, 0, 0, 1),
          kind(1, 0, 0, 0.3f, 0.2f),
          kind(0.6f, 0.4f, 0, 0.5f, 0.5f),
          kind(0.5f, 0.5f, 0.5f, 0.3f, 0.3f)};
}

TEST(Fabric, ReturnsAllLightWhenWhite) {
  for (const Kind& fabric : white_kinds())
    for (const float cos : {1.f, 0.8f, 0.4f, 0.15f, 0.04f}) {
      const FabricBsdf bsdf = fabric.seen(towards(cos, 0.3f));
      // Measured 0.0006, by what interpolates tables.
      EXPECT_NEAR(furnace(bsdf), 1, 0.002) << told(fabric, cos);
      EXPECT_NEAR(bsdf.albedo().x, 1, 1e-4) << told(fabric, cos);
    }
}

TEST(Fabric, ReturnsItsAlbedoWhenItIsNot) {
  for (Kind fabric : white_kinds()) {
    if (fabric.sheen == 1 || fabric.yarn == 1) continue;
    fabric.reflectance *= 0.6f, fabric.transmittance *= 0.5f;
    for (const float cos : {1.f, 0.5f, 0.15f}) {
      const FabricBsdf bsdf = fabric.seen(towards(cos, 0.3f));
      EXPECT_NEAR(furnace(bsdf), bsdf.albedo().x, 0.003) << told(fabric, cos);
      EXPECT_LT(bsdf.albedo().x, 0.95f);
    }
  }
}

// Light that enters goes to and fro between the sheet and the films on its two sides, of which each
// sends a fraction k2 of diffuse light back: added up bounce by bounce. k2 = 1 - (1 - <R>) / n^2.
TEST(Fabric, SoakedIsASheetBetweenTwoFilms) {
  const Kind soaked = kind(0.55f, 0.2f, 1);
  const SheetColours wet = soaked.at().wet;
  const double k2 = 1 - (1 - double(soaked.film.mean_reflected())) / (water * water);
  double front = 1, back = 0, out_front = 0, out_back = 0;
  for (int bounce = 0; bounce < 400; ++bounce) {
    const double r = wet.reflectance.x, t = wet.transmittance.x;
    const double up = r * front + t * back, down = t * front + r * back;
    out_front += up * (1 - k2), out_back += down * (1 - k2);
    front = k2 * up, back = k2 * down;
  }
  for (const float cos : {1.f, 0.4f}) {
    const AlbedoTable::Albedo film = soaked.film.at(cos);
    const double reflected = film.reflected / film.total;
    EXPECT_NEAR(soaked.seen(leaving(cos)).albedo().x,
                reflected + (1 - reflected) * (out_front + out_back), 1e-5);
  }
  // Darker than dry by more than the fibres' part of it, and clearer.
  EXPECT_LT(out_front, 0.55 * 0.6);
  EXPECT_GT(out_back, 0.2);
}

TEST(Fabric, IsBetweenDryAndSoakedInProportion) {
  Tilted t;
  const Kind fabric = kind(0.5f, 0.2f, 0, 0.2f, 0.3f);
  for (int k = 0; k < 2000; ++k) {
    t.next();
    const V3f o = t.outgoing;
    const auto bsdf = [&](float w) { return FabricBsdf(o, t.geometric, t.shading, fabric.at(w)); };
    const FabricBsdf dry = bsdf(0), part = bsdf(0.3f), soaked = bsdf(1);
    t.next();
    const double mixed = 0.7 * value(dry, t.outgoing).x + 0.3 * value(soaked, t.outgoing).x;
    EXPECT_NEAR(value(part, t.outgoing).x, mixed, 1e-5 * mixed + 1e-7);
    EXPECT_NEAR(part.albedo().x, 0.7 * dry.albedo().x + 0.3 * soaked.albedo().x, 1e-5);
  }
}

TEST(Fabric, DrawsWithTheDensityItStates) {
  uint32_t seed = 300;
  std::vector<Kind> kinds = white_kinds();
  for (const Kind& fabric : kinds)
    for (const float cos : {0.9f, 0.3f}) {
      const FabricBsdf bsdf = fabric.seen(towards(cos, 0.3f));
      const ChiSquare fit = chi_square(
          ++seed, [&](std::mt19937& random) { return sample(bsdf, numbers({random})); },
          [&](const V3f& d) { return density(bsdf, d); });
      EXPECT_GT(fit.p_value, least_p(2 * int(kinds.size()))) << told(fabric, cos);
      EXPECT_NEAR(fit.integral, fit.drawn, 0.005) << told(fabric, cos);
    }
}

TEST(Fabric, SamplesTheValueItStates) {
  Tilted t;
  int drawn = 0, wrong = 0;
  const Kind fabric = kind(0.5f, 0.2f, 0, 0.2f, 0.3f);
  for (int k = 0; k < 5000; ++k) {
    t.next();
    for (const float wetness : {0.f, 0.5f, 1.f}) {
      const FabricBsdf bsdf(t.outgoing, t.geometric, t.shading, fabric.at(wetness));
      const Scatter soft = bsdf.soft().sample(t.uniform.two()),
                    glint = bsdf.glints().sample(t.uniform.two());
      if (soft.pdf > 0) ++drawn, wrong += disagreements(bsdf.soft(), soft);
      if (glint.pdf > 0) ++drawn, wrong += disagreements(bsdf.glints(), glint);
    }
  }
  EXPECT_GT(drawn, 15000);
  EXPECT_LT(wrong, drawn / 1000);  // at the grazing rim of the film
}

// f(a, b) = f(b, a), but for what the film's facets give back: that film is left out.
TEST(Fabric, IsReciprocal) {
  Tilted t;
  const Kind fabric = kind(0.5f, 0.2f, 0, 0.2f, 0.3f);
  int compared = 0;
  for (int k = 0; k < 4000; ++k) {
    t.next();
    const V3f n = t.geometric, a = t.outgoing;
    t.next();
    const V3f b = t.outgoing;
    const float cos_a = std::abs(dot(a, n)), cos_b = std::abs(dot(b, n));
    if (cos_a < 0.05f || cos_b < 0.05f) continue;
    for (const float wetness : {0.f, 0.5f, 1.f}) {
      float pdf = 0;
      const FabricPoint point = fabric.at(wetness);
      const double forth = FabricBsdf(a, n, n, point).soft().value(b, pdf).x / cos_b,
                   back = FabricBsdf(b, n, n, point).soft().value(a, pdf).x / cos_a;
      ++compared;
      ASSERT_NEAR(forth, back, 2e-5 * back + 1e-7) << wetness;
      if (wetness > 0) continue;
      const double glint = FabricBsdf(a, n, n, point).glints().value(b, pdf).x / cos_b,
                   again = FabricBsdf(b, n, n, point).glints().value(a, pdf).x / cos_a;
      // Yarns of 0.16 are narrow: a rounding of the facet's normal is 1e-4 of them.
      ASSERT_NEAR(glint, again, 2e-4 * again + 1e-6);
    }
  }
  EXPECT_GT(compared, 3000);
}

// What photons bring is what the lobe makes of their light: irradiance E from one direction leaves
// as E value / |cos|, on flat sheets.
TEST(Fabric, MakesOfPhotonsWhatItMakesOfLight) {
  Tilted t;
  const Kind fabric = kind(0.5f, 0.2f, 0, 0.2f, 0.3f);
  for (int k = 0; k < 300; ++k) {
    t.next();
    const V3f n = t.geometric, o = t.outgoing;
    t.next();
    const float cos = std::abs(dot(t.outgoing, n));
    if (cos < 0.05f) continue;
    for (const float wetness : {0.f, 0.5f}) {
      const FabricBsdf bsdf(o, n, n, fabric.at(wetness));
      Irradiance light;
      bsdf.soft().receive(light, t.outgoing, V3f(2));
      float pdf = 0;
      const double expected = 2 * bsdf.soft().value(t.outgoing, pdf).x / cos;
      EXPECT_NEAR(bsdf.soft().radiance(light).x, expected, 1e-4 * expected + 1e-6);
    }
  }
}

/// The integral of f over the upper hemisphere, in 600 x 600 cells.
template <class F>
double over_hemisphere(const F& f) {
  constexpr int steps = 600;
  double sum = 0;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j)
      sum += double(f(towards(float((i + 0.5) / steps), float(2 * pi64 * (j + 0.5) / steps))));
  return sum * 2 * pi64 / steps / steps;
}

TEST(Sheen, ReturnsWhatItsTableSaysAndShinesAlongTheSurface) {
  for (const float r : {0.1f, 0.3f, 1.f}) {
    const SheenTable table(r);
    for (const float cos : {1.f, 0.5f, 0.1f, 0.01f}) {
      const V3f o = leaving(cos);
      const double returned =
          over_hemisphere([&](const V3f& i) { return table.lobe().over_cos(o, i) * i.z; });
      EXPECT_NEAR(table.at(cos), returned, 0.003) << r << ' ' << cos;
      EXPECT_LE(table.at(cos), 1);
    }
    EXPECT_GT(table.at(0.05f), 2 * table.at(1)) << r;
    double mean = 0;
    for (int k = 0; k < 4000; ++k) {
      const double cos = (k + 0.5) / 4000;
      mean += 2 * cos * double(table.at(float(cos))) / 4000;
    }
    EXPECT_NEAR(table.mean(), mean, 1e-4);
  }
}

TEST(Yarn, ReturnsWhatItsTableSays) {
  for (const float alpha : {0.05f, 0.16f, 1.f}) {
    const YarnTable table(alpha);
    for (const float cos : {0.9f, 0.5f, 0.2f, 0.05f})
      for (const float around : {0.f, 0.4f, 1.1f, 1.57f}) {
        const V3f o = towards(cos, around);
        float pdf = 0;
        const double returned =
            over_hemisphere([&](const V3f& i) { return table.facets().value(o, i, pdf); });
        EXPECT_NEAR(table.at(o), returned, 0.006) << alpha << ' ' << cos << ' ' << around;
        EXPECT_LE(table.at(o), 1);
      }
  }
}

// With a slope of 1 along it as across it a yarn is GGX's isotropic surface of alpha 1.
TEST(Yarn, IsTheIsotropicSurfaceWhenItsFibresWanderThatMuch) {
  Tilted t;
  for (int k = 0; k < 500; ++k) {
    t.next();
    V3f o = t.outgoing, i = t.geometric;
    o.z = std::abs(o.z) + 0.01f, i.z = std::abs(i.z) + 0.01f;
    o = normalized(o), i = normalized(i);
    float pdf = 0;
    const float value = YarnFacets{1}.value(o, i, pdf);
    const GgxReflection::Facet facet = GgxReflection(o, straight_up, straight_up, 1).value(i);
    EXPECT_NEAR(value, facet.value, 1e-4f * facet.value);
    EXPECT_NEAR(pdf, facet.pdf, 1e-4f * facet.pdf);
  }
}

// A cylinder mirrors to where the halfway normal has no part along it: a line across the yarns.
TEST(Yarn, ShinesInALineAcrossIt) {
  const YarnFacets satin{0.05f};
  const V3f o = leaving(0.8f);
  float pdf = 0;
  for (const float around : {0.3f, 0.8f, 1.3f}) {
    // All i whose part along x is -0.6 lie on the cone of the cylinder's mirror directions.
    const V3f on(-o.x, 0.8f * std::sin(around), 0.8f * std::cos(around));
    const V3f off = normalized(V3f(on.x + 0.4f, on.y, on.z));
    EXPECT_GT(satin.value(o, on, pdf), 20 * satin.value(o, off, pdf)) << around;
  }
}

// Warp along u, weft along v, on both faces: what lies on a face seen from below is what lies on
// the one above, mirrored.
TEST(Fabric, HasItsYarnsOnBothFaces) {
  const Kind fabric = kind(0.3f, 0, 0, 0, 0.4f);
  for (const float around : {0.2f, 1.f, 2.5f}) {
    const V3f o = towards(0.7f, around), i = towards(0.6f, around + 2.8f);
    const V3f under_o(o.x, o.y, -o.z), under_i(i.x, i.y, -i.z);
    EXPECT_NEAR(value(fabric.seen(o), i).x, value(fabric.seen(under_o), under_i).x, 1e-5);
  }
  // The halfway normal leans along the sheared weft, across the warp: the warp alone shines.
  FabricPoint point = fabric.at();
  const V3f o = towards(0.8f, float(pi64 / 2)), i = towards(0.3f, float(pi64 / 2));
  float pdf = 0;
  const double both = FabricBsdf(o, straight_up, straight_up, point).glints().value(i, pdf).x;
  point.along_u = point.along_v;
  const double weft = FabricBsdf(o, straight_up, straight_up, point).glints().value(i, pdf).x;
  EXPECT_GT(both, 2 * weft);
}

}  // namespace
}  // namespace drench::render::test
