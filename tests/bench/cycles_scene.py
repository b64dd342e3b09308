"""Renders a scene of render_vs_cycles with Blender's Cycles: see cycles_cases.cpp.

    blender -b --factory-startup --python cycles_scene.py -- SCENE.json SAMPLES SEED OUT.exr

Every setting that trades truth for speed is off: clamps, denoiser, adaptive sampling, filtered
glossy rays, the threshold of lights. The last line on stdout has the CPU seconds of the render,
which makes its acceleration structures and writes the file; meshes are read before.
"""

import importlib.util
import json
import math
import os
import sys
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

LOADER = Path(__file__).resolve().parents[2] / "pipeline/blender/load_drench.py"
UPRIGHT = Matrix.Rotation(math.pi / 2, 4, "X")  # Drench's Y is up, Blender's is Z
SPECULAR = 128  # reflections and refractions that a path may take


def loader():
    spec = importlib.util.spec_from_file_location("load_drench", LOADER)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def grey(value):
    return (value, value, value, 1)


def material_of(look):
    material = bpy.data.materials.new(look["type"])
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    if look["type"] == "dielectric":
        surface = nodes.new("ShaderNodeBsdfGlass")
        surface.distribution = "SHARP"
        surface.inputs["Color"].default_value = grey(1)
        surface.inputs["IOR"].default_value = look["ior"]
    else:
        surface = nodes.new("ShaderNodeBsdfDiffuse")
        surface.inputs["Color"].default_value = grey(look["reflectance"])
    if look["type"] == "cloth":
        through = nodes.new("ShaderNodeBsdfTranslucent")
        through.inputs["Color"].default_value = grey(look["transmittance"])
        both = nodes.new("ShaderNodeAddShader")
        links.new(surface.outputs[0], both.inputs[0])
        links.new(through.outputs[0], both.inputs[1])
        surface = both
    links.new(surface.outputs[0], output.inputs["Surface"])
    return material


def add_mesh(scene, load, thing):
    mesh = bpy.data.meshes.new("mesh")
    load.fill(mesh, *load.read_ply(Path(thing["file"])))
    mesh.polygons.foreach_set("use_smooth", [False] * len(mesh.polygons))
    mesh.materials.append(material_of(thing["material"]))
    placed = bpy.data.objects.new("mesh", mesh)
    placed.matrix_world = UPRIGHT
    scene.collection.objects.link(placed)



def placed(x, y, z, origin):
    """The matrix that takes the axes to x, y, z and zero to origin, in Drench's space."""
    turn = Matrix((x, y, z)).transposed().to_4x4()
    return UPRIGHT @ Matrix.Translation(origin) @ turn


def add_lamp(scene, lamp):
    u, v = Vector(lamp["u"]), Vector(lamp["v"])
    light = bpy.data.lights.new("lamp", "AREA")
    light.shape = "RECTANGLE"
    light.size, light.size_y = 2 * u.length, 2 * v.length
    # Cycles: radiance is a quarter of the power over the area.
    light.energy = 4 * lamp["radiance"] * light.size * light.size_y
    light.cycles.max_bounces = 1024
    light.cycles.use_multiple_importance_sampling = True
    shining = bpy.data.objects.new("lamp", light)
    away = u.cross(v).normalized()  # a lamp shines along its -Z
    shining.matrix_world = placed(u.normalized(), -v.normalized(), -away, Vector(lamp["center"]))
    scene.collection.objects.link(shining)
    back = bpy.data.meshes.new("back")  # Cycles' lamps let the sky through from behind
    corner = [Vector((x * light.size, y * light.size_y, 1e-4)) for x, y in
              ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
    back.from_pydata(corner, [], [(0, 1, 2, 3)])
    back.materials.append(material_of({"type": "diffuse", "reflectance": 0}))
    behind = bpy.data.objects.new("back", back)
    behind.matrix_world = shining.matrix_world
    scene.collection.objects.link(behind)


def add_camera(scene, view):
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "HORIZONTAL"
    camera.angle = math.radians(view["fov_deg"])
    camera.clip_start = 1e-4
    back = (Vector(view["position"]) - Vector(view["target"])).normalized()
    right = Vector((0, 1, 0)).cross(back).normalized()
    seen = bpy.data.objects.new("camera", camera)
    seen.matrix_world = placed(right, back.cross(right), back, Vector(view["position"]))
    scene.collection.objects.link(seen)
    scene.camera = seen


def add_sky(scene, radiance):
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = grey(1)
    background.inputs["Strength"].default_value = radiance


def set_up(scene, description, samples, seed):
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = description["width"], description["height"]
    render.resolution_percentage = 100
    render.fps, render.fps_base = round(description["fps"]), 1
    render.use_motion_blur = description["shutter"] > 0
    render.motion_blur_shutter = description["shutter"]
    render.threads_mode, render.threads = "FIXED", description["threads"]
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    cycles.device = "CPU"
    cycles.samples, cycles.seed = samples, seed
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.motion_blur_position = "CENTER"
    cycles.pixel_filter_type, cycles.filter_width = "BLACKMAN_HARRIS", 1.5
    cycles.diffuse_bounces = description["depth"]
    cycles.max_bounces = cycles.transparent_max_bounces = 2 * SPECULAR
    cycles.glossy_bounces = cycles.transmission_bounces = SPECULAR


def main():
    scene_file, samples, seed, out = sys.argv[sys.argv.index("--") + 1:]
    description = json.loads(Path(scene_file).read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, load = bpy.context.scene, loader()
    set_up(scene, description, int(samples), int(seed))
    for thing in description["meshes"]:
        add_mesh(scene, load, thing)
    for lamp in description["lamps"]:
        add_lamp(scene, lamp)
    add_camera(scene, description["camera"])
    add_sky(scene, description["sky"])
    scene.render.filepath = out
    before = os.times()
    bpy.ops.render.render(write_still=True)
    after = os.times()
    cpu = after.user + after.system - before.user - before.system
    print(json.dumps({"cpu_s": cpu, "wall_s": after.elapsed - before.elapsed}))


main()
