#!/usr/bin/env python3
"""Writes paving.png and paving_normal.png beside itself: stone slabs of 0.5 m in a running bond.

They repeat every 2 m (texture_size = 2). Python's standard library is enough.
"""
import math
import pathlib
import random
import struct
import zlib

SIZE = 1024          # pixels a side
SLABS = 4            # a side
GROUT = 5 / SIZE     # half a joint, of the picture
DEPTH = 14           # of the relief, in pixels


def noise(period, seed):
    """Smooth noise in -1..1 that repeats with the picture; `period` cells a side."""
    random.seed(seed)
    cell = [[random.uniform(-1, 1) for _ in range(period)] for _ in range(period)]

    def at(x, y):
        x, y = x * period, y * period
        i, j = int(x), int(y)
        u, v = x - i, y - j
        u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)
        row, below = cell[j % period], cell[(j + 1) % period]
        left, right = i % period, (i + 1) % period
        top = row[left] + (row[right] - row[left]) * u
        return top + (below[left] + (below[right] - below[left]) * u - top) * v

    return at


OCTAVES = [(0.5 ** k, noise(6 * 2 ** k, k)) for k in range(7)]
random.seed(7)
SHADE = [[(random.uniform(0.72, 1.1), random.uniform(-1, 1)) for _ in range(SLABS)]
         for _ in range(SLABS)]


def stone(x, y):
    """(height 0..1, colour) of a point of the picture."""
    row = int(y * SLABS)
    along = (x * SLABS + 0.5 * (row % 2)) % SLABS
    column = int(along)
    u, v = along - column, y * SLABS - row
    rough = sum(weight * at(x, y) for weight, at in OCTAVES)
    worn = GROUT * SLABS * (1 + 0.35 * OCTAVES[3][1](x, y))
    edge = min(u, 1 - u, v, 1 - v) / worn  # 1 at a slab's edge
    up = max(0.0, min(1.0, (edge - 0.6) / 1.4))
    up = up * up * (3 - 2 * up)
    shade, warm = SHADE[row][column]
    light = shade * (1 + 0.16 * rough + 0.06 * OCTAVES[5][1](x, y))
    slab = [0.64 * light * (1 + 0.05 * warm), 0.61 * light, 0.57 * light * (1 - 0.06 * warm)]
    joint = [0.30 + 0.04 * rough, 0.28 + 0.04 * rough, 0.26 + 0.04 * rough]
    height = up * (0.8 + 0.05 * warm) + 0.035 * rough
    return height, [j + (s - j) * up for s, j in zip(slab, joint)]


def write_png(name, rows):
    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    # Each row as its difference from the row above, which packs better.
    packed, above = bytearray(), bytes(3 * SIZE)
    for row in rows:
        packed += b"\2" + bytes((a - b) & 255 for a, b in zip(row, above))
        above = row
    header = struct.pack(">IIBBBBB", SIZE, SIZE, 8, 2, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header)
    data += chunk(b"IDAT", zlib.compress(bytes(packed), 9)) + chunk(b"IEND", b"")
    (pathlib.Path(__file__).parent / name).write_bytes(data)


def byte(value):
    return max(0, min(255, round(255 * value)))


def main():
    points = [[stone((i + 0.5) / SIZE, (j + 0.5) / SIZE) for i in range(SIZE)]
              for j in range(SIZE)]
    write_png("paving.png", [bytes(byte(c) for p in row for c in p[1]) for row in points])
    normals = []
    for j in range(SIZE):
        row = bytearray()
        for i in range(SIZE):
            # x along u, y along v, which runs up the picture.
            x = (points[j][i - 1][0] - points[j][(i + 1) % SIZE][0]) * DEPTH / 2
            y = (points[(j + 1) % SIZE][i][0] - points[j - 1][i][0]) * DEPTH / 2
            length = math.sqrt(x * x + y * y + 1)
            row += bytes(byte(0.5 + 0.5 * c / length) for c in (x, y, 1))
        normals.append(bytes(row))
    write_png("paving_normal.png", normals)


if __name__ == "__main__":
    main()
