#pragma once
// Colour spaces: conversion between RGB spaces given by their chromaticities, and the sRGB curve.

#include <Imath/ImathMatrix.h>
#include <OpenEXR/ImfChromaticities.h>

#include "render/vector.h"

namespace drench::render {

/// AP1 primaries and white of ACEScg: SMPTE ST 2065-1 / Academy S-2014-004.
Imf::Chromaticities acescg_chromaticities();
/// Rec. 709 primaries, D65: sRGB, and what OpenEXR assumes of a file that does not say.
Imf::Chromaticities rec709_chromaticities();

/// Linear map of RGB columns from one space to another; the white points are adapted by Bradford's
/// cone response, so that white goes to white.
struct ColorMatrix {
  Imath::M33d m;  // rows give R, G, B of the result

  V3f operator()(const V3f& rgb) const {
    const auto row = [&](int r) {
      return float(m[r][0] * rgb.x + m[r][1] * rgb.y + m[r][2] * rgb.z);
    };
    return {row(0), row(1), row(2)};
  }
};
/// @throws Error if the chromaticities span no colour space.
ColorMatrix color_conversion(const Imf::Chromaticities& from, const Imf::Chromaticities& to);

/// Relative luminance of linear ACEScg: the Y row of AP1.
inline float luminance(const V3f& acescg) {
  return 0.2722287f * acescg.x + 0.6740818f * acescg.y + 0.0536895f * acescg.z;
}

/// IEC 61966-2-1, both for 0..1.
float srgb_encode(float linear);
float srgb_decode(float code);

}  // namespace drench::render
