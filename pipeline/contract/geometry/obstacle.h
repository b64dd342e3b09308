#pragma once
// Obstacles over time: where they stand and the surfaces that the renderer draws.

#include <filesystem>

#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/shot/shot.h"

namespace drench {

/// A rigid placement: world = position + axis[0] x + axis[1] y + axis[2] z.
struct Pose {
  V3d position;  // m
  V3d axis[3];   // unit, right-handed

  V3d to_world(const V3d& own) const {
    return position + axis[0] * own.x + axis[1] * own.y + axis[2] * own.z;
  }
  V3d to_own(const V3d& world) const {
    const V3d d = world - position;
    return {axis[0].dot(d), axis[1].dot(d), axis[2].dot(d)};
  }
};

/// @param frame  film frame, may be fractional. A plane's own y axis is its normal.
Pose obstacle_pose(const Obstacle& obstacle, double frame);

/// The part of an obstacle's own space that the domain, and what of the shot may reach beyond it,
/// takes up from film frame `begin` to `end`: two supports around it, or as far again as it is wide
/// where there is cloth. Everything where an axis is periodic.
LevelSetBounds bounds_in_own_space(const Shot& shot, const Obstacle& obstacle, double begin,
                                   double end);

/// Whether the name holds %d or %04d, one file for every frame, and is not that of a file itself.
bool is_sequence(const std::filesystem::path& mesh_file);
/// The file of a film frame. @throws std::logic_error if the name is no sequence.
std::filesystem::path sequence_file(const std::filesystem::path& pattern, int frame);

/// Where the vertices of a sequence are in its first frame, as the file has them: its polygons are
/// cut by these in every frame, so that all have the same triangles. Empty if it is no sequence.
using SequenceShape = std::vector<V3f>;
SequenceShape read_sequence_shape(const Shot& shot, const Obstacle& obstacle);

/// A closed mesh in its own coordinates times `scale`, m, turned away from what is solid: see
/// shells.h. Gaps of less than weld_fraction of its diagonal are closed, and triangles of which two
/// corners are at one point left out, with a warning; the latter are kept in a sequence, where they
/// may open in another frame.
/// @throws Error if the file cannot be read, has no triangles or is not closed.
TriangleMesh read_closed_mesh(const std::filesystem::path& file, double scale,
                              CornerData corners = CornerData::none,
                              const SequenceShape& shape = {});

/// The mesh of a frame in its own coordinates, m, from the file or the file of a sequence; frames
/// beyond the shot's are those of its ends.
/// @param shape  that of the obstacle
/// @param corners  with normals: for a picture, which cannot show glass of shells that meet; a
/// warning
/// @throws Error if the file cannot be read or is not closed.
TriangleMesh read_obstacle_mesh(const Shot& shot, const Obstacle& obstacle, int frame,
                                const SequenceShape& shape, CornerData corners = CornerData::none);

/// Reads the meshes of all frames as pictures need them, so that what is wrong with one or warned
/// of is known before anything runs. @throws Error as read_obstacle_mesh and check_same_topology.
void check_obstacle_meshes(const Shot& shot);

/// @throws Error if two meshes of a sequence differ in more than where their vertices are and which
/// side their triangles are turned.
void check_same_topology(const TriangleMesh& mesh, const TriangleMesh& other,
                         const Obstacle& obstacle);

/// The surface at a film frame, world coordinates; velocities in m/s where it moves, else none. A
/// plane is a square as wide as the domain's diagonal to each side. @throws Error as above.
TriangleMesh obstacle_surface(const Shot& shot, const Obstacle& obstacle, int frame);

}  // namespace drench
