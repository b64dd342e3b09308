// Case render_skips: what a feature costs that a frame has and does not use.

#include <fmt/format.h>

#include <array>
#include <string>

#include "tests/bench/instructions.h"
#include "tests/bench/render_scenes.h"

namespace drench::bench {

namespace {

struct Frame {
  Shot shot;
  render::FrameGeometry geometry;
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
constexpr std::array variants{
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

void render_variant(Frame frame, size_t number) {
  variants[number].change(frame);
  count_instructions([&] { render(frame.shot, frame.geometry, 4, 1); });
}

void emit_picture(const Emit& emit, const std::string& key, const std::string& picture) {
  const auto count = [&](size_t number) {
    return instructions("render_skips", key + std::to_string(number));
  };
  const double plain = count(0);
  for (size_t k = 1; k < variants.size(); ++k) {
    Line line;
    line.method = picture + ", " + variants[k].name;
    line.resolution = fmt::format("{} x {} pixels, 4 samples", small_width, small_height);
    line.threads = 1;
    line.error = count(k) / plain;
    line.error_of = "instructions over those of the picture without it";
    line.gate = 1.01;
    line.more["million_instructions"] = plain * 1e-6;
    emit(line);
  }
}

void render_skips(const Emit& emit) {
  if (const char* variant = variant_to_count()) {
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
