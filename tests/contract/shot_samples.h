#pragma once
// A shot that has one of everything, for tests that walk the whole table.

#include <string>

#include "pipeline/contract/files/files.h"
#include "tests/temporary_folder.h"

namespace drench::test {

/// Files that full_shot names, in `folder`.
inline void write_shot_files(const TemporaryFolder& folder) {
  write_file_whole(folder / "flag.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n");
  write_file_whole(folder / "drop.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n");
  write_file_whole(folder / "sky.exr", "a map");
  write_file_whole(folder / "weave.png", "a texture");
}

inline const char* full_shot() {
  return R"toml(# one of everything
[shot]
frames = [1001, 1024]
fps = 24
preroll = 0.5
seed = 7

[domain]
min = [-1, 0, -1]
max = [1, 2, 1]
z = "open"

[fluid]
spacing = 0.02

[[fluid.box]]
min = [-0.5, 0.1, -0.5]
max = [0.5, 0.3, 0.5]

[[fluid.sphere]]
center = [0, 1, 0]
radius = 0.2

[[fluid.emitter]]
center = [0, 1.8, 0]
direction = [0, -1, 0.1]
radius = 0.1
speed = 2
stop = 1

[[fluid.emitter]]
type = "rectangle"
center = [[1001, [0.5, 1.5, 0]], [1012, [0.6, 1.5, 0]]]
u = [0.1, 0, 0]
v = [0, 0, 0.05]
speed = 1
stop = 0.2
interp = "smooth"

[[fluid.emitter]]
type = "mesh"
mesh = "drop.obj"
center = [0.2, 1.5, 0]
rotation_deg = [[1001, [0, 0, 0]], [1012, [0, 90, 0]]]
scale = 0.2
velocity = [0, -1, 0]

[[fluid.volume]]
mesh = "drop.obj"
position = [0, 1.4, 0]
scale = 0.1

[[fluid.drops]]
min = [-0.5, 1.2, -0.5]
max = [0.5, 1.5, 0.5]
radius = 0.05
count = 4

[[sink]]
type = "box"
name = "drain"
position = [[1001, [0.8, 0.1, 0]], [1024, [0.8, 0.2, 0]]]
size = [0.3, 0.2, 0.3]
start = 0.5

[[cloth]]
name = "sheet"
cells = [8, 6]
pins = ["corners", "edge_v0"]

[[cloth.pin]]
box = {min = [-1, 0, -1], max = [0, 2, 0]}
position = [[1001, [0, 0, 0]], [1012, [0, 0.5, 0]]]
rotation_deg = [[1001, [0, 0, 0]], [1024, [0, 45, 0]]]
interp = "smooth"
pivot = [0, 1, 0]
release = 0.75
stiffness = 20

[[cloth.seam]]
edge = "u0"
to_edge = "u1"
time = 0.5

[[cloth]]
name = "flag"
mesh = "flag.obj"
model = "shell"
fabric = "silk"
young_weft = 9000

[[cloth.pin]]
vertices = [0]

[[probe]]
type = "height"

[[probe]]
type = "pressure"
name = "floor"
radius = 0.05

[[probe]]
type = "force"
target = "sheet"

[[probe]]
type = "tip"
cloth = "sheet"

[[probe]]
type = "front"

[foam]
lifetime = 2

[camera]
position = [[1001, [0, 1, 3]], [1024, [1, 1, 3]]]
fov_deg = [[1001, 40], [1024, 35.5]]
interp = "smooth"

[[light]]
type = "rectangle"

[[light]]
type = "sphere"

[[light]]
type = "sun"
name = "sun"

[[light]]
type = "environment"
name = "sky"
map = "sky.exr"

[[material]]
name = "water"
absorption = [0.5, 0.1, 0.05]

[[material]]
name = "canvas"
type = "cloth"
reflectance = "srgb(200, 180, 40)"
texture = "weave.png"
sheen = [0.2, 0.2, 0.3]
sheen_roughness = 0.25
yarn_specular = [0.1, 0.1, 0.05]
yarn_roughness = 0.5
gap = 0.05
film_roughness = 0.35

[ground]
height = -0.01

[quality.preview.fluid]
spacing = 0.04

[quality.preview.cloth.sheet]
cells = [4, 2]

[quality.preview.render]
width = 96
)toml";
}

}  // namespace drench::test
