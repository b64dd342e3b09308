#!/usr/bin/env python3
"""Writes towel.png beside itself: an off-white towel with blue stripes along two of its hems.

256 x 64 pixels, sRGB; the stripes stand across u. Python's standard library is enough.
"""
import pathlib
import struct
import zlib

WIDTH, HEIGHT = 256, 64
CREAM, BLUE, HEM = (236, 230, 218), (48, 84, 140), (214, 206, 190)
# From one end of u and, mirrored, from the other: begin, end and colour of each stripe, in u.
STRIPES = [(0.0, 0.012, HEM), (0.06, 0.105, BLUE), (0.115, 0.125, BLUE), (0.135, 0.145, BLUE)]


def colour(u):
    from_end = min(u, 1 - u)
    for begin, end, stripe in STRIPES:
        if begin <= from_end < end:
            return stripe
    return CREAM


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def main():
    row = b"\0" + b"".join(bytes(colour((x + 0.5) / WIDTH)) for x in range(WIDTH))
    header = struct.pack(">2I5B", WIDTH, HEIGHT, 8, 2, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header)
    png += chunk(b"IDAT", zlib.compress(row * HEIGHT, 9)) + chunk(b"IEND", b"")
    pathlib.Path(__file__).with_name("towel.png").write_bytes(png)


main()
