#pragma once
// Corrected gradients (Randles and Libersky 1996; Bonet and Lok 1999): L_i grad W_ij in place of
// grad W_ij makes the rate of density that of the volume for velocities linear in space,
//   L_i = M_i^-1 tr M_i / 3,   M_i = sum_j m / rho_0 (x_j - x_i) (grad W_ij)^T.
// The factor leaves an even expansion to count as the kernel's sum counts it, so that a solve still
// finds the density it is asked for. Without L a flow that shears the arrangement of neighbours
// without changing any volume changes the sum all the same, and pressures resist it: waves die and
// vortices slow.
//
// M is averaged over the neighbours. Its own value, one particle at a time, keeps more of a wave
// but makes packings under weight boil (docs/decisions/0003-averaged-gradient-correction.md): rows
// are then far from the gradient of the density that is taken back to rest, and what differs does
// work round closed paths. What a packing has in common with its
// neighbourhood resists shear; what a particle has of its own averages to nothing.
// Beside walls, sheets and obstacles and at free surfaces, where half of the neighbours are
// missing, L is that of the particles farther in, or 1.

#include "sim/neighbours/periodic.h"
#include "sim/neighbours/sph_kernels.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// M of every particle that has fluid all around, xx, yy, zz and 1 in one column, xy, yz, zx in the
/// other; 0 for others.
template <class Separation>
struct GradientMoments {
  static constexpr int columns = 1;
  const Float4 *place, *wall;
  const float* density;
  Float4 *diagonal, *cross;
  float scale;  // m / (rho_0 h^5) over the lattice sum, 1/m^2
  float least;  // kg/m^3, of the fluid's own density
  Separation separation;

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<1> inputs() const { return {{place}}; }
  template <class Q>
  struct Particle {
    Q place;
  };
  template <class Q>
  struct Sum {
    Q diagonal, cross;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return WendlandC2::slope(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    const Q r = separation(i.place, j.place), wr = weight * r;
    sum.diagonal = multiply_add(wr, r, sum.diagonal);
    sum.cross = multiply_add(wr, rotate(r), sum.cross);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const bool surrounded = density[i] - wall[i].w >= least;
    const float s = surrounded ? scale : 0.f;
    const Float4 d = sum.diagonal, c = sum.cross;
    diagonal[i] = {s * d.x, s * d.y, s * d.z, surrounded ? 1.f : 0.f};
    cross[i] = {s * c.x, s * c.y, s * c.z, 0.f};
  }
};

/// L of M, both with diagonal and cross entries, M times diagonal.w; 1 where there is none or where
/// M is far from 1.
DRENCH_HD void invert_moments(const Float4& d, const Float4& c, Float4& diagonal, Float4& cross) {
  diagonal = {1.f, 1.f, 1.f, 0.f}, cross = {0.f, 0.f, 0.f, 0.f};
  if (d.w == 0.f) return;
  const float w = 1.f / d.w, x = w * d.x, y = w * d.y, z = w * d.z;
  const float xy = w * c.x, yz = w * c.y, zx = w * c.z;
  const float xx = y * z - yz * yz, xxy = yz * zx - xy * z, xzx = xy * yz - y * zx;  // cofactors
  const float determinant = x * xx + xy * xxy + zx * xzx;
  if (determinant < 0.5f) return;  // flattened by an impact
  const float f = (x + y + z) / (3.f * determinant);
  diagonal = {f * xx, f * (x * z - zx * zx), f * (x * y - xy * xy), 0.f};
  cross = {f * xxy, f * (xy * zx - x * yz), f * xzx, 0.f};
}

/// L of the mean of M.
struct GradientCorrection {
  static constexpr int columns = 2;
  const Float4 *moment, *moment_cross, *wall;
  Float4 *diagonal, *cross;

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<2> inputs() const { return {{moment, moment_cross}}; }
  template <class Q>
  struct Particle {
    Q diagonal, cross;
  };
  template <class Q>
  struct Sum {
    Q diagonal, cross;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return u;
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>&, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    sum.diagonal = multiply_add(weight, j.diagonal, sum.diagonal);
    sum.cross = multiply_add(weight, j.cross, sum.cross);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 d = sum.diagonal, c = sum.cross;
    const float seen = wall[i].w > 0.f ? 0.f : d.w;
    invert_moments({d.x, d.y, d.z, seen}, c, diagonal[i], cross[i]);
  }
};

/// L of every particle, from positions, walls and densities. Uses PressureState::scratch_a and
/// scratch_b.
void correct_gradients(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
