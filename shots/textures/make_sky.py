#!/usr/bin/env python3
"""Writes sky.exr beside itself: an afternoon sky with its sun, in latitude-longitude.

256 x 128 half floats, linear. Python's standard library is enough.
"""
import math
import pathlib
import struct

WIDTH, HEIGHT = 256, 128
SUN = (58.0, 38.0)               # azimuth and height, degrees
SUN_RADIANCE = (2600.0, 2200.0, 1650.0)
SUN_RADIUS = 1.0                 # degrees


def direction(azimuth, height):
    a, h = math.radians(azimuth), math.radians(height)
    return (math.cos(h) * math.sin(a), math.sin(h), -math.cos(h) * math.cos(a))


def sky(d, sun):
    """Radiance from a direction: blue above, pale at the horizon, warm towards the sun."""
    towards = sum(a * b for a, b in zip(d, sun))
    if d[1] < 0:
        near = math.exp(10 * d[1])
        return tuple(0.28 * c * (1 - near) + h * near
                     for c, h in zip((0.9, 0.8, 0.68), (0.6, 0.66, 0.72)))
    pale = (1 - d[1]) ** 4
    glow = 0.9 * max(towards, 0) ** 12 + 3.0 * max(towards, 0) ** 200
    out = [b + (p - b) * pale + g * glow
           for b, p, g in zip((0.16, 0.30, 0.62), (0.95, 1.0, 1.05), (1.0, 0.8, 0.55))]
    if towards > math.cos(math.radians(SUN_RADIUS)):
        out = [a + b for a, b in zip(out, SUN_RADIANCE)]
    return tuple(out)


def attribute(name, kind, data):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data


def main():
    sun = direction(*SUN)
    rows = []
    for y in range(HEIGHT):
        row = [sky(direction(360 * (x + 0.5) / WIDTH - 180, 90 - 180 * (y + 0.5) / HEIGHT), sun)
               for x in range(WIDTH)]
        rows.append(b"".join(struct.pack("<e", texel[c]) for c in (2, 1, 0) for texel in row))
    window = struct.pack("<4i", 0, 0, WIDTH - 1, HEIGHT - 1)
    channels = b"".join(c + b"\0" + struct.pack("<iB3xii", 1, 0, 1, 1) for c in (b"B", b"G", b"R"))
    header = struct.pack("<ii", 20000630, 2) + b"".join([
        attribute("channels", "chlist", channels + b"\0"),
        attribute("compression", "compression", b"\0"),
        attribute("dataWindow", "box2i", window),
        attribute("displayWindow", "box2i", window),
        attribute("lineOrder", "lineOrder", b"\0"),
        attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        attribute("screenWindowWidth", "float", struct.pack("<f", 1))]) + b"\0"
    start = len(header) + 8 * HEIGHT
    size = 8 + len(rows[0])
    offsets = b"".join(struct.pack("<Q", start + y * size) for y in range(HEIGHT))
    lines = b"".join(struct.pack("<ii", y, len(row)) + row for y, row in enumerate(rows))
    pathlib.Path(__file__).with_name("sky.exr").write_bytes(header + offsets + lines)


main()
