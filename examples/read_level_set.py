#!/usr/bin/env python3
"""The level set that `[surface] level_set = true` writes, read with Debian's python3-openvdb.

    examples/read_level_set.py out/example/mesh/fluid.0006.vdb

Particle caches (sim/particles.*.vdb) are point grids, which pyopenvdb 10 cannot read; Houdini can.
"""
import sys

import pyopenvdb


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: read_level_set.py FILE.vdb")
    grids = {grid.name: grid for grid in pyopenvdb.readAll(sys.argv[1])[0]}
    surface, velocity = grids["surface"], grids["v"]
    low, high = surface.evalActiveVoxelBoundingBox()
    middle = tuple((a + b) // 2 for a, b in zip(low, high))
    distance = surface.getConstAccessor().getValue(middle)
    print(f"{surface.activeVoxelCount()} voxels of {surface.transform.voxelSize()[0]:.4f} m from "
          f"{low} to {high}")
    print(f"signed distance in the middle {distance:.4f} m, below 0 inside")
    fastest = max(sum(u * u for u in item.value) for item in velocity.iterOnValues()) ** 0.5
    print(f"fastest voxel {fastest:.3f} m/s")


if __name__ == "__main__":
    main()
