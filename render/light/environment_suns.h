#pragma once
// Suns of an environment map. Through water, a lamp's light comes from photons and guided rays,
// which know where lamps are; a sun that is a few texels of a map would be found by chance alone,
// as white dots. So small, very bright regions are taken out of the map and become suns.

#include <vector>

#include "render/light/sky_map.h"

namespace drench::render {

/// What a region sends beyond its surroundings, as a disc far away.
struct ExtractedSun {
  V3f toward;             // unit, to its mean direction
  V3f irradiance;         // facing it; radiance of the map x sr
  float solid_angle = 0;  // sr
};

/// Takes the suns out of a map; their texels are left with the light of those around them. The
/// irradiance that map and suns give together is the whole map's, exactly for planes that see a
/// sun whole and whose texels all have one hue. A map without suns stays as it is, to the bit.
/// @param map       latitude-longitude, as Environment reads it: bilinear, +Y at the top
/// @param rotation  of the map, turns
std::vector<ExtractedSun> extract_suns(SkyMap& map, float rotation);

}  // namespace drench::render
