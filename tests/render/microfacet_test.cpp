// Rough surfaces one by one: densities, energy, reciprocity, limits.

#include <gtest/gtest.h>

#include "render/bsdf/bsdf_coated.h"
#include "render/bsdf/bsdf_metal.h"
#include "render/bsdf/bsdf_rough.h"
#include "tests/render/lobes.h"

namespace drench::render::test {
namespace {

RoughBsdf rough(float cos, float alpha, float eta, const AlbedoTable& albedo) {
  return {leaving(cos), straight_up, straight_up, alpha, eta, albedo};
}

MetalBsdf metal(float cos, float alpha, const MetalFresnel& fresnel, const AlbedoTable& albedo) {
  return {leaving(cos), straight_up, straight_up, alpha, fresnel, albedo};
}

CoatedBsdf coated(float cos, float alpha, float eta, float reflectance, const AlbedoTable& coat) {
  return {leaving(cos), straight_up, straight_up, alpha, eta, V3f(reflectance), coat};
}

const MetalFresnel mirror(V3f(1), V3f(1));

Scatter sample(const RoughBsdf& bsdf, const Draw& u) { return bsdf.sample(u.point, u.side); }
Scatter sample(const MetalBsdf& bsdf, const Draw& u) { return bsdf.sample(u.point); }
Scatter sample(const CoatedBsdf& bsdf, const Draw& u) {
  return u.side < bsdf.coat_probability() ? bsdf.coat().sample(u.point)
                                          : bsdf.base().sample(u.point);
}

template <class Bsdf>
double furnace(const Bsdf& bsdf) {
  return furnace_of([&](const Draw& u) { return sample(bsdf, u); });
}

double density(const RoughBsdf& bsdf, const V3f& d) {
  float pdf = 0;
  bsdf.value(d, pdf);
  return pdf;
}

double density(const MetalBsdf& bsdf, const V3f& d) {
  float pdf = 0;
  bsdf.value(d, pdf);
  return pdf;
}

double density(const CoatedBsdf& bsdf, const V3f& d) {
  float coat = 0, base = 0;
  bsdf.coat().value(d, coat);
  bsdf.base().value(d, base);
  return double(coat) + base;
}

// Half a percent at any angle, from both sides. 40,000 weights of at most 2.5 that differ by a
// third of their mean: four standard errors are 0.7 % at the very worst, mostly below 0.2 %.
TEST(RoughDielectric, ReturnsAllLightInAWhiteFurnace) {
  for (const float alpha : {0.01f, 0.05f, 0.2f, 0.5f, 1.f})
    for (const float index : {1.1f, 1.333f, 1.5f, 2.4f})
      for (const float eta : {index, 1 / index}) {
        const AlbedoTable albedo = AlbedoTable::dielectric(alpha, eta);
        for (const float cos : {1.f, 0.8f, 0.65f, 0.4f, 0.15f, 0.04f, 0.01f}) {
          const RoughBsdf bsdf = rough(cos, alpha, eta, albedo);
          EXPECT_NEAR(furnace(bsdf), 1, 0.005) << alpha << ' ' << eta << ' ' << cos;
        }
      }
}

TEST(Metal, ReturnsAllLightInAWhiteFurnace) {
  for (const float alpha : {0.f, 0.01f, 0.05f, 0.2f, 0.5f, 1.f}) {
    const AlbedoTable albedo = AlbedoTable::mirrors(alpha);
    for (const float cos : {1.f, 0.8f, 0.4f, 0.15f, 0.04f, 0.01f}) {
      const MetalBsdf bsdf = metal(cos, alpha, mirror, albedo);
      EXPECT_NEAR(furnace(bsdf), 1, 0.005) << alpha << ' ' << cos;
      EXPECT_NEAR(bsdf.albedo().x, 1, 1e-5);
    }
  }
}

TEST(Coated, ReturnsAllLightOverAWhiteBaseAndLessOverAnother) {
  for (const float alpha : {0.f, 0.01f, 0.1f, 0.4f, 1.f})
    for (const float eta : {1.125f, 1.5f, 2.f}) {
      const AlbedoTable coat = AlbedoTable::dielectric(alpha, eta);
      for (const float cos : {1.f, 0.8f, 0.4f, 0.15f, 0.04f}) {
        const CoatedBsdf white = coated(cos, alpha, eta, 1, coat);
        EXPECT_NEAR(furnace(white), 1, 0.005) << alpha << ' ' << eta << ' ' << cos;
        const CoatedBsdf grey = coated(cos, alpha, eta, 0.5f, coat);
        const double returned = furnace(grey);
        EXPECT_NEAR(returned, grey.albedo().x, 0.005);
        EXPECT_LT(returned, 0.95);
        EXPECT_GT(returned, coat.at(cos).reflected);
      }
    }
}

// Saunderson's correction in closed form: a smooth coat of index 1.5 reflects 0.04 of light that
// faces it and a mean of 0.0918, so that k2 = 1 - 0.9082 / 2.25 = 0.5964 (Judd 1942 has both).
TEST(Coated, IsSaundersonsBase) {
  const AlbedoTable coat = AlbedoTable::dielectric(0, 1.5f);
  EXPECT_NEAR(coat.at(1).reflected, 0.04, 1e-6);
  EXPECT_NEAR(coat.mean_reflected(), 0.0918, 1e-4);
  const double base = 0.4036 * 0.5 / (1 - 0.5964 * 0.5);
  EXPECT_NEAR(coated(1, 0, 1.5f, 0.5f, coat).albedo().x, 0.04 + 0.96 * base, 2e-4);
}

TEST(Facets, ReturnNoMoreThanArrivesBeforeWhatIsGivenBack) {
  for (const float alpha : {0.01f, 0.1f, 0.5f, 1.f})
    for (const float eta : {0.4f, 0.75f, 1.1f, 1.5f, 2.4f}) {
      const AlbedoTable table = AlbedoTable::dielectric(alpha, eta);
      for (float cos = 0; cos <= 1; cos += 0.01f) {
        ASSERT_LE(table.at(cos).total, 1.00001f);
        ASSERT_GT(table.at(cos).total, 0.25f);  // so that no lobe grows by more than four
        ASSERT_GE(table.at(cos).reflected, 0);
      }
    }
}

TEST(RoughDielectric, DrawsWithTheDensityItStates) {
  uint32_t seed = 1;
  for (const float alpha : {0.15f, 0.4f, 1.f})
    for (const float eta : {1.5f, 1 / 1.5f, 2.4f, 1 / 1.1f})
      for (const float cos : {0.9f, 0.5f, 0.1f}) {
        const RoughBsdf bsdf = rough(cos, alpha, eta, AlbedoTable());
        const ChiSquare fit = chi_square(
            ++seed, [&](std::mt19937& random) { return sample(bsdf, numbers({random})); },
            [&](const V3f& d) { return density(bsdf, d); });
        EXPECT_GT(fit.p_value, least_p(36)) << alpha << ' ' << eta << ' ' << cos;
        // Of those drawn, since some facets' directions end on the wrong side. 4 sigma are 0.0045.
        EXPECT_NEAR(fit.integral, fit.drawn, 0.005) << alpha << ' ' << eta << ' ' << cos;
      }
}

TEST(Metal, DrawsWithTheDensityItStates) {
  uint32_t seed = 100;
  for (const float alpha : {0.15f, 0.4f, 1.f})
    for (const float cos : {0.9f, 0.5f, 0.1f}) {
      const MetalBsdf bsdf = metal(cos, alpha, mirror, AlbedoTable());
      const ChiSquare fit = chi_square(
          ++seed, [&](std::mt19937& random) { return sample(bsdf, numbers({random})); },
          [&](const V3f& d) { return density(bsdf, d); });
      EXPECT_GT(fit.p_value, least_p(9)) << alpha << ' ' << cos;
      EXPECT_NEAR(fit.integral, fit.drawn, 0.005) << alpha << ' ' << cos;
      // The bound leaves few below the horizon: visible normals alone lose a third at alpha 1.
      EXPECT_GT(fit.drawn, 0.85);
    }
}

TEST(Coated, DrawsWithTheDensityItStates) {
  uint32_t seed = 200;
  for (const float alpha : {0.15f, 0.4f, 1.f})
    for (const float cos : {0.9f, 0.3f}) {
      const AlbedoTable coat = AlbedoTable::dielectric(alpha, 1.5f);
      const CoatedBsdf bsdf = coated(cos, alpha, 1.5f, 0.6f, coat);
      const ChiSquare fit = chi_square(
          ++seed, [&](std::mt19937& random) { return sample(bsdf, numbers({random})); },
          [&](const V3f& d) { return density(bsdf, d); });
      EXPECT_GT(fit.p_value, least_p(6)) << alpha << ' ' << cos;
      EXPECT_NEAR(fit.integral, fit.drawn, 0.005) << alpha << ' ' << cos;
    }
}

// About normals bent off the real surface, from any side.
TEST(Facets, DrawWithTheDensityTheyStateAboutBentNormals) {
  constexpr int frames = 5;
  constexpr float facet_alpha = 0.3f;
  const AlbedoTable glass = AlbedoTable::dielectric(facet_alpha, 1.5f),
                    mirrors = AlbedoTable::mirrors(facet_alpha);
  uint32_t seed = 400;
  Tilted t;
  const auto check = [&](const auto& bsdf, const char* name) {
    const ChiSquare fit = chi_square(
        ++seed, [&](std::mt19937& random) { return sample(bsdf, numbers({random})); },
        [&](const V3f& d) { return density(bsdf, d); });
    EXPECT_GT(fit.p_value, least_p(3 * frames)) << name << ' ' << seed;
    EXPECT_NEAR(fit.integral, fit.drawn, 0.005) << name << ' ' << seed;
  };
  for (int k = 0; k < frames; ++k) {
    t.next();
    const V3f &o = t.outgoing, &g = t.geometric, &n = t.shading;
    check(RoughBsdf(o, g, n, facet_alpha, 1.5f, glass), "rough");
    check(MetalBsdf(o, g, n, facet_alpha, mirror, mirrors), "metal");
    check(CoatedBsdf(o, g, n, facet_alpha, 1.5f, V3f(0.6f), glass), "coated");
  }
}

TEST(Facets, SampleTheValueTheyState) {
  Tilted t;
  const float alpha = 0.3f;
  const AlbedoTable glass = AlbedoTable::dielectric(alpha, 1.5f);
  const AlbedoTable within = AlbedoTable::dielectric(alpha, 1 / 1.5f);
  const AlbedoTable mirrors = AlbedoTable::mirrors(alpha);
  const MetalFresnel gold(V3f(1, 0.75f, 0.35f), V3f(1, 0.9f, 0.7f));
  int drawn = 0, wrong = 0, wrong_side = 0;
  const auto check = [&](const auto& lobe, const Scatter& s) {
    if (!(s.pdf > 0)) return;
    ++drawn;
    wrong += disagreements(lobe, s);
  };
  for (int k = 0; k < 20000; ++k) {
    t.next();
    const V3f &o = t.outgoing, &g = t.geometric, &n = t.shading;
    for (const AlbedoTable* table : {&glass, &within}) {
      const RoughBsdf bsdf(o, g, n, alpha, table == &glass ? 1.5f : 1 / 1.5f, *table);
      check(bsdf, sample(bsdf, numbers(t.uniform)));
    }
    const MetalBsdf metal(o, g, n, alpha, gold, mirrors);
    const CoatedBsdf coated(o, g, n, alpha, 1.5f, V3f(0.4f), glass);
    for (const Scatter& s : {metal.sample(t.uniform.two()), coated.coat().sample(t.uniform.two()),
                             coated.base().sample(t.uniform.two())})
      wrong_side += s.pdf > 0 && dot(s.direction, g) * dot(o, g) <= 0;
    check(metal, metal.sample(t.uniform.two()));
    check(coated.coat(), coated.coat().sample(t.uniform.two()));
    check(coated.base(), coated.base().sample(t.uniform.two()));
  }
  EXPECT_GT(drawn, 75000);
  EXPECT_LT(wrong, drawn / 1000);  // at the grazing rim, where a bit of the normal is a percent
  EXPECT_EQ(wrong_side, 0);
}

// f / eta^2 of one way is f of the other, for radiance over the squared index; before what further
// facets give back. 1e-5 of it: a few roundings, squared by the distribution of normals.
TEST(RoughDielectric, IsReciprocal) {
  Tilted t;
  const AlbedoTable none;
  int compared = 0;
  for (int k = 0; k < 4000; ++k) {
    t.next();
    const V3f n = t.geometric, a = t.outgoing;
    t.next();
    const V3f b = t.outgoing;
    const float cos_a = std::abs(dot(a, n)), cos_b = std::abs(dot(b, n));
    if (cos_a < 0.05f || cos_b < 0.05f) continue;
    const float alpha = 0.5f, eta = 1.5f;
    const bool through = dot(a, n) * dot(b, n) < 0;
    float pdf = 0;
    const double forth = RoughBsdf(a, n, n, alpha, eta, none).value(b, pdf).x / cos_b;
    const double back =
        RoughBsdf(b, n, n, alpha, through ? 1 / eta : eta, none).value(a, pdf).x / cos_a;
    if (forth == 0 && back == 0) continue;
    ++compared;
    ASSERT_NEAR(through ? forth / (eta * eta) : forth, back, 1e-5 * back + 1e-7);
  }
  EXPECT_GT(compared, 2000);
}

TEST(Metal, IsReciprocalBeforeWhatIsGivenBack) {
  Tilted t;
  const AlbedoTable none;
  const MetalFresnel gold(V3f(1, 0.75f, 0.35f), V3f(1, 0.9f, 0.7f));
  for (int k = 0; k < 4000; ++k) {
    t.next();
    const V3f n = t.geometric, a = t.outgoing;
    t.next();
    const V3f b = t.outgoing;
    const float cos_a = std::abs(dot(a, n)), cos_b = std::abs(dot(b, n));
    if (cos_a < 0.05f || cos_b < 0.05f) continue;
    float pdf = 0;
    const V3f forth = MetalBsdf(a, n, n, 0.5f, gold, none).value(b, pdf) * (1 / cos_b);
    const V3f back = MetalBsdf(b, n, n, 0.5f, gold, none).value(a, pdf) * (1 / cos_a);
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(forth[c], back[c], 1e-5f * back[c] + 1e-7f);
  }
}

// The base by its factors of either direction, whatever the coat; the coat before what its facets
// give back, which is by the one that light leaves to.
TEST(Coated, IsReciprocalButForWhatTheCoatGivesBack) {
  Tilted t;
  const AlbedoTable none, glass = AlbedoTable::dielectric(0.25f, 1.5f);
  int compared = 0;
  for (int k = 0; k < 4000; ++k) {
    t.next();
    const V3f n = t.geometric, a = t.outgoing;
    t.next();
    const V3f b = t.outgoing;
    const float cos_a = std::abs(dot(a, n)), cos_b = std::abs(dot(b, n));
    if (cos_a < 0.05f || cos_b < 0.05f || dot(a, n) * dot(b, n) < 0) continue;
    const auto seen = [&](const V3f& o, const AlbedoTable& coat) {
      return CoatedBsdf(o, n, n, 0.25f, 1.5f, V3f(0.6f), coat);
    };
    float pdf = 0;
    const double base = seen(a, glass).base().value(b, pdf).x / cos_b,
                 base_back = seen(b, glass).base().value(a, pdf).x / cos_a,
                 coat = seen(a, none).coat().value(b, pdf).x / cos_b,
                 coat_back = seen(b, none).coat().value(a, pdf).x / cos_a;
    ++compared;
    ASSERT_NEAR(base, base_back, 1e-5 * base + 1e-7);
    ASSERT_NEAR(coat, coat_back, 1e-4 * coat + 1e-7);  // roundings, squared by facets of 0.25
  }
  EXPECT_GT(compared, 1000);
}

// The model's three numbers: facing, at acos(1/7) = 81.8 degrees, and white at grazing.
TEST(Metal, HasTheColoursItIsGiven) {
  const V3f facing(0.9f, 0.5f, 0.2f), edge(1, 0.8f, 0.3f);
  const MetalFresnel fresnel(facing, edge);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(fresnel.at(1)[c], facing[c], 1e-6);
    const double schlick = facing[c] + (1 - facing[c]) * std::pow(6. / 7, 5);
    EXPECT_NEAR(fresnel.at(1 / 7.f)[c], schlick * edge[c], 1e-6);
    EXPECT_NEAR(fresnel.at(0)[c], 1, 1e-6);
    double mean = 0;
    for (int k = 0; k < 10000; ++k) {
      const double cos = (k + 0.5) / 10000;
      mean += 2 * cos * fresnel.at(float(cos))[c] / 10000;
    }
    EXPECT_NEAR(fresnel.mean()[c], mean, 2e-4);
  }
}

// Facets of 1e-4 stand as one: Fresnel's part goes the mirror's direction, the rest by Snell's law.
TEST(RoughDielectric, BecomesTheSmoothOne) {
  for (const float eta : {1.5f, 1 / 1.5f})
    for (const float cos : {1.f, 0.9f, 0.5f}) {
      const AlbedoTable table = AlbedoTable::dielectric(1e-4f, eta);
      const RoughBsdf bsdf = rough(cos, 1e-4f, eta, table);
      const InterfaceSplit split = split_at_interface(-leaving(cos), straight_up, eta);
      std::mt19937 random(3);
      double reflected = 0, far = 0;
      constexpr int draws = 40000;
      for (int k = 0; k < draws; ++k) {
        const Scatter s = sample(bsdf, numbers({random}));
        ASSERT_GT(s.pdf, 0);
        ASSERT_NEAR(s.weight.x, 1, 1e-3);
        const bool through = bsdf.through(s.direction);
        reflected += through ? 0. : 1. / draws;
        const V3f off = s.direction - (through ? split.refracted : split.reflected);
        far += off.length() > 0.01f ? 1. / draws : 0.;
      }
      // Facets turn a mirrored ray by twice their slope: alpha^2 / 0.005^2 of GGX's are steeper
      // than that, 0.0004, and seen from aslant up to three times as many.
      EXPECT_LT(far, 0.002);
      const double r = split.reflectance;
      EXPECT_NEAR(reflected, r, 4 * std::sqrt(r * (1 - r) / draws) + 1e-4);
      EXPECT_NEAR(table.at(cos).reflected, r, 1e-3);
    }
}

}  // namespace
}  // namespace drench::render::test
