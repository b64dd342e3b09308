#include "pipeline/driver/layout.h"

#include <fmt/format.h>

namespace drench::layout {

std::string particles(int frame) { return fmt::format("sim/particles.{:04d}.vdb", frame); }
std::string cloth(const std::string& name, int frame) {
  return fmt::format("sim/cloth.{}.{:04d}.ply", name, frame);
}
std::string probe(const std::string& name) { return fmt::format("sim/probe.{}.csv", name); }
std::string checkpoint(int frame) { return fmt::format("sim/checkpoint/frame.{:04d}.ckpt", frame); }
std::string fluid_mesh(int frame) { return fmt::format("mesh/fluid.{:04d}.ply", frame); }
std::string fluid_obj(int frame) { return fmt::format("mesh/fluid.{:04d}.obj", frame); }
std::string level_set(int frame) { return fmt::format("mesh/fluid.{:04d}.vdb", frame); }
std::string foam(int frame) { return fmt::format("mesh/foam.{:04d}.vdb", frame); }
std::string image(const std::string& shot, int frame) {
  return fmt::format("render/{}.{:04d}.exr", shot, frame);
}
std::string noisy(const std::string& shot, int frame) {
  return fmt::format("noisy/{}.{:04d}.exr", shot, frame);
}
std::string frame_samples(const std::string& shot, int frame) {
  return fmt::format("render/{}.{:04d}.samples", shot, frame);
}
std::string refining(const std::string& shot, int frame) {
  return fmt::format("render/{}.{:04d}.refining.png", shot, frame);
}
bool is_in_work(std::string_view file) {
  return file.ends_with(".samples") || file.ends_with(".refining.png");
}
std::string movie(const std::string& shot) { return shot + ".mp4"; }

}  // namespace drench::layout
