#include "pipeline/contract/shot/fabrics.h"

#include <algorithm>
#include <cmath>

namespace drench {

// Woven moduli are secants up to 490 N/m, 490 over the extension EMT of KES-F, but for denim, whose
// are of small strains; so sheets that hang under their own weight alone may stretch more.
// Rigidities that are not measured are set by the bending length at which a fabric's drape
// coefficient (Cusick's, 30 cm on 18 cm) is published: about 15 mm for 30 %, 20 for 50, 23 for 68,
// 29 for 80.
const std::array<Fabric, 8> fabrics = {{
    {.name = "cotton",
     .areal_density = 0.15,
     .thickness = 0.35e-3,
     .young_warp = 12000,
     .young_weft = 8000,
     .shear = 1.2 * kes_shear,
     .poisson = 0.2,
     .bend_warp = 0.20 * kes_bending,
     .bend_weft = 0.14 * kes_bending,
     .bend_bias = 0.13 * kes_bending,
     .friction = 0.5,
     .stretch_limit = 1.05,
     .damping_time = 0.005,
     .water_capacity = water_in_pores(0.35e-3, 0.15, cotton_fibre),
     .contact_angle_deg = 40.8,
     .source = "bending: drape 68 % (Gan, Ly and Steven 1991); contact angle: Fei et al. 2018; "
               "(e) others, KES-F plain weaves"},
    {.name = "silk",
     .areal_density = 0.065,
     .thickness = 0.18e-3,
     .young_warp = 10000,
     .young_weft = 6000,
     .shear = 0.35 * kes_shear,
     .poisson = 0.2,
     .bend_warp = 0.020 * kes_bending,
     .bend_weft = 0.015 * kes_bending,
     .bend_bias = 0.013 * kes_bending,
     .friction = 0.3,
     .stretch_limit = 1.06,
     .damping_time = 0.005,
     .water_capacity = water_in_pores(0.18e-3, 0.065, silk_fibre),
     .contact_angle_deg = 60,
     .source = "bending: drape 20-40 % (Matsudaira and Yang 2003); (e) others, KES-F habutae and "
               "crepe"},
    {.name = "wool",
     .areal_density = 0.2,
     .thickness = 0.5e-3,
     .young_warp = 9000,
     .young_weft = 6000,
     .shear = 0.7 * kes_shear,
     .poisson = 0.2,
     .bend_warp = 0.15 * kes_bending,
     .bend_weft = 0.11 * kes_bending,
     .bend_bias = 0.10 * kes_bending,
     .friction = 0.4,
     .stretch_limit = 1.08,
     .damping_time = 0.008,
     .water_capacity = water_in_pores(0.5e-3, 0.2, wool_fibre),
     .contact_angle_deg = 100,
     .source =
         "weight: suitings of 0.125-0.258 kg/m2 (Leung et al. 2000); (e) others, KES-F worsted "
         "suiting, drape 40-70 %"},
    {.name = "denim",
     .areal_density = 0.324,
     .thickness = 0.8e-3,
     .young_warp = 1014,
     .young_weft = 205,
     .shear = 2.0 * kes_shear,
     .poisson = 0.05,
     .bend_warp = 97e-6,
     .bend_weft = 64e-6,
     .bend_bias = 73e-6,
     .friction = 0.5,
     .stretch_limit = 1.05,
     .damping_time = 0.008,
     .water_capacity = water_in_pores(0.8e-3, 0.324, cotton_fibre),
     .contact_angle_deg = 60,
     .source =
         "weight, moduli, bending: 11 oz denim at small strains (Wang, O'Brien and Ramamoorthi "
         "2011); shear, extension: denims of doi 10.1155/2016/4614168; (e) others"},
    {.name = "canvas",
     .areal_density = 0.41,
     .thickness = 0.75e-3,
     .young_warp = 25000,
     .young_weft = 18000,
     .shear = 4.0 * kes_shear,
     .poisson = 0.2,
     .bend_warp = 2.5 * kes_bending,
     .bend_weft = 1.7 * kes_bending,
     .bend_bias = 1.6 * kes_bending,
     .friction = 0.5,
     .stretch_limit = 1.03,
     .damping_time = 0.008,
     .water_capacity = water_in_pores(0.75e-3, 0.41, cotton_fibre),
     .contact_angle_deg = 60,
     .source = "(e) cotton duck of 12 oz/yd2, bending length 40 mm"},
    {.name = "leather",
     .areal_density = 0.52,
     .thickness = 0.8e-3,
     .young_warp = 6000,
     .young_weft = 6000,
     .shear = 2100,
     .poisson = 0.4,
     .bend_warp = 0.5 * kes_bending,
     .bend_weft = 0.5 * kes_bending,
     .bend_bias = 0.5 * kes_bending,
     .friction = 0.6,
     .stretch_limit = 1.2,
     .damping_time = 0.01,
     .water_capacity = water_in_pores(0.8e-3, 0.52, collagen),
     .contact_angle_deg = 90,
     .source = "thickness 0.64-0.96 mm, drape 47-70 %: sheep garment leather (Memon et al. 2021); "
               "(e) others"},
    {.name = "felt",
     .areal_density = 0.4,
     .thickness = 2e-3,
     .young_warp = 1000,
     .young_weft = 1000,
     .shear = 385,
     .poisson = 0.3,
     .bend_warp = 3.7e-4,
     .bend_weft = 3.7e-4,
     .bend_bias = 3.7e-4,
     .friction = 0.6,
     .stretch_limit = 1.15,
     .damping_time = 0.01,
     .water_capacity = water_in_pores(2e-3, 0.4, wool_fibre),
     .contact_angle_deg = 110,
     .source = "(e) pressed wool felt of 200 kg/m3 and 0.5 MPa, bending by E h^3/(12 (1 - nu^2))"},
    {.name = "rubber",
     .areal_density = 1.1,
     .thickness = 1e-3,
     .young_warp = 1500,
     .young_weft = 1500,
     .shear = 500,
     .poisson = 0.49,
     .bend_warp = 1.65e-4,
     .bend_weft = 1.65e-4,
     .bend_bias = 1.65e-4,
     .friction = 1.1,
     .stretch_limit = 3,
     .damping_time = 0.003,
     .water_capacity = 0,
     .contact_angle_deg = 105,
     .source =
         "(e) soft natural rubber of 1.5 MPa and 1100 kg/m3, bending by E h^3/(12 (1 - nu^2))"},
}};

const Fabric* find_fabric(std::string_view name) {
  const auto found =
      std::find_if(fabrics.begin(), fabrics.end(), [&](const Fabric& f) { return f.name == name; });
  return found == fabrics.end() ? nullptr : &*found;
}

double bending_length(const Fabric& fabric) {
  return std::cbrt(fabric.bend_warp / (9.81 * fabric.areal_density));
}

}  // namespace drench
