#pragma once
// What water between the fibres does to a sheet's two colours. Dry fibres scatter because their
// index is far from air's; water is nearer, so that each of them sends less light back and more
// on: wet cloth is darker and lets more through (Twomey, Bohren, Mergenthaler 1986; Lekner and Dorf
// 1988, "Why some things are darker when wet", whose effect of the relative index on reflection
// and absorption this is; their other one, reflection back from within the film, is the coat's).
//
// The sheet is a layer that scatters and absorbs by Kubelka and Munk 1931: with S and K its powers,
// a = 1 + K/S and b^2 = a^2 - 1,
//   R = sinh(bS) / (a sinh(bS) + b cosh(bS)),  T = b / (a sinh(bS) + b cosh(bS)),
// so that sinh(bS) = b R/T and a - 1 = (1 - R - T)(1 - R + T) / 2R. Wet, S and K are those times
// what a fibre reflects and lets in of light from everywhere, in water over in air.

#include "render/vector.h"

namespace drench::render {

/// Wet over dry.
struct WetFibres {
  double scattering = 1, absorption = 1;

  WetFibres() = default;
  /// @param liquid  its index of refraction, in place of air
  explicit WetFibres(double liquid);
};

struct SheetColours {
  V3f reflectance, transmittance;
};

/// @param dry  diffuse fractions, each at least 0, together at most 1
/// @return what they are when water fills the sheet, before its surface reflects any of it back
SheetColours wet_colours(const SheetColours& dry, const WetFibres& fibres);

}  // namespace drench::render
