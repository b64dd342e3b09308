#pragma once
// What one stage hands the next, in memory. On disk: particles_file.h (VDB) and mesh_file.h (PLY).

#include <Imath/ImathVec.h>

#include <cstdint>
#include <string>
#include <vector>

namespace drench {

/// Fluid particles of one frame. All columns have the same length n >= 0, or are empty where noted.
struct ParticleFrame {
  std::vector<Imath::V3f> position;  // m, world
  std::vector<Imath::V3f> velocity;  // m/s
  std::vector<float> density;        // kg/m^3, or empty
  std::vector<uint32_t> id;          // unique over the shot, or empty
  std::vector<uint8_t> source;       // of the shot's sources, in Shot order; or empty
  std::vector<float> age;            // s since it came, or empty
  std::vector<float> wetness;        // 0 to 1, or empty; nothing in Drench fills it yet
  float spacing = 0;                 // m, a; a particle's mass is rest_density a^3
  float rest_density = 1000;         // kg/m^3
};

enum class FoamKind : uint8_t { spray, foam, bubble };

/// Spray, foam and bubbles of one frame, all columns of one length. Both the state that the next
/// frame starts from and what is drawn.
struct FoamFrame {
  std::vector<Imath::V3f> position;  // m, world
  std::vector<Imath::V3f> velocity;  // m/s
  std::vector<uint32_t> id;          // unique over the shot, rising
  std::vector<float> age;            // s on the surface or on a wall: what counts to its lifetime
  std::vector<float> radius;         // m
  std::vector<FoamKind> kind;
  float spacing = 0;     // m, of the fluid
  uint32_t next_id = 0;  // of the next particle that is born
};

/// A triangle mesh: the fluid's surface (closed, outward) or a sheet of cloth (open).
/// Vertex columns have the length of `position`, or are empty where noted.
struct TriangleMesh {
  std::vector<Imath::V3f> position;       // m, world
  std::vector<Imath::V3f> velocity;       // m/s
  std::vector<Imath::V3f> normal;         // unit, or empty
  std::vector<Imath::V2f> uv;             // cloth: texture and rest plane, or empty
  std::vector<Imath::V3f> rest_position;  // cloth: m, at rest, or empty
  std::vector<float> source;              // fluid: of the nearest particle, or empty
  std::vector<float> age;                 // fluid: as of its particles, or empty
  std::vector<float> wetness;             // as age; cloth: wet fraction, 0 to 1; or empty
  // cloth: principal strains, length over rest length less 1, and stresses, N/m; or empty
  std::vector<float> strain_max, strain_min, stress_max, stress_min;
  std::vector<uint32_t> id;     // cloth: the vertex as the shot numbers it; written only; or empty
  std::vector<uint32_t> point;  // the first vertex at the same point of the surface, where
                                // several differ in uv or normal; or empty
  std::vector<Imath::Vec3<uint32_t>> triangle;  // counter-clockwise seen from outside
  std::vector<uint8_t> contact;                 // by triangle, 1: lies on a sheet; or empty
};

/// One sheet of cloth of one frame.
struct ClothFrame {
  std::string name;
  TriangleMesh mesh;
};

/// The surface of an obstacle at one frame.
struct ObstacleFrame {
  std::string name;
  TriangleMesh mesh;  // closed, but for a plane
};

}  // namespace drench
