#!/usr/bin/env python3
"""Writes cushion.ply beside itself: a cushion, wet on top and where water ran down its sides.

A closed mesh of half-edge 1 in x and z, 0.4 in y. Python's standard library is enough.
"""
import math
import pathlib
import struct

AROUND, DOWN = 96, 48


def power(v, e):
    return math.copysign(abs(v) ** e, v)


def vertex(i, j):
    """Column i, row j from the top: x, y, z and wetness."""
    phi, theta = 2 * math.pi * i / AROUND, math.pi * j / DOWN
    flat = power(math.sin(theta), 0.7)
    x, z = flat * power(math.cos(phi), 0.55), flat * power(math.sin(phi), 0.55)
    y = 0.4 * power(math.cos(theta), 0.9) * (1 - 0.45 * flat ** 6)
    y -= 0.05 * math.exp(-6 * (x * x + z * z)) * (1 if y > 0 else 0)  # it has been sat on
    crease = 0.012 * math.sin(14 * phi) * flat ** 4
    run = math.sin(5 * phi + 0.8) + 0.6 * math.sin(11 * phi + 2)
    wet = 1.5 + 2.2 * y / 0.4 + 0.9 * run - 2.2 * flat ** 4
    return x, y + crease, z, 1 / (1 + math.exp(-4 * wet))


def main():
    rings = [[vertex(i, j) for i in range(AROUND)] for j in range(1, DOWN)]
    points = [vertex(0, 0)] + [v for ring in rings for v in ring] + [vertex(0, DOWN)]
    last = len(points) - 1

    def at(i, j):
        return 1 + j * AROUND + i % AROUND

    faces = [(0, at(i + 1, 0), at(i, 0)) for i in range(AROUND)]
    for j in range(DOWN - 2):
        for i in range(AROUND):
            a, b, c, d = at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)
            faces += [(a, b, d), (a, d, c)]
    faces += [(last, at(i, DOWN - 2), at(i + 1, DOWN - 2)) for i in range(AROUND)]
    header = ("ply\nformat binary_little_endian 1.0\n"
              f"element vertex {len(points)}\nproperty float x\nproperty float y\n"
              "property float z\nproperty float wetness\n"
              f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    body = b"".join(struct.pack("<4f", *p) for p in points)
    body += b"".join(struct.pack("<B3i", 3, *f) for f in faces)
    pathlib.Path(__file__).with_name("cushion.ply").write_bytes(header.encode() + body)


main()
