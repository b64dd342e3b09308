"""Reads frames in Blender's compositor: see run. The first of ball.toml has all layers: a ball of
water of radius 0.1 m, 2 m before the camera, that flies 4 m/s along x; its geometry says what they
must hold. The frame of plate.toml is put over a plate."""

import math
import struct
import sys
import tempfile
from pathlib import Path

import bpy
import numpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
from run_tests import run_tests  # beside this file

BALL, PLATE = (Path(folder) / "render" for folder in sys.argv[sys.argv.index("--") + 1:])
WIDTH, HEIGHT, SAMPLES = 96, 64, 16
PIXELS_PER_RADIAN = WIDTH / (2 * math.tan(math.radians(10)))


class Compositor:
    """The frame as an image node, what is linked from it as a picture."""

    def __init__(self, frame=BALL / "ball.1001.exr"):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = bpy.context.scene
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        self.scene.collection.objects.link(camera)
        self.scene.camera = camera
        render = self.scene.render
        render.resolution_x, render.resolution_y = WIDTH, HEIGHT
        render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
        self.scene.use_nodes = True
        self.tree = self.scene.node_tree
        self.tree.nodes.clear()
        self.output = self.tree.nodes.new("CompositorNodeComposite")
        self.image = self.tree.nodes.new("CompositorNodeImage")
        self.image.image = bpy.data.images.load(str(frame))

    def picture(self, socket):
        """height x width x 3, the bottom row first."""
        self.tree.links.new(socket, self.output.inputs[0])
        with tempfile.TemporaryDirectory() as folder:
            self.scene.render.filepath = str(Path(folder) / "a.exr")
            bpy.ops.render.render(write_still=True)
            image = bpy.data.images.load(self.scene.render.filepath)
            return numpy.array(image.pixels).reshape(HEIGHT, WIDTH, 4)[:, :, :3]

    def layer_output(self, name):
        return self.image.outputs[name]

    def layer(self, name):
        return self.picture(self.layer_output(name))


def at_centre(picture):
    return picture[HEIGHT // 2 - 1:HEIGHT // 2 + 1, WIDTH // 2 - 1:WIDTH // 2 + 1].mean((0, 1))


def test_layers_are_those_of_the_ball():
    compositor = Compositor()
    numpy.testing.assert_array_equal(compositor.layer("samples"), SAMPLES)
    depth = compositor.layer("depth")
    numpy.testing.assert_allclose(at_centre(depth)[0], 1.9, atol=0.01)
    assert depth[-1, 0, 0] > 1e9, "the sky is at no distance"
    numpy.testing.assert_allclose(at_centre(compositor.layer("N")), (0, 0, 1), atol=0.1)
    numpy.testing.assert_allclose(at_centre(compositor.layer("P")), (-0.2, 0.6, 0.1), atol=0.02)
    motion = at_centre(compositor.layer("motion"))
    numpy.testing.assert_allclose(motion[0], 4 / 30 / 1.9 * PIXELS_PER_RADIAN, rtol=0.02)
    numpy.testing.assert_allclose(motion[1:], 0, atol=0.1)
    numpy.testing.assert_allclose(compositor.layer("albedo")[0, 0], 0.35, rtol=1e-3)  # the ground
    assert compositor.layer("variance").min() >= 0


def test_light_groups_sum_to_the_picture():
    compositor = Compositor()
    names = [output.name for output in compositor.image.outputs if output.name.startswith("light_")]
    assert sorted(names) == ["light_caustics", "light_key", "light_sky"], names
    total = sum(compositor.layer(name) for name in names)
    numpy.testing.assert_allclose(total, compositor.layer("Combined"), rtol=3e-3, atol=1e-4)


def test_cryptomatte_covers_the_ball():
    compositor = Compositor()
    node = compositor.tree.nodes.new("CompositorNodeCryptomatteV2")
    node.source, node.image = "IMAGE", compositor.image.image
    for layer, name in (("CryptoObject", "fluid"), ("CryptoMaterial", "water")):
        node.layer_name, node.matte_id = layer, name
        area = compositor.picture(node.outputs["Matte"])[:, :, 0].sum()
        radius = math.tan(math.asin(0.1 / 2)) * PIXELS_PER_RADIAN
        numpy.testing.assert_allclose(area, math.pi * radius**2, rtol=0.08)


def png_texts(path):
    data, at, texts = path.read_bytes(), 8, {}
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"tEXt":
            key, text = data[at + 8:at + 8 + size].split(b"\0", 1)
            texts[key.decode()] = text.decode("latin-1")
        at += 12 + size
    return texts


def test_the_header_is_read():
    """Blender 3.4 shows no header to Python, but writes what it read into what it saves."""
    for name, folder in (("ball", BALL), ("plate", PLATE)):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        image = bpy.data.images.load(str(folder / f"{name}.1001.exr"))
        with tempfile.TemporaryDirectory() as there:
            bpy.context.scene.render.image_settings.file_format = "PNG"
            image.save_render(str(Path(there) / "a.png"))
            texts = png_texts(Path(there) / "a.png")
        told = {key: texts.get(key) for key in ("shot", "frame", "seed")}
        assert told == {"shot": name, "frame": "1001", "seed": "1"}, texts


def test_a_frame_goes_over_a_plate():
    """Over a plate of one colour each thing is what its closed form says of it."""
    compositor = Compositor(PLATE / "plate.1001.exr")
    plate = numpy.array((0.2, 0.4, 0.8))
    over = compositor.tree.nodes.new("CompositorNodeAlphaOver")
    over.inputs[1].default_value = (*plate, 1)
    compositor.tree.links.new(compositor.layer_output("Combined"), over.inputs[2])
    picture = compositor.picture(over.outputs[0])
    opacity = compositor.layer("opacity")
    forward = numpy.array((0, -0.2, -4)) / math.hypot(0.2, 4)
    up = numpy.array((0, forward[2], -forward[1])) * -1
    scale = WIDTH / (2 * math.tan(math.radians(20)))

    def at(point):
        """Pixel, from the bottom left, of a point seen from the camera."""
        to = numpy.array(point) - (0, 1, 4)
        depth = to @ forward
        return int(HEIGHT / 2 + scale * (to @ up) / depth), int(WIDTH / 2 + scale * to[0] / depth)

    way = 0.25 * math.hypot(0.7, 0.2, 4) / 4  # through the slab's middle, aslant
    suns_left = math.sqrt(0.5) / (1 + math.sqrt(0.5))  # the card hides the one above
    for point, left in (((-0.7, 1.2, 0), math.exp(-2 * way)), ((0.7, 1.2, 0), 1),
                        ((0, 1.2, 0), 1), ((0, 0, -1), suns_left), ((0.8, 0, -2.5), 1)):
        name = str(point)
        numpy.testing.assert_allclose(picture[at(point)], plate * left, rtol=4e-3, err_msg=name)
        numpy.testing.assert_allclose(opacity[at(point)], 1 - left, atol=2e-3, err_msg=name)


run_tests(globals())
