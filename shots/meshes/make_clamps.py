#!/usr/bin/env python3
"""Writes clamp.obj and washing_line.obj beside itself: what holds sheets, of boxes that stand apart.

clamp.obj: two bars along z with a gap of 8 mm between them, for the edge of a towel.
washing_line.obj: a line along x and a peg over each place of PEGS, whose legs have 16 mm between
them. Python's standard library is enough.
"""
import pathlib

CLAMP = [((-0.014, sign * 0.01 - 0.006, -0.17), (0.014, sign * 0.01 + 0.006, 0.17))
         for sign in (-1, 1)]
# m along the line: at the pins of clothesline.toml.
PEGS = [-1.245, -0.755, -0.61, -0.215, 0.175, 0.325, 0.675]
LINE = [((-3.0, -0.004, -0.004), (3.0, 0.004, 0.004))] + [
    ((x - 0.006, -0.018, min(sign * 0.008, sign * 0.014)),
     (x + 0.006, 0.020, max(sign * 0.008, sign * 0.014)))
    for x in PEGS for sign in (-1, 1)]


def box(low, high, first):
    """Corner k has high's x, y, z where bits 0, 1, 2 of k are set; faces look outwards."""
    lines = []
    for k in range(8):
        x, y, z = ((high if k >> axis & 1 else low)[axis] for axis in range(3))
        lines.append(f"v {x:.4f} {y:.4f} {z:.4f}")
    for face in ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)):
        lines.append("f " + " ".join(str(first + corner) for corner in face))
    return lines


def write(name, boxes):
    lines = []
    for k, (low, high) in enumerate(boxes):
        lines += box(low, high, 1 + 8 * k)
    pathlib.Path(__file__).with_name(name).write_text("\n".join(lines) + "\n")


write("clamp.obj", CLAMP)
write("washing_line.obj", LINE)
