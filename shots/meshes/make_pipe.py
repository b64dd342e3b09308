#!/usr/bin/env python3
"""Writes pipe.obj beside itself: a straight pipe, open at both ends.

Upright from y = 0 to 0.5 m, 36 mm wide inside in radius and 42 mm outside. Python's standard
library is enough.
"""
import math
import pathlib

AROUND = 48
INNER, OUTER, LENGTH = 0.036, 0.042, 0.5  # m
# Radius and height of each ring, in the order in which the wall's section is walked around.
SECTION = [(INNER, 0.0), (OUTER, 0.0), (OUTER, LENGTH), (INNER, LENGTH)]


def main():
    lines = []
    for radius, y in SECTION:
        for k in range(AROUND):
            phi = 2 * math.pi * k / AROUND
            lines.append(f"v {radius * math.cos(phi):.5f} {y:.5f} {radius * math.sin(phi):.5f}")
    for ring in range(len(SECTION)):
        below, above = ring * AROUND, (ring + 1) % len(SECTION) * AROUND
        for k in range(AROUND):
            after = (k + 1) % AROUND
            corners = below + k, above + k, above + after, below + after
            lines.append("f " + " ".join(str(1 + corner) for corner in corners))
    pathlib.Path(__file__).with_name("pipe.obj").write_text("\n".join(lines) + "\n")


main()
