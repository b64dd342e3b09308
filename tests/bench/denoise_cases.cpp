// The denoiser across frames: a sheet whose pleats wander and a pool whose waves do, seen by a
// camera that moves. Error and flicker of frames denoised alone and with their neighbours.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "render/denoise/noisy_frame.h"
#include "render/options.h"
#include "tests/bench/render_scenes.h"

namespace drench::bench {

namespace {

constexpr int reference = 800;             // samples
constexpr int first = 1001, measured = 3;  // frames that are compared
constexpr int frame_radius = 2;            // frames beside them
constexpr float fps = 24;

/// Pleats that wander by their length in a second.
render::FrameGeometry cloth_at(int frame) {
  TriangleMesh mesh = pleated_sheet();
  const float rate = 2 * float(std::numbers::pi);  // 1/s
  const float phase = rate * float(frame - first) / fps;
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    V3f& p = mesh.position[v];
    const float angle = 30 * p.x + 3 * p.y - phase, deep = 0.05f * (1.2f - p.y);
    p.z = deep * std::sin(angle);
    mesh.velocity[v] = {0, 0, -rate * deep * std::cos(angle)};
  }
  return {{}, {{"cloth", std::move(mesh)}}};
}

/// Waves of 0.9 m that wander at about the speed of deep water, 1.2 m/s.
render::FrameGeometry pool_at(int frame) {
  TriangleMesh mesh = wavy_pool();
  const float rate = 8;  // 1/s
  const float phase = rate * float(frame - first) / fps;
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    V3f& p = mesh.position[v];
    if (p.y < 0.2f) continue;
    const float one = 7 * p.x + 2 * p.z - phase, other = 5 * p.z - 3 * p.x - phase;
    p.y = 0.35f + 0.03f * (std::sin(one) + std::sin(other));
    mesh.velocity[v] = {0, -0.03f * rate * (std::cos(one) + std::cos(other)), 0};
  }
  return {std::move(mesh), {}};
}

/// 192 x 108 pixels, the camera on its way at 0.7 m/s.
Shot moving(Shot shot) {
  shot.render.width = 192;
  shot.render.height = 108;
  shot.render.denoise = true;
  shot.ground.material = "tiles";
  shot.material.emplace_back();
  shot.material.back().name = "tiles";
  shot.material.back().checker = true;
  shot.material.back().checker_size = 0.5;
  const V3d from = shot.camera.position.keys.front().second, by(0.03, 0, 0);
  shot.camera.position.keys = {
      {first - frame_radius, from - by * frame_radius},
      {first + measured + frame_radius, from + by * (measured + frame_radius)}};
  return shot;
}

struct Sequence {
  std::string name;
  Shot shot;
  render::FrameGeometry (*geometry)(int frame);
};

/// A frame as it is rendered, with what denoising takes.
render::Film noisy_frame(const Sequence& sequence, int frame, int samples) {
  Shot shot = sequence.shot;
  shot.render.samples = samples;
  render::RenderOptions options;
  options.denoised = render::Denoised::later;
  return render::render_frame(shot, frame, sequence.geometry(frame), options);
}

std::vector<render::Film> references(const Sequence& sequence) {
  Shot shot = sequence.shot;
  shot.render.denoise = false;
  shot.render.samples = reference;
  shot.render.seed = 1000;
  std::vector<render::Film> out;
  for (int frame = first; frame < first + measured; ++frame)
    out.push_back(render::render_frame(shot, frame, sequence.geometry(frame)));
  return out;
}

/// Mean over pixels, colours and pairs of frames of the squared change of the error from one frame
/// to the next, over (colour^2 + 0.01).
double flicker(const std::vector<render::Film>& films, const std::vector<render::Film>& truth) {
  double sum = 0, count = 0;
  for (size_t f = 1; f < films.size(); ++f)
    for (size_t k = 0; k < films[f].rgba.size(); ++k) {
      if (k % 4 == 3) continue;
      const double r = truth[f].rgba[k];
      const double change = (films[f].rgba[k] - r) - (films[f - 1].rgba[k] - truth[f - 1].rgba[k]);
      sum += change * change / (r * r + 0.01);
      ++count;
    }
  return sum / count;
}

struct Quality {
  double error = 0, flicker = 0;
};

Quality quality_of(const std::vector<render::Film>& films, const std::vector<render::Film>& truth) {
  Quality out{0, flicker(films, truth)};
  for (size_t f = 0; f < films.size(); ++f)
    out.error += relative_mse(films[f], truth[f]) / double(films.size());
  return out;
}

/// Frames denoised by `radius` neighbours on either side; noisy[frame_radius] is the first of them.
std::vector<render::Film> denoised(const std::vector<render::Film>& noisy, int radius) {
  std::vector<render::Film> out;
  for (int f = frame_radius; f < frame_radius + measured; ++f) {
    render::Neighbours neighbours;
    for (int k = 1; k <= radius; ++k) {
      neighbours.before.push_back(render::picture_of(noisy[size_t(f - k)]));
      neighbours.after.push_back(render::picture_of(noisy[size_t(f + k)]));
    }
    render::Film film = noisy[size_t(f)];
    put_clean(film, denoise(render::picture_of(film), std::move(neighbours)));
    out.push_back(std::move(film));
  }
  return out;
}

void emit_sequence(const Emit& emit, const Sequence& sequence) {
  const std::vector<render::Film> truth = references(sequence);
  for (const int samples : {16, 64}) {
    std::vector<render::Film> noisy;
    for (int f = -frame_radius; f < measured + frame_radius; ++f)
      noisy.push_back(noisy_frame(sequence, first + f, samples));
    const std::vector<render::Film> bare(noisy.begin() + frame_radius,
                                         noisy.begin() + frame_radius + measured);
    Quality alone;
    for (int radius = 0; radius <= frame_radius; ++radius) {
      std::vector<render::Film> films;
      Line line;
      line.cost = measure([&] { films = denoised(noisy, radius); });
      const Quality quality = quality_of(films, truth);
      if (radius == 0) alone = quality;
      line.method = fmt::format("{}, {} frames beside", sequence.name, radius);
      line.resolution = "192 x 108 pixels";
      line.threads = hardware_threads();
      line.error = quality.flicker / alone.flicker;
      line.error_of = "flicker over that of frames denoised alone";
      line.gate = 1;
      line.more["samples"] = samples;
      line.more["rel_mse"] = quality.error;
      line.more["flicker"] = quality.flicker;
      line.more["noisy_rel_mse"] = quality_of(bare, truth).error;
      line.more["cpu_s_a_frame"] = line.cost->cpu_s / measured;
      emit(line);
    }
  }
}

void render_denoise_frames(const Emit& emit) {
  Shot sky = pool_shot();
  sky.light.erase(sky.light.begin());
  emit_sequence(emit, {"moving cloth", moving(cloth_shot()), cloth_at});
  emit_sequence(emit, {"moving pool under the sky", moving(sky), pool_at});
}

const Registration render_denoise_frames_case{
    "render_denoise_frames", "moving cloth and a pool: error and flicker denoised across frames",
    render_denoise_frames};

}  // namespace

}  // namespace drench::bench
