#!/usr/bin/env python3
"""Writes fish.1001.ply to fish.1048.ply beside itself: a fish that beats its tail twice a second.

Closed meshes of the same triangles, 0.36 m long, the head at +x. Python's standard library is enough.
"""
import math
import pathlib
import struct

ALONG, AROUND = 20, 12
FIRST, LAST, FPS = 1001, 1048, 24


def power(v, e):
    return math.copysign(abs(v) ** e, v)


def size(s):
    """Half height and half width at s, 0 at the nose, 1 at the tail's end, m."""
    body = math.sin(math.pi * min(s / 0.85, 1) ** 0.8) ** 0.7 if s < 0.85 else 0
    fin = math.exp(-((s - 0.93) / 0.07) ** 2)
    return 0.012 + 0.05 * body + 0.05 * fin, 0.018 + 0.022 * body


def bend(s, t):
    """How far the spine is aside, m: a wave that runs to the tail and grows."""
    return (0.01 + 0.07 * s * s) * math.sin(2 * math.pi * (2 * t - 0.9 * s))


def vertices(t):
    places = [(0.18, 0.0, bend(0, t))]
    for i in range(1, ALONG):
        s = i / ALONG
        high, wide = size(s)
        for j in range(AROUND):
            phi = 2 * math.pi * j / AROUND
            places.append((0.18 - 0.36 * s, high * math.cos(phi),
                           bend(s, t) + wide * power(math.sin(phi), 0.8)))
    places.append((-0.18, 0.0, bend(1, t)))
    return places


def triangles():
    def ring(i, j):
        return 1 + (i - 1) * AROUND + j % AROUND

    last = 1 + (ALONG - 1) * AROUND
    faces = []
    for j in range(AROUND):
        faces.append((0, ring(1, j), ring(1, j + 1)))
        for i in range(1, ALONG - 1):
            a, b, c, d = ring(i, j), ring(i, j + 1), ring(i + 1, j), ring(i + 1, j + 1)
            faces += [(a, c, b), (b, c, d)]
        faces.append((last, ring(ALONG - 1, j + 1), ring(ALONG - 1, j)))
    return faces


def main():
    faces = triangles()
    for frame in range(FIRST, LAST + 1):
        places = vertices((frame - FIRST) / FPS)
        header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(places)}\n"
                  "property float x\nproperty float y\nproperty float z\n"
                  f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
        file = pathlib.Path(__file__).with_name(f"fish.{frame}.ply")
        with file.open("wb") as out:
            out.write(header.encode())
            for p in places:
                out.write(struct.pack("<3f", *p))
            for f in faces:
                out.write(struct.pack("<B3i", 3, *f))


main()
