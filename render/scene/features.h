#pragma once
// What a frame asks of the path loop (integrator/path.h).

namespace drench::render {

/// What the loop must be able to do for a frame. What is absent costs no branch.
struct Feature {
  enum : unsigned {
    motion_blur = 1,     // something, or the camera, moves in the shutter
    dielectric = 2,      // water: refraction, absorption, medium on the path
    sampled_lights = 4,  // lights are sampled, with multiple importance sampling
    thin_lens = 8,
    glossy = 16,        // metal, coats, rough dielectrics, fabric
    combinations = 32,  // of these
    mattes = 32,        // a plate goes behind; such frames have all the others switched on
  };
};

}  // namespace drench::render
