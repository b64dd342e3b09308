#pragma once
// From what the scene knows of a sheet to what light meets there.

#include "render/bsdf/bsdf_fabric.h"
#include "render/scene/scene.h"

namespace drench::render {

/// What light meets at a point of cloth. @param in  bodies that it arrives in
FabricPoint fabric_at(const Scene& scene, const Surface& surface, const Hit& hit, float time,
                      float wetness, Bodies in);

}  // namespace drench::render
