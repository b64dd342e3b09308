"""Loads the meshes of a Drench output folder into Blender 3.4.

    blender --python load_drench.py -- OUT_FOLDER

or open it in Blender's text editor, set FOLDER, and run it. The fluid and every sheet of cloth
become one object each, whose mesh follows the frame; run the script again to read the files anew,
and after opening a saved scene, without a folder, to let its objects follow again. The scene takes
the shot's frames and frames per second, which motion blur depends on.

Vertices keep what the files hold as attributes: `velocity` in m/s, from which Cycles makes motion
blur, `N` for the normals, `rest`, and others by their own names; s and t become a UV map. Drench's
Y is up, Blender's is Z: the objects are turned.
"""

import math
import re
import sys
from pathlib import Path

import bpy
import numpy

FOLDER = ""  # what `drench run` wrote to: out/SHOT/QUALITY

SEQUENCE = "drench_sequence"  # of an object: path of its files without frame and extension
SHOWN = "drench_frame"  # of a mesh: the frame it was read from

PLY_TYPES = {
    "char": "<i1", "int8": "<i1", "uchar": "<u1", "uint8": "<u1",
    "short": "<i2", "int16": "<i2", "ushort": "<u2", "uint16": "<u2",
    "int": "<i4", "int32": "<i4", "uint": "<u4", "uint32": "<u4",
    "float": "<f4", "float32": "<f4", "double": "<f8", "float64": "<f8",
}


class LoadError(Exception):
    """What is wrong, where, and what to do."""


def elements_of(header, path):
    """Name, count and dtype of each element; lists are taken to have 3 entries."""
    elements = []
    for words in (line.split() for line in header.splitlines()):
        if words[0] == "format" and words[1] != "binary_little_endian":
            raise LoadError(f"{path}: is {words[1]}; only binary_little_endian PLY can be loaded")
        if words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property" and words[1] == "list":
            elements[-1][2].append(("corners", PLY_TYPES[words[2]]))
            elements[-1][2].append((words[4], PLY_TYPES[words[3]], 3))
        elif words[0] == "property":
            elements[-1][2].append((words[2], PLY_TYPES[words[1]]))
    return [(name, count, numpy.dtype(columns)) for name, count, columns in elements]


def read_ply(path):
    """Vertices as a structured array, triangles as m x 3 indices.

    Raises LoadError if the file is cut off or is no triangle mesh."""
    try:
        data = path.read_bytes()
    except OSError as problem:
        raise LoadError(f"{path}: cannot be read: {problem.strerror}") from problem
    end = data.find(b"\nend_header\n") + len(b"\nend_header\n")
    if not data.startswith(b"ply\n") or end < len(b"\nend_header\n"):
        raise LoadError(f"{path}: has no PLY header; mesh the frame again")
    arrays = {}
    for name, count, dtype in elements_of(data[:end].decode("latin-1"), path):
        if end + count * dtype.itemsize > len(data):
            raise LoadError(f"{path}: is cut off in its {name} data; `drench verify` finds all "
                            "such files, and the next run makes them again")
        arrays[name] = numpy.frombuffer(data, dtype, count, end)
        end += count * dtype.itemsize
    vertices, faces = arrays["vertex"], arrays["face"]
    triangles = faces[faces.dtype.names[1]]
    if end != len(data) or (faces["corners"] != 3).any():
        raise LoadError(f"{path}: is not a mesh of triangles alone")
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(vertices):
        raise LoadError(f"{path}: has a triangle without its vertices; run `drench verify`")
    return vertices, triangles


def columns_of(vertices):
    """Columns by attribute name: n x 3, n x 2 or n; NAME_x, NAME_y, NAME_z are one, NAME."""
    rest = list(vertices.dtype.names)
    groups = {"co": ["x", "y", "z"], "velocity": ["vx", "vy", "vz"], "N": ["nx", "ny", "nz"],
              "UVMap": ["s", "t"] if "s" in rest else ["u", "v"]}
    for stem in [name[:-2] for name in rest if name.endswith("_x")]:
        groups[stem] = [f"{stem}_{axis}" for axis in "xyz"]
    columns = {}
    for name, parts in groups.items():
        if set(parts) <= set(rest):
            columns[name] = numpy.stack([vertices[part] for part in parts], 1).astype("f4")
            rest = [part for part in rest if part not in parts]
    columns.update((name, vertices[name]) for name in rest)
    return columns


def add_attribute(mesh, name, column):
    """A point attribute, single precision or 32-bit integers."""
    whole = column.dtype.kind in "iu"
    kind, dtype = ("INT", "i4") if whole else ("FLOAT", "f4")
    if column.ndim == 2:
        kind = "FLOAT_VECTOR"
    attribute = mesh.attributes.new(name, kind, "POINT")
    if attribute is None:
        raise LoadError(f"'{name}' is a name that Blender keeps for itself")
    values = numpy.ascontiguousarray(column, dtype).ravel()
    attribute.data.foreach_set("vector" if column.ndim == 2 else "value", values)


def fill(mesh, vertices, triangles):
    columns = columns_of(vertices)
    mesh.clear_geometry()
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", columns.pop("co").ravel())
    corners = numpy.ascontiguousarray(triangles, "u4").ravel()  # signed would take 12 times as long
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", numpy.arange(0, len(corners), 3, "i4"))
    mesh.polygons.foreach_set("loop_total", numpy.full(len(triangles), 3, "i4"))
    mesh.polygons.foreach_set("use_smooth", numpy.ones(len(triangles), bool))
    uv = columns.pop("UVMap", None)
    if uv is not None:
        mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", uv[corners].ravel())
    for name, column in columns.items():
        add_attribute(mesh, name, column)
    mesh.update(calc_edges=True)


def frames_of(sequence):
    """Files of a sequence by frame."""
    sequence = Path(sequence)
    numbered = re.compile(re.escape(sequence.name) + r"\.(-?\d+)\.ply")
    matches = [(numbered.fullmatch(file.name), file) for file in sequence.parent.glob("*.ply")]
    return {int(match[1]): file for match, file in matches if match}


def show(thing, frame):
    """Brings an object's mesh to a frame, or to the last one before it that there is."""
    files = frames_of(thing[SEQUENCE])
    if not files:
        raise LoadError(f"{thing[SEQUENCE]}.####.ply: the files are gone")
    there = max((number for number in files if number <= frame), default=min(files))
    if thing.data.get(SHOWN) == there:
        return
    thing.data.pop(SHOWN, None)
    try:
        fill(thing.data, *read_ply(files[there]))
    except Exception:
        thing.data.clear_geometry()  # nothing, rather than another frame's mesh
        raise
    thing.data[SHOWN] = there


@bpy.app.handlers.persistent
def follow_drench(scene, _=None):
    # Motion blur looks at the scene a part of a frame to both sides: that is still this frame.
    frame = math.floor(scene.frame_current_final + 0.5)
    for thing in scene.objects:
        if SEQUENCE in thing:
            show(thing, frame)


def take_times(scene, folder, frames):
    """Velocities are metres a second: motion blur is right at the shot's own rate only."""
    scene.frame_start, scene.frame_end = min(frames), max(frames)
    lock = folder / "shot.lock.toml"
    fps = re.search(r"^fps = ([\d.]+)", lock.read_text(), re.M) if lock.exists() else None
    if fps:
        scene.render.fps = max(round(float(fps[1])), 1)
        scene.render.fps_base = scene.render.fps / float(fps[1])


def load(folder):
    """One object for each sequence in the folder. Raises LoadError if there is none."""
    folder = Path(bpy.path.abspath(str(folder))).expanduser().resolve()
    if not folder.is_dir():
        raise LoadError(f"{folder}: is no folder; give what `drench run` wrote to, as "
                        "out/SHOT/QUALITY")
    files = [*folder.glob("mesh/*.ply"), *folder.glob("sim/cloth.*.ply")]
    matches = [re.fullmatch(r"(.*)\.-?\d+\.ply", str(file)) for file in files]
    sequences = sorted({match[1] for match in matches if match})
    if not sequences:
        raise LoadError(f"{folder}: holds neither mesh/*.####.ply nor sim/cloth.*.####.ply; "
                        "run `drench mesh` first")
    scene = bpy.context.scene
    known = {thing[SEQUENCE]: thing for thing in scene.objects if SEQUENCE in thing}
    for sequence in sequences:
        name = Path(sequence).name
        thing = known.get(sequence) or bpy.data.objects.new(name, bpy.data.meshes.new(name))
        if sequence not in known:
            scene.collection.objects.link(thing)
            thing.rotation_euler.x = math.radians(90)
        thing[SEQUENCE] = sequence
        thing.data.pop(SHOWN, None)
    take_times(scene, folder, [frame for sequence in sequences for frame in frames_of(sequence)])
    if not scene.frame_start <= scene.frame_current <= scene.frame_end:
        scene.frame_set(scene.frame_start)


def main():
    words = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    folder = FOLDER or (words[0] if words else "")
    scene = bpy.context.scene
    handlers = bpy.app.handlers.frame_change_pre
    handlers[:] = [handler for handler in handlers if handler.__name__ != "follow_drench"]
    if folder:
        load(folder)
    elif not any(SEQUENCE in thing for thing in scene.objects):
        raise LoadError("no folder is given: blender --python load_drench.py -- OUT_FOLDER, "
                        "or set FOLDER in the script")
    handlers.append(follow_drench)
    follow_drench(scene)
    scene.render.use_lock_interface = True  # the viewport must not read a mesh that is changed


if __name__ == "__main__":
    main()
