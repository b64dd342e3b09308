"""Tests of pipeline/blender/load_drench.py, inside Blender: see run. The sequence is ball.toml's;
its OBJ files, read here line by line, say what the PLY files must load as."""

import struct
import sys
import tempfile
from pathlib import Path

import bpy
import numpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
from run_tests import run_tests  # beside this file

OUT = Path(sys.argv[sys.argv.index("--") + 1])
SCRIPT = Path(__file__).resolve().parents[2] / "pipeline/blender/load_drench.py"
FPS, SPEED, GRAVITY = 30, 4.0, 9.81  # ball.toml: 1/s, m/s, m/s^2


def load_script(folder):
    """As `blender --python load_drench.py -- FOLDER` does, in an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    sys.argv = ["blender", "--", str(folder)]
    script = {"__name__": "__main__"}
    exec(compile(SCRIPT.read_text(), SCRIPT, "exec"), script)
    return script


def column(data, name, width):
    values = numpy.empty(len(data) * width, "f4")
    data.foreach_get(name, values)
    return values.reshape(-1, width)


def vectors(mesh, attribute):
    return column(mesh.attributes[attribute].data, "vector", 3)


def read_obj(frame):
    rows = {"v": [], "vn": [], "f": []}
    for line in (OUT / f"mesh/fluid.{frame}.obj").read_text().splitlines()[1:]:
        keyword, *words = line.split()
        rows[keyword].append([word.split("/")[0] for word in words])
    triangles = numpy.array(rows["f"], int) - 1
    return numpy.array(rows["v"], "f4"), numpy.array(rows["vn"], "f4"), triangles


def expect_frame(mesh, frame):
    position, normal, triangles = read_obj(frame)
    numpy.testing.assert_array_equal(column(mesh.vertices, "co", 3), position)
    numpy.testing.assert_array_equal(vectors(mesh, "N"), normal)
    corners = numpy.empty(len(mesh.loops), "i4")
    mesh.loops.foreach_get("vertex_index", corners)
    numpy.testing.assert_array_equal(corners.reshape(-1, 3), triangles)
    assert not mesh.validate(), "Blender found the mesh at fault"


def expect_error(text, action):
    try:
        action()
    except Exception as problem:
        assert type(problem).__name__ == "LoadError" and text in str(problem), repr(problem)
        return
    raise AssertionError(f"no error that says '{text}'")


def write_ply(path, columns, vertices, triangles):
    """columns: (PLY type, struct code, name); vertices: tuples."""
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    header += "".join(f"property {kind} {name}\n" for kind, _, name in columns)
    header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    code = "<" + "".join(letter for _, letter, _ in columns)
    body = b"".join(struct.pack(code, *vertex) for vertex in vertices)
    body += b"".join(struct.pack("<Biii", 3, *triangle) for triangle in triangles)
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(header.encode() + body)


def test_mesh_is_that_of_the_frame():
    load_script(OUT)
    scene, mesh = bpy.context.scene, bpy.data.objects["fluid"].data
    assert (scene.frame_start, scene.frame_end, scene.frame_current) == (1001, 1003, 1001)
    assert abs(scene.render.fps / scene.render.fps_base - FPS) < 1e-6
    for frame, shown in [(1001, 1001), (1003, 1003), (1002, 1002), (2000, 1003), (1, 1001)]:
        scene.frame_set(frame)
        expect_frame(mesh, shown)


def test_velocity_is_that_of_a_ball_in_flight():
    # Every vertex moves as the particles do, all alike; half floats keep 4 exactly.
    load_script(OUT)
    mesh = bpy.data.objects["fluid"].data
    for frame in (1001, 1003):
        bpy.context.scene.frame_set(frame)
        velocity = vectors(mesh, "velocity").mean(0)
        expected = (SPEED, -GRAVITY * (frame - 1001) / FPS, 0)
        numpy.testing.assert_allclose(velocity, expected, atol=0.01 * SPEED)


def test_age_and_source_are_there():
    load_script(OUT)
    mesh = bpy.data.objects["fluid"].data
    for frame in (1001, 1003):
        bpy.context.scene.frame_set(frame)
        age = column(mesh.attributes["age"].data, "value", 1)
        numpy.testing.assert_allclose(age, (frame - 1001) / FPS, rtol=1e-3)
        assert not column(mesh.attributes["source"].data, "value", 1).any(), "there is one source"


def test_up_is_up():
    load_script(OUT)
    bpy.context.view_layer.update()
    fluid = bpy.data.objects["fluid"]
    top = max((fluid.matrix_world @ vertex.co for vertex in fluid.data.vertices), key=lambda x: x.z)
    assert abs(top.z - 0.7) < 0.02 and abs(top.x + 0.2) < 0.02, top


def test_sheet_has_uv_and_rest():
    load_script(OUT)
    mesh = bpy.data.objects["cloth.sheet"].data
    assert len(mesh.vertices) == 5 * 7 and len(mesh.polygons) == 2 * 4 * 6
    uv = column(mesh.uv_layers["UVMap"].data, "uv", 2)
    assert uv.min() < uv.max() and len(uv) == len(mesh.loops)
    numpy.testing.assert_allclose(vectors(mesh, "rest"), column(mesh.vertices, "co", 3), atol=1e-6)


def test_columns_of_any_name_become_attributes():
    with tempfile.TemporaryDirectory() as folder:
        columns = [("float", "f", "x"), ("float", "f", "y"), ("float", "f", "z"),
                   ("float", "f", "age"), ("uint", "I", "source"), ("uchar", "B", "kind"),
                   ("float", "f", "spin_x"), ("float", "f", "spin_y"), ("float", "f", "spin_z")]
        vertices = [(0, 0, 0, 0.5, 7, 1, 1, 2, 3), (1, 0, 0, 1.5, 8, 2, 4, 5, 6),
                    (0, 1, 0, 2.5, 9, 3, 7, 8, 9)]
        write_ply(Path(folder) / "mesh/fluid.0001.ply", columns, vertices, [(0, 1, 2)])
        write_ply(Path(folder) / "mesh/fluid.0003.ply", columns, [], [])
        load_script(folder)
        mesh = bpy.data.objects["fluid"].data
        values = {name: [entry.value for entry in mesh.attributes[name].data]
                  for name in ("age", "source", "kind")}
        assert values == {"age": [0.5, 1.5, 2.5], "source": [7, 8, 9], "kind": [1, 2, 3]}, values
        numpy.testing.assert_array_equal(vectors(mesh, "spin").ravel(), range(1, 10))
        bpy.context.scene.frame_set(2)
        assert len(mesh.vertices) == 3, "a gap shows the frame before it"
        bpy.context.scene.frame_set(3)
        assert len(mesh.vertices) == 0


def test_errors_say_what_is_wrong():
    expect_error("is no folder", lambda: load_script("/nowhere"))
    expect_error("no folder is given", lambda: load_script(""))
    with tempfile.TemporaryDirectory() as folder:
        expect_error("drench mesh", lambda: load_script(folder))
        whole = (OUT / "mesh/fluid.1001.ply").read_bytes()
        file = Path(folder) / "mesh/fluid.1001.ply"
        file.parent.mkdir()
        for size in [0, 10, 200, len(whole) // 4, len(whole) - 1]:
            file.write_bytes(whole[:size])
            expect_error("fluid.1001.ply", lambda: load_script(folder))
        file.write_bytes(whole.replace(b"binary_little_endian", b"binary_big_endian"))
        expect_error("binary_big_endian", lambda: load_script(folder))
        file.write_bytes(whole)
        script = load_script(folder)
        (Path(folder) / "mesh/fluid.1002.ply").write_bytes(whole[:-1])
        bpy.context.scene.frame_current = 1002
        expect_error("cut off", lambda: script["follow_drench"](bpy.context.scene))
        assert len(bpy.data.objects["fluid"].data.vertices) == 0, "shows another frame's mesh"


def test_runs_again_on_its_own_objects():
    script = load_script(OUT)
    script["main"]()
    sys.argv = ["blender"]
    script["main"]()
    script["FOLDER"] = str(OUT)
    script["main"]()
    assert sorted(thing.name for thing in bpy.data.objects) == ["cloth.sheet", "fluid"]
    assert len(bpy.app.handlers.frame_change_pre) == 1


def spread_of_picture(folder, blur):
    """Variance along x of the light of a glowing ball, m^2: the camera sees 1.2 m in 96 pixels."""
    scene = bpy.context.scene
    scene.render.use_motion_blur = blur
    scene.render.filepath = str(Path(folder) / f"{blur}.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    profile = numpy.array(image.pixels).reshape(-1, 96, 4)[:, :, 0].sum(0)
    x = (numpy.arange(96) + 0.5) * 1.2 / 96
    mean = (profile * x).sum() / profile.sum()
    return (profile * (x - mean) ** 2).sum() / profile.sum()


def test_cycles_blurs_by_the_velocity():
    # Light of a ball that moves evenly by L while the shutter is open: variance grows by L^2 / 12.
    load_script(OUT)
    scene = bpy.context.scene
    scene.frame_set(1002)
    bpy.data.objects.remove(bpy.data.objects["cloth.sheet"])
    glow = bpy.data.materials.new("glow")
    glow.use_nodes = True
    glow.node_tree.nodes.clear()
    output = glow.node_tree.nodes.new("ShaderNodeOutputMaterial")
    emission = glow.node_tree.nodes.new("ShaderNodeEmission")
    glow.node_tree.links.new(emission.outputs[0], output.inputs[0])
    bpy.data.objects["fluid"].data.materials.append(glow)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 1.2
    camera.location, camera.rotation_euler = (0, -3, 0.6), (numpy.pi / 2, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 64
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x, scene.render.resolution_y = 96, 48
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    for shutter in (0.5, 1.0):  # frames
        scene.render.motion_blur_shutter = shutter
        with tempfile.TemporaryDirectory() as folder:
            grown = spread_of_picture(folder, True) - spread_of_picture(folder, False)
        length = (12 * grown) ** 0.5
        print(f"shutter {shutter}: blurred over {length:.4f} m of {SPEED * shutter / FPS:.4f} m")
        numpy.testing.assert_allclose(length, SPEED * shutter / FPS, rtol=0.05)
    expect_frame(bpy.data.objects["fluid"].data, 1002)


def test_blender_reads_obj_and_level_set_itself():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(OUT / "mesh/fluid.1002.obj"))
    position, _, triangles = read_obj(1002)
    mesh = bpy.context.scene.objects[0].data
    assert (len(mesh.vertices), len(mesh.polygons)) == (len(position), len(triangles))
    volume = bpy.data.volumes.new("fluid")
    volume.filepath = str(OUT / "mesh/fluid.1002.vdb")
    assert volume.grids.load(), volume.grids.error_message
    kinds = {grid.name: grid.data_type for grid in volume.grids}
    assert kinds == {"surface": "FLOAT", "v": "VECTOR_FLOAT"}, kinds


run_tests(globals())
