// Rows of the surface built around the particles.
#include "pipeline/contract/shot/shot_rows.h"

namespace drench::shot_table {

std::vector<Parameter> surface_rows() {
  return {
      row<&SurfaceSettings::voxel>("surface", "voxel", "", {0.05, 4}, mesh,
                                   "edge of a grid cell / spacing"),
      row<&SurfaceSettings::support>("surface", "support", "", {1, 8}, mesh,
                                     "support radius of the kernel / spacing"),
      row<&SurfaceSettings::iso_value>("surface", "iso_value", "", {0.01, 0.99}, mesh,
                                       "of the colour field on the surface"),
      row<&SurfaceSettings::kernel>(
          "surface", "kernel", "", none, mesh,
          "anisotropic: kernels are squeezed across thin sheets and threads, which so have their "
          "volume and fewer holes; isotropic: all are round"),
      row<&SurfaceSettings::smoothing>("surface", "smoothing", "", {0, 1000}, mesh,
                                       "passes over the mesh; they keep its volume"),
      row<&SurfaceSettings::obj>("surface", "obj", "", none, mesh,
                                 "also write mesh/fluid.####.obj: positions, normals, triangles"),
      row<&SurfaceSettings::level_set>(
          "surface", "level_set", "", none, mesh,
          "also write mesh/fluid.####.vdb: the narrow-band level set surface and, on its voxels, "
          "the velocity v in m/s"),
      row<&SurfaceSettings::memory_gib>(
          "surface", "memory_gib", "GiB", {0.01, 4096}, no_stage,
          "a grid that would need more is refused; no part of the result"),
  };
}

}  // namespace drench::shot_table
