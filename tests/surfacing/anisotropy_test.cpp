// Sheets and threads: their volume, no holes, wherever and however they lie; bodies and drops stay.

#include "surfacing/anisotropy.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "surfacing/cloth_solid.h"
#include "surfacing/surface.h"
#include "tests/same_bits.h"
#include "tests/surfacing/mesh_checks.h"
#include "tests/surfacing/scenes.h"

namespace drench::surfacing {
namespace {

using namespace surfacing_scenes;
using namespace surfacing_checks;
using Imath::V2i;

constexpr double spacing = 0.01;  // m
constexpr double pi = std::numbers::pi;

SurfaceSettings settings_of(double voxel, SurfaceKernel kernel = SurfaceKernel::anisotropic) {
  SurfaceSettings settings;
  settings.kernel = kernel;
  settings.voxel = voxel;
  return settings;
}
const SurfaceSettings round_kernels = settings_of(0.5, SurfaceKernel::isotropic);

double volume_per_particle(const TriangleMesh& mesh, const ParticleFrame& frame) {
  return volume_of(mesh) / (static_cast<double>(frame.position.size()) * std::pow(spacing, 3));
}

/// Turned by an angle about an axis askew to the lattice, then moved by so many spacings.
ParticleFrame placed(ParticleFrame frame, double angle, V3f shift) {
  frame = askew(frame, angle);
  for (V3f& p : frame.position) p += static_cast<float>(spacing) * shift;
  return frame;
}

/// count particles along X, `stretch` spacings apart, shaken as a sheet's.
ParticleFrame thread(int count, double stretch, uint32_t seed) {
  return sheet(V2i(count, 1), stretch, spacing, 0.1, seed);
}

double spline(double q) {  // support 1, from its two pieces
  if (q >= 1) return 0;
  return q < 0.5 ? 1 - 6 * q * q + 6 * q * q * q : 2 * std::pow(1 - q, 3);
}

/// Integral of W over a plane and over a line at t, by the midpoint rule: within 1e-6.
double over_plane(double t) {
  constexpr int n = 4000;
  double sum = 0;
  for (int k = 0; k < n && t < 1; ++k) {
    const double q = t + (1 - t) * (k + 0.5) / n;
    sum += 2 * pi * q * spline(q) * (1 - t) / n;
  }
  return sum;
}
double over_line(double t) {
  constexpr int n = 4000;
  double sum = 0;
  for (int k = 0; k < n; ++k) {
    const double z = (k + 0.5) / n;
    sum += 2 * spline(std::hypot(t, z)) / n;
  }
  return sum;
}

// A square lattice and a row in double: areal density 1 / stretch^2, linear 1 / stretch. The sum
// over the particles is within 2 % of the integral while they are at most 1.6 spacings apart, the
// thickness that is read from it within 2.8 %.
TEST(ThinWater, IsAsThickAsTheColourSays) {
  constexpr double support = 2.5;
  for (const double stretch : {1.0, 1.2, 1.4, 1.6}) {
    double plane = 0, line = 0;
    for (int i = -4; i <= 4; ++i) {
      for (int k = -4; k <= 4; ++k) plane += spline(stretch * std::hypot(i, k) / support);
      line += spline(stretch * std::abs(i) / support);
    }
    const double scale = 8 / (pi * std::pow(support, 3));
    EXPECT_NEAR(film_thickness(float(plane * scale), support) * stretch * stretch, 1, 0.03);
    EXPECT_NEAR(pi * std::pow(thread_radius(float(line * scale), support), 2) * stretch, 1, 0.03);
  }
}

// The field of a squeezed plane and line is the iso value where the surface should stand, and there
// its second derivative is 0: a hundredth of the greatest, 24, would be 0.2. Support 1.5 and a
// voxel of 1 meet the limits of the squeeze.
TEST(ThinWater, HasTheIsoValueAndTheInflectionAtItsSurface) {
  for (const double support : {1.5, 2.5})
    for (const double voxel : {0.1, 0.25, 0.5, 1.0})
      for (const double thickness : {0.3, 0.6, 1.0}) {
        const ColourKernel kernel(float(support), float(voxel), 0.45f);
        const Squeeze sheet = squeeze_film(float(thickness), float(voxel), kernel);
        const auto plane = [&](double z) {
          return sheet.weight * thickness * 8 / pi * over_plane(z / sheet.half_axis) /
                 sheet.half_axis;
        };
        EXPECT_NEAR(plane(sheet.size), 0.45, 1e-4);
        const double d = 0.02 * sheet.half_axis;
        EXPECT_NEAR((plane(sheet.size + d) - 2 * plane(sheet.size) + plane(sheet.size - d)) /
                        (plane(sheet.size - d) - plane(sheet.size + d)),
                    0, 0.01);
        EXPECT_GE(sheet.half_axis, 0.249 * support);
        EXPECT_LE(sheet.half_axis, 0.901 * support);
        const double radius = 0.56 * thickness;
        const Squeeze line = squeeze_thread(float(radius), float(voxel), kernel);
        const auto round = [&](double r) {
          return 8 * line.weight * radius * radius * over_line(r / line.half_axis) /
                 std::pow(line.half_axis, 2);
        };
        EXPECT_NEAR(round(line.size), 0.45, 1e-4);
        const double e = 0.02 * line.half_axis;
        EXPECT_NEAR((round(line.size + e) - 2 * round(line.size) + round(line.size - e)) /
                        (round(line.size - e) - round(line.size + e)),
                    0, 0.01);
      }
}

// Variances of evenly filled shapes about their mean, weighted by 1 - q^2, in closed form.
TEST(ThinWater, IsToldFromBodies) {
  const Thinness plane = thinness(V3f(1 / 6.f, 1 / 6.f, 0), 5);
  EXPECT_EQ(plane.film, 1);
  EXPECT_EQ(plane.thread, 0);  // a disc
  const Thinness line = thinness(V3f(0.2f, 0, 0), 3);
  EXPECT_EQ(line.film, 0);
  EXPECT_EQ(line.thread, 1);
  for (const float count : {10.f, 30.f}) {  // body, and at its surface
    const Thinness inside = thinness(V3f(1 / 7.f), count);
    EXPECT_EQ(inside.film + inside.thread, 0);
  }
  // Half a ball: along its axis 1/7 - m^2, m = (1/6) / (8/15), from the integrals of z (1 - z^2)^2.
  const float m = 15 / 48.f;
  const Thinness surface = thinness(V3f(1 / 7.f, 1 / 7.f, 1 / 7.f - m * m), 15);
  EXPECT_EQ(surface.film + surface.thread, 0);
  // The rim of a sheet, half a disc: 1/6 - m^2, m = (4/15) / (pi/4), is sheet still.
  const float rim = 1 / 6.f - float(std::pow(16 / (15 * pi), 2));
  EXPECT_EQ(thinness(V3f(1 / 6.f, rim, 0), 3.5f).film, 1);
  // A pair a spacing apart at support 2.5: weights 1 and 0.84, places 0 and 0.4.
  const float second = 0.84f / 1.84f;
  const Thinness pair = thinness(V3f(0.16f * second * (1 - second), 0, 0), 1.84f);
  EXPECT_EQ(pair.film + pair.thread, 0);
  EXPECT_EQ(thinness(V3f(0), 1).thread, 0);  // a drop
}

/// Particles sorted, weighed, with their ellipsoids; voxel 0.5, support 2.5 spacings.
struct Prepared {
  ColourKernel kernel{2.5f, 0.5f, 0.45f};
  BinnedParticles binned;
  std::vector<uint8_t> interior;

  explicit Prepared(const ParticleFrame& frame) {
    Lattice lattice;
    lattice.voxel = 0.5 * spacing;
    lattice.reach = 5, lattice.voxels_per_spacing = 2, lattice.origin = {-64, -64, -64};
    binned = bin_particles(frame.position, lattice);
    interior = count_interior(binned);
    weigh_particles(binned, kernel, interior, SurfaceKernel::anisotropic);
  }
};

// Lattice points against the sum over all particles in double, the square of the distance from the
// matrix of each. Floats: 1e-5, as for round kernels.
TEST(ThinWater, HasTheFieldThatItsEllipsoidsSumTo) {
  const ParticleFrame frame = placed(sheet(V2i(12, 12), 1.3, spacing, 0.2, 1), 0.9, V3f(0.3f));
  const Prepared p(frame);
  ASSERT_GT(p.binned.ellipsoids.shape.size(), 130u);
  const ColourField field =
      evaluate_field(p.binned, p.kernel, p.interior, ClothSolids{}, InteriorBlocks::evaluate, 1e9);
  for (size_t b = 0; b < field.block.size(); ++b)
    for (int k = 0; k < block_size; k += 7) {
      const V3d point(field.block[b].block * block_edge + V3i(k % 8, k / 8 % 8, k / 64));
      double sum = 0;
      for (size_t j = 0; j < p.binned.source.size(); ++j) {
        V3d d = (point - V3d(frame.position[p.binned.source[j]]) / (0.5 * spacing) - V3d(64)) / 5;
        double weight = p.binned.weight[j], square = d.length2();
        if (const Ellipsoid* e = p.binned.ellipsoids.find(uint32_t(j))) {
          d -= V3d(e->shift) / 5;
          weight = e->peak;
          square = e->xx * d.x * d.x + e->yy * d.y * d.y + e->zz * d.z * d.z +
                   2 * (e->xy * d.x * d.y + e->xz * d.x * d.z + e->yz * d.y * d.z);
        }
        sum += weight * p.kernel.scale() * spline(std::sqrt(square));
      }
      EXPECT_NEAR(field.value[b][k], sum, 1e-5 * (1 + sum));
    }
}

// In the middle of an even sheet in the plane Z = 0 the matrix is diagonal, 1 along the sheet and
// (support / half axis)^2 across; the peak has its determinant; the centre stays.
TEST(ThinWater, IsSqueezedAcrossItsSheet) {
  const Prepared p(sheet(V2i(15, 15), 1.2, spacing, 0, 1));
  double colour = 0;
  for (int i = -3; i <= 3; ++i)
    for (int k = -3; k <= 3; ++k) colour += spline(1.2 * std::hypot(i, k) / 2.5);
  const float thickness = film_thickness(float(colour) * p.kernel.scale(), 2.5f);
  const Squeeze squeeze = squeeze_film(thickness, 0.5f, p.kernel);
  const float ratio = 2.5f / squeeze.half_axis;
  size_t seen = 0;
  for (uint32_t j = 0; j < p.binned.source.size(); ++j) {
    if (p.binned.source[j] != 7 * 15 + 7) continue;
    const Ellipsoid* e = p.binned.ellipsoids.find(j);
    ASSERT_TRUE(e);
    EXPECT_NEAR(e->xx, 1, 1e-4);
    EXPECT_NEAR(e->yy, 1, 1e-4);
    EXPECT_NEAR(e->zz, ratio * ratio, 1e-3);
    EXPECT_NEAR(std::abs(e->xy) + std::abs(e->xz) + std::abs(e->yz), 0, 1e-3);
    EXPECT_NEAR(e->peak, squeeze.weight * ratio, 1e-3);
    EXPECT_NEAR(e->shift.length(), 0, 1e-4);
    EXPECT_NEAR(e->pull * (ratio * ratio - 1), 1 - thickness / (2 * squeeze.size), 1e-3);
    ++seen;
  }
  EXPECT_EQ(seen, 1u);
}

struct Lie {
  double angle;
  V3f shift;
};
const std::vector<Lie>& lies() {
  static const std::vector<Lie> all{{0, V3f(0)},
                                    {0, V3f(0, 0, 0.25f)},
                                    {0.5, V3f(0.2f, 0.1f, 0.3f)},
                                    {1.1, V3f(0)},
                                    {2.0, V3f(0.4f, 0.2f, 0.1f)}};
  return all;
}

// One layer, however it lies to the lattice: whole, and 10 % of the volume (the project's reach).
// At 1.5 spacings it is 0.44 thick, less than a voxel.
TEST(ThinSheet, HasNoHoleAndItsVolumeHoweverItLies) {
  for (const double voxel : {0.25, 0.5})
    for (const double stretch : {1.0, 1.2, 1.35, 1.5})
      for (const Lie& lie : lies()) {
        SCOPED_TRACE(fmt::format("voxel {}, stretch {}, angle {}", voxel, stretch, lie.angle));
        const ParticleFrame frame =
            placed(sheet(V2i(36, 36), stretch, spacing, 0.1, 1), lie.angle, lie.shift);
        const TriangleMesh mesh = surface_frame(frame, settings_of(voxel));
        EXPECT_EQ(topology_of(mesh).components, 1u);
        EXPECT_EQ(topology_of(mesh).euler, 2);
        EXPECT_NEAR(volume_per_particle(mesh, frame), 1, 0.1);
        EXPECT_EQ(defects_of(mesh), Defects{});
      }
}

TEST(ThinThread, IsWholeAndHasItsVolumeHoweverItLies) {
  for (const double voxel : {0.25, 0.5})
    for (const double stretch : {1.0, 1.25, 1.5})
      for (const Lie& lie : lies()) {
        SCOPED_TRACE(fmt::format("voxel {}, stretch {}, angle {}", voxel, stretch, lie.angle));
        const ParticleFrame frame = placed(thread(100, stretch, 1), lie.angle, lie.shift);
        const TriangleMesh mesh = surface_frame(frame, settings_of(voxel));
        EXPECT_EQ(topology_of(mesh).components, 1u);
        EXPECT_EQ(topology_of(mesh).euler, 2);
        EXPECT_NEAR(volume_per_particle(mesh, frame), 1, 0.1);
      }
}

// Two layers that a stretch to 1.5 in both directions brought together to 0.44: one sheet. 10 % as
// for one layer; round kernels make it a quarter too thick.
TEST(ThinSheet, OfTwoLayersHasItsVolume) {
  ParticleFrame frame = sheet(V2i(36, 36), 1.5, spacing, 0.1, 1);
  ParticleFrame above = sheet(V2i(36, 36), 1.5, spacing, 0.1, 2);
  for (V3f& p : above.position) p += static_cast<float>(spacing) * V3f(0.75f, 0.75f, 0.444f);
  append(frame, above);
  frame = askew(frame, 1.1);
  const TriangleMesh mesh = surface_frame(frame, {});
  EXPECT_EQ(topology_of(mesh).euler, 2);
  EXPECT_NEAR(volume_per_particle(mesh, frame), 1, 0.1);
  EXPECT_GT(volume_per_particle(surface_frame(frame, round_kernels), frame), 1.15);
}

// Turned particles give the turned mesh, within what the lattice leaves: a tenth of a voxel in the
// mean, half a voxel anywhere. A sheet with a rim, a thread, and what is between.
TEST(ThinWater, TurnsWithItsParticles) {
  ParticleFrame frame = sheet(V2i(24, 24), 1.25, spacing, 0.1, 1);
  append(frame, placed(thread(30, 1.2, 2), 0, V3f(-30, 10, 0)));
  const double angle = 1.1;
  const TriangleMesh still = surface_frame(frame, {});
  ParticleFrame back;  // the vertices of the turned frame's mesh, turned back
  back.position = surface_frame(askew(frame, angle), {}).position;
  back = askew(back, -angle);
  double sum = 0, most = 0;
  size_t count = 0;
  for (size_t v = 0; v < back.position.size(); v += 7, ++count) {
    const double distance = distance_to(still, back.position[v]) / spacing;
    sum += distance, most = std::max(most, distance);
  }
  EXPECT_LT(sum / double(count), 0.05);
  EXPECT_LT(most, 0.25);
}

// Where nothing is thin nothing changes, to the bit: bodies, and drops apart from each other.
TEST(ThinWater, IsNotFoundInBodiesAndDrops) {
  for (const ParticleFrame& frame :
       {relaxed_ball(8000, spacing, 60, 1), lone_particles(300, spacing, 1)})
    test::expect_same_bits(surface_frame(frame, round_kernels), surface_frame(frame, {}));
}

// Pool, crown and drops have the volume of the particles within 5 %.
TEST(ThinWater, HasItsVolumeInASplash) {
  const ParticleFrame mixed = splash(60000, spacing, 3);
  EXPECT_NEAR(volume_per_particle(surface_frame(mixed, {}), mixed), 1, 0.05);
}

TEST(ThinWater, OfRoundKernelsIsClosed) {
  EXPECT_EQ(defects_of(surface_frame(splash(60000, spacing, 3), round_kernels)), Defects{});
  for (const double voxel : {0.25, 0.5, 1.0})
    for (const double per_cell : {0.05, 0.2, 0.5, 1.0}) {
      SCOPED_TRACE(fmt::format("voxel {}, {} a cell", voxel, per_cell));
      const ParticleFrame cloud = random_cloud(3000, per_cell, spacing, 1);
      EXPECT_EQ(defects_of(surface_frame(cloud, settings_of(voxel, SurfaceKernel::isotropic))),
                Defects{});
    }
}

// Water in one layer, stretched, half a spacing from wavy cloth: nothing goes through.
TEST(ThinSheet, DoesNotCrossTheClothItRunsOn) {
  TriangleMesh cloth;
  constexpr int cells = 24;
  const auto height = [](float x, float z) {
    return 1.5f * std::sin(0.5f * x) * std::cos(0.4f * z);
  };
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i)
      cloth.position.push_back(float(spacing) *
                               V3f(float(i), height(float(i), float(j)), float(j)));
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      const auto at = [&](int x, int y) { return uint32_t((j + y) * (cells + 1) + i + x); };
      cloth.triangle.push_back({at(0, 0), at(0, 1), at(1, 1)});
      cloth.triangle.push_back({at(0, 0), at(1, 1), at(1, 0)});
    }
  cloth.velocity.assign(cloth.position.size(), V3f(0));
  const std::vector<TriangleMesh> sheets{cloth};
  for (const float stretch : {1.1f, 1.4f})
    for (const float gap : {0.5f, 0.7f}) {
      SCOPED_TRACE(fmt::format("stretch {}, gap {}", stretch, gap));
      ParticleFrame frame = sheet(V2i(15, 15), stretch, spacing, 0.05, 1);
      for (V3f& p : frame.position) {
        const V3f at = p / float(spacing) + V3f(2, 2, 0);
        p = float(spacing) * V3f(at.x, height(at.x, at.y) + gap + at.z, at.y);
      }
      SurfaceStats stats;
      const TriangleMesh mesh = surface_frame(frame, {}, {sheets}, InteriorBlocks::skip, &stats);
      EXPECT_EQ(defects_of(mesh), Defects{});
      EXPECT_EQ(crossings_of(mesh, cloth), 0u);
      EXPECT_EQ(stats.crossing, 0u);
      EXPECT_GT(stats.contact, 100u);
    }
}

}  // namespace
}  // namespace drench::surfacing
