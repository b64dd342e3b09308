#include "sim/cloth_strain.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/passes/cloth/shell_membrane.h"

namespace drench::sim {

namespace {

using Vector = cpu::Vec3<double>;

/// Principal strains and stresses of triangles.
class TriangleStrain {
 public:
  TriangleStrain(const ClothTopology& cloth, const HostState& state, double softness)
      : cloth_(cloth), state_(state), softness_(softness) {}

  double area(int t) const { return cloth_.shell.area[size_t(t)]; }

  std::array<double, 4> at(int t) const {
    const ShellTopology& s = cloth_.shell;
    const auto gradient = [&](int k) { return double(s.gradient[k][size_t(t)]); };
    const cpu::RestTriangle<double> rest{
        area(t), {gradient(0), gradient(1)}, {gradient(2), gradient(3)}};
    const Vector a = corner(t, 0);
    const auto f = cpu::surface_gradient(rest, {0, 0, 0}, corner(t, 1) - a, corner(t, 2) - a);
    const cpu::Symmetric2<double> strain = cpu::green_strain(f);
    const auto stretch = cpu::spectrum_of(strain);
    const auto longer = [](double e) { return std::sqrt(std::max(1 + 2 * e, 0.)) - 1; };
    const auto stress = principal_stress(strain, law(cloth_.sheet[size_t(t)]).at(strain));
    return {longer(stretch.high), longer(stretch.low), stress[0], stress[1]};
  }

 private:
  /// Where a corner stands, with what its vertex' place rounds off.
  Vector corner(int t, int c) const {
    const size_t k = 3 * size_t(t) + size_t(c);
    const auto v = size_t(cloth_.corner[k]);
    const auto at = [v](const HostVec& column) {
      return Vector{column.x[v], column.y[v], column.z[v]};
    };
    Vector x = at(state_.cloth_position);
    if (cpu::length2(x - at(state_.shell_landed)) == 0) x = x + at(state_.shell_rounding);
    const HostVec& shift = cloth_.corner_shift;
    if (shift.size() > 0) x = x + Vector{shift.x[k], shift.y[k], shift.z[k]};
    return x;
  }

  struct Elastic {
    cpu::Moduli<double> moduli;
    cpu::StrainLimit<double> limit;
    cpu::Symmetric2<double> at(const cpu::Symmetric2<double>& strain) const {
      return moduli.times(strain) + limit.at(strain).stress;
    }
  };
  Elastic law(int sheet) const {
    const ShellLaw& l = cloth_.shell.law[size_t(sheet)];
    const cpu::Moduli<double> dry{l.c11, l.c22, l.c12, l.c66, 0, 0};
    return {dry * softness_, {l.limit_start, l.limit_stiffness}};
  }

  /// Of Cauchy's stress F S F^T / J: its trace is S : C / J and its determinant that of S, as J^2
  /// is that of C = F^T F = 1 + 2 E.
  static std::array<double, 2> principal_stress(const cpu::Symmetric2<double>& e,
                                                const cpu::Symmetric2<double>& s) {
    const cpu::Symmetric2<double> c{1 + 2 * e.xx, 1 + 2 * e.yy, 2 * e.xy};
    const double j = std::sqrt(std::max(c.xx * c.yy - c.xy * c.xy, 1e-12));
    const double mean = 0.5 * cpu::contract(s, c) / j, determinant = s.xx * s.yy - s.xy * s.xy;
    const double radius = std::sqrt(std::max(mean * mean - determinant, 0.));
    return {mean + radius, mean - radius};
  }

  const ClothTopology& cloth_;
  const HostState& state_;
  double softness_;
};

/// Of a sheet over that of the dry one (passes/cloth/wet_cloth.h).
double stiffness_when_wet(const ClothTopology& cloth, const HostState& state, VertexRange sheet) {
  if (cloth.wet.empty()) return 1;
  double water = 0, mass = 0;
  for (size_t v = size_t(sheet.first); v < size_t(sheet.first + sheet.count); ++v)
    water += double(cloth.mass[v]) * state.cloth_wetness[v], mass += double(cloth.mass[v]);
  return 1 + (double(cloth.wet[size_t(cloth.sheet_of(sheet.first))].stiffness) - 1) * water / mass;
}

}  // namespace

std::vector<ClothStrain> cloth_strain(const ClothTopology& cloth, const HostState& state,
                                      VertexRange vertices) {
  const TriangleStrain strain(cloth, state, stiffness_when_wet(cloth, state, vertices));
  std::vector<ClothStrain> all;
  for (int v = vertices.first; v < vertices.first + vertices.count; ++v) {
    double sum[4] = {0, 0, 0, 0}, area = 0;
    for (int e = cloth.fan_start[size_t(v)]; e < cloth.fan_start[size_t(v) + 1]; ++e) {
      const int t = cloth.fan_entry[size_t(e)] / 3;
      const std::array<double, 4> of = strain.at(t);
      for (size_t k = 0; k < 4; ++k) sum[k] += of[k] * strain.area(t);
      area += strain.area(t);
    }
    all.push_back(
        {float(sum[0] / area), float(sum[1] / area), float(sum[2] / area), float(sum[3] / area)});
  }
  return all;
}

}  // namespace drench::sim
