// Particle caches: bytes of a particle, and the time to write and read them.

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <string>

#include "pipeline/contract/files/particles_file.h"
#include "sim/simulator.h"
#include "tests/bench/bench.h"
#include "tests/surfacing/scenes.h"

namespace drench::bench {
namespace {

constexpr double spacing = 0.01;  // m
constexpr int repeats = 5;        // the cheapest is taken: other work only ever adds

struct Round {
  Measured write, read;
  uint64_t bytes = 0;
};

Round round_trip(const ParticleFrame& frame, const std::filesystem::path& file) {
  Round best;
  for (int k = 0; k < repeats; ++k) {
    const Measured write = measure([&] { best.bytes = write_particles(file, frame).size; });
    const Measured read = measure([&] { read_particles(file); });
    if (k == 0 || write.cpu_s < best.write.cpu_s) best.write = write;
    if (k == 0 || read.cpu_s < best.read.cpu_s) best.read = read;
  }
  return best;
}

void emit_round(const std::string& columns, const ParticleFrame& frame, double gate_bytes,
                const Emit& emit) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / "drench_bench_particles.vdb";
  const Round round = round_trip(frame, file);
  std::filesystem::remove(file);
  const double millions = static_cast<double>(frame.position.size()) / 1e6;
  Line line;
  line.method = columns;
  line.resolution = std::to_string(frame.position.size()) + " particles";
  line.threads = hardware_threads();
  line.cost = Measured{round.write.wall_s + round.read.wall_s, round.write.cpu_s + round.read.cpu_s,
                       std::max(round.write.peak_mib, round.read.peak_mib)};
  line.error = static_cast<double>(round.bytes) / static_cast<double>(frame.position.size());
  line.error_of = "bytes a particle";
  if (gate_bytes > 0) line.gate = gate_bytes;
  line.more["write_cpu_s_a_million"] = round.write.cpu_s / millions;
  line.more["read_cpu_s_a_million"] = round.read.cpu_s / millions;
  emit(line);
}

/// A cube of 64,000 particles that collapses, 0.4 s after it was let go, sixteen times side by
/// side: the velocities of a flow, in a frame of a million.
ParticleFrame collapsing_cubes() {
  Shot shot;
  shot.name = shot.file = "dam";
  shot.timeline.first = 1001, shot.timeline.last = 1011;
  shot.fluid.spacing = 0.025;
  shot.domain.min = Imath::V3d(0), shot.domain.max = Imath::V3d(3, 2, 1);
  shot.fluid.box = {{Imath::V3d(0), Imath::V3d(1), Imath::V3d(0)}};
  Simulator simulator(shot, {.device = Device::cpu});
  while (simulator.frame() < shot.timeline.last) simulator.advance_frame();
  const ParticleFrame one = simulator.particles();
  ParticleFrame all;
  all.spacing = one.spacing;
  for (int copy = 0; copy < 16; ++copy) {
    const Imath::V3f by(3.17f * float(copy % 4), 0, 1.19f * float(copy / 4));
    for (const Imath::V3f& p : one.position) all.position.push_back(p + by);
    all.velocity.insert(all.velocity.end(), one.velocity.begin(), one.velocity.end());
  }
  return all;
}

/// Conversion, compression, digest and file there; file, check and conversion back.
void particle_cache(const Emit& emit) {
  emit_round("ball that turns: position, velocity",
             surfacing_scenes::relaxed_ball(1000000, spacing, 20, 1), 12, emit);
  emit_round("collapsing cubes: position, velocity", collapsing_cubes(), 12, emit);
  ParticleFrame frame = surfacing_scenes::splash(1000000, spacing, 1);
  emit_round("splash, velocities of noise: position, velocity", frame, 0, emit);
  frame.id.resize(frame.position.size());
  std::iota(frame.id.begin(), frame.id.end(), 0u);
  surfacing_scenes::shuffle(frame, 1);  // places by id are in no order, as after some time
  frame.density.assign(frame.position.size(), 1000.f);
  for (size_t i = 0; i < frame.density.size(); ++i) frame.density[i] += float(i % 17) - 8;
  emit_round("splash: position, velocity, density, id", frame, 0, emit);
}

const Registration cache{"particle_cache", "particle files: bytes, writing and reading of 1M",
                         particle_cache};

}  // namespace
}  // namespace drench::bench
