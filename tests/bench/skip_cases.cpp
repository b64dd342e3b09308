// What a feature costs that a frame has and does not use: instructions, counted by callgrind in a
// process of each variant's own.

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "tests/bench/render_scenes.h"

namespace drench::bench {

namespace {

constexpr const char* kVariable = "DRENCH_BENCH_SKIP";  // says to a process what it renders

struct Frame {
  Shot shot;
  FrameGeometry geometry;
};

struct Variant {
  const char* name;
  void (*change)(Frame&);
};

Material material(const char* name, MaterialType type) {
  Material m;
  m.name = name;
  m.type = type;
  m.roughness = 0.3;
  return m;
}

Frame cloth_frame() {
  Frame frame{cloth_shot(), {{}, {{"cloth", pleated_sheet()}}}};
  frame.shot.render.motion_blur = false;
  frame.shot.render.photons = 0;
  return frame;
}

Frame pool_frame() {
  Frame frame = cloth_frame();
  frame.geometry.fluid = wavy_pool(32);
  frame.shot.light.erase(frame.shot.light.begin());  // the lamp: photons would have work
  return frame;
}

/// The first is the frame as it is; each of the others has something to no effect.
constexpr std::array kVariants{
    Variant{"as it is", [](Frame&) {}},
    Variant{"motion blur of what stands", [](Frame& f) { f.shot.render.motion_blur = true; }},
    Variant{"a lens of radius 0", [](Frame& f) { f.shot.camera.blades = 6; }},
    Variant{"photons without a light for them", [](Frame& f) { f.shot.render.photons = 1; }},
    Variant{"an empty sheet",
            [](Frame& f) {
              f.geometry.cloth.push_back({"empty", TriangleMesh{}});
            }},
    Variant{"a sheet with a column of no water",
            [](Frame& f) {
              TriangleMesh& sheet = f.geometry.cloth[0].mesh;
              sheet.wetness.assign(sheet.position.size(), 0.f);
            }},
    Variant{"materials on nothing",
            [](Frame& f) {
              f.shot.material.push_back(material("steel", MaterialType::metal));
              f.shot.material.push_back(material("paint", MaterialType::coated));
              f.shot.material.push_back(material("glass", MaterialType::dielectric));
            }},
};

/// A number of the variant beyond the last renders nothing.
void render_variant(Frame frame, size_t number) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  if (number >= kVariants.size()) return;
  kVariants[number].change(frame);
  render(frame.shot, frame.geometry, 4, 1);
}

/// @throws std::runtime_error without callgrind
double instructions(const char* picture, size_t number) {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe");
  const std::string command = fmt::format(
      "{}={}{} valgrind --tool=callgrind --callgrind-out-file=/dev/null '{}' render_skips 2>&1",
      kVariable, picture, number, self);
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) throw std::runtime_error("render_skips: valgrind cannot be started");
  std::string said;
  for (int c; (c = std::fgetc(pipe)) != EOF;) said += char(c);
  const size_t found = said.find("Collected : ");
  if (pclose(pipe) != 0 || found == std::string::npos)
    throw std::runtime_error("render_skips: valgrind failed (./bench installs it): " + said);
  return std::stod(said.substr(found + 12));
}

void emit_picture(const Emit& emit, const char* key, const std::string& picture) {
  const double start = instructions(key, kVariants.size());
  const double plain = instructions(key, 0) - start;
  for (size_t k = 1; k < kVariants.size(); ++k) {
    Line line;
    line.method = picture + ", " + kVariants[k].name;
    line.resolution = fmt::format("{} x {} pixels, 4 samples", kSmallWidth, kSmallHeight);
    line.threads = 1;
    line.error = (instructions(key, k) - start) / plain;
    line.error_of = "instructions over those of the picture without it";
    line.gate = 1.01;
    line.more["million_instructions"] = plain * 1e-6;
    emit(line);
  }
}

void render_skips(const Emit& emit) {
  if (const char* variant = std::getenv(kVariable)) {
    render_variant(variant[0] == 'p' ? pool_frame() : cloth_frame(), std::stoul(variant + 1));
    return;
  }
  emit_picture(emit, "c", "cloth");
  emit_picture(emit, "p", "cloth and pool");
}

const Registration render_skips_case{
    "render_skips", "instructions that features take which a frame has and does not use",
    render_skips};

}  // namespace

}  // namespace drench::bench
