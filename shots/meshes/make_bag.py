#!/usr/bin/env python3
"""Writes bag.obj beside itself: two sheets that meet at three of their edges, an open bag.

0.34 m wide and 0.38 m deep, 0.1 m from side to side at its mouth, which is at y = 0.38 m. Python's
standard library is enough.
"""
import math
import pathlib

WIDTH, DEPTH, OPENING = 0.34, 0.38, 0.1  # m
ACROSS, DOWN = 22, 26                    # cells of each sheet


def bulge(i, j):
    """Half of the distance between the sheets: none at the sides and the bottom."""
    return OPENING / 2 * math.sin(math.pi * i / ACROSS) * math.sin(math.pi / 2 * j / DOWN)


def main():
    lines, faces, number = [], [], {}

    def vertex(side, i, j):
        """Number of a vertex, from 1; both sheets have those of their common edges."""
        key = (0 if i in (0, ACROSS) or j == 0 else side, i, j)
        if key not in number:
            number[key] = len(number) + 1
            x, y = WIDTH * (i / ACROSS - 0.5), DEPTH * j / DOWN
            lines.append(f"v {x:.5f} {y:.5f} {side * bulge(i, j):.5f}")
        return number[key]

    for side in (1, -1):
        for j in range(DOWN):
            for i in range(ACROSS):
                a, b = vertex(side, i, j), vertex(side, i + 1, j)
                c, d = vertex(side, i + 1, j + 1), vertex(side, i, j + 1)
                # Diagonals end in the corners of the bag, so that none joins edge to edge.
                for corners in ((a, b, d), (b, c, d)) if (i + j) % 2 else ((a, b, c), (a, c, d)):
                    faces.append("f " + " ".join(str(k) for k in corners[::side]))
    pathlib.Path(__file__).with_name("bag.obj").write_text("\n".join(lines + faces) + "\n")


main()
