#pragma once
// Mechanical constants of common fabrics, per width and area of the sheet.

#include <array>
#include <string_view>

namespace drench {

/// A fabric at room climate. Moduli are of a sheet: Young's modulus times thickness.
struct Fabric {
  std::string_view name;
  double areal_density;                    // kg/m^2
  double thickness;                        // m
  double young_warp, young_weft, shear;    // N/m
  double poisson;                          // geometric mean of the two ratios
  double bend_warp, bend_weft, bend_bias;  // N m: moment per width over curvature
  double friction;                         // Coulomb's coefficient on itself
  double stretch_limit;                    // length over rest length where it stiffens
  double damping_time;                     // s, viscosity over stiffness
  double water_capacity;                   // kg/m^2: its pores full
  double soak_time;                        // s: 63 % full under water
  double wet_modulus_ratio;                // moduli and rigidities when full over those when dry
  double wet_friction;                     // as friction, when full
  double contact_angle_deg;                // of water, within the water
  std::string_view source;                 // of what; (e) an estimate within what is published
};

/// KES-F units in SI: bending gf cm^2/cm, shear gf/cm per degree.
constexpr double kes_bending = 9.80665e-5;         // N m
constexpr double kes_shear = 0.980665 * 57.29578;  // N/m per radian

/// Densities of what fabrics are made of, kg/m^3: pores are what it leaves of the thickness.
constexpr double cotton_fibre = 1540, silk_fibre = 1340, wool_fibre = 1310, collagen = 1400;

/// kg/m^2: the pores of a sheet of a given thickness, m, full of water.
constexpr double water_in_pores(double thickness, double areal_density, double fibre_density) {
  return 1000 * (thickness - areal_density / fibre_density);
}

extern const std::array<Fabric, 8> fabrics;

/// nullptr if there is none of that name.
const Fabric* find_fabric(std::string_view name);

/// m, Peirce's bending length (B / (g rho))^(1/3) along warp: 15 mm drape, 30 mm stand stiff.
double bending_length(const Fabric& fabric);

}  // namespace drench
