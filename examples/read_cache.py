#!/usr/bin/env python3
"""What lies in an output folder, read with nothing but Python: water, cloth, probes, statistics.

    build/bin/drench simulate examples/cloth_and_water.toml --out out/example
    build/bin/drench mesh examples/cloth_and_water.toml --out out/example
    examples/read_cache.py out/example

Meshes are PLY (docs/guide/other_programs.md): a header in text, then columns of the vertices, then triangles.
"""
import csv
import json
import pathlib
import struct
import sys

CODES = {"float": "f", "int": "i", "uint": "I", "uchar": "B"}


def read_ply(path):
    """A dict of columns by name, of the vertices; and the triangles, three indices each."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    elements = {}  # name: (count, codes of a row, names)
    for line in data[:end].decode("ascii").splitlines():
        words = line.split()
        if words[0] == "element":
            current = elements[words[1]] = (int(words[2]), ["<"], [])
        elif words[:2] == ["property", "list"]:  # all faces are triangles: a count and three indices
            current[1].extend(["B", "3" + CODES[words[3]]])
        elif words[0] == "property":
            current[1].append(CODES[words[1]])
            current[2].append(words[2])
    rows = {}
    for name, (count, codes, _) in elements.items():
        row = struct.Struct("".join(codes))
        rows[name] = list(row.iter_unpack(data[end:end + count * row.size]))
        end += count * row.size
    names = elements["vertex"][2]
    columns = dict(zip(names, zip(*rows["vertex"]))) if rows["vertex"] else {k: () for k in names}
    return columns, [face[1:4] for face in rows["face"]]


def volume(columns, triangles):
    """Enclosed by a closed mesh, m^3: tetrahedra from the origin to each triangle."""
    points = list(zip(columns["x"], columns["y"], columns["z"]))
    total = 0
    for a, b, c in triangles:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = points[a], points[b], points[c]
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6


def manifest(folder):
    """What is there: step, frame and file of the records that count, the last of each file."""
    records = {}
    for line in (folder / "manifest.jsonl").read_text().splitlines():
        record = json.loads(line)
        if "file" in record:
            records[record["file"]] = record
    return [record for record in records.values() if (folder / record["file"]).exists()]


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: read_cache.py FOLDER")
    folder = pathlib.Path(sys.argv[1])
    for record in manifest(folder):
        path = folder / record["file"]
        if path.suffix != ".ply":
            continue
        columns, triangles = read_ply(path)
        text = f"{record['file']}: {len(columns['x'])} vertices, {len(triangles)} triangles"
        if path.parent.name == "mesh":
            print(f"{text}, {volume(columns, triangles):.5f} m^3")
        else:
            print(f"{text}, lowest at {min(columns['y']):.4f} m")

    for path in sorted((folder / "sim").glob("probe.*.csv")):
        with path.open(newline="") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        print(f"{path.name}: {len(rows)} rows of {', '.join(rows[0])}")

    for line in (folder / "stats.jsonl").read_text().splitlines():
        entry = json.loads(line)
        if entry["step"] == "simulate":
            print(f"frame {entry['frame']}: {entry['steps']} steps, {entry['kinetic_energy']:.3f} J")


if __name__ == "__main__":
    main()
