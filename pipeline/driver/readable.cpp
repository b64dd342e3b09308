#include "pipeline/driver/readable.h"

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/foam_file.h"
#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/files/particles_file.h"
#include "render/denoise/noisy_frame.h"
#include "render/renderer.h"

namespace drench {

namespace {

void read(const std::filesystem::path& file) {
  const std::string name = file.filename().string(), extension = file.extension().string();
  if (extension == ".vdb" && name.starts_with("particles.")) (void)read_particles(file);
  if (extension == ".vdb" && name.starts_with("foam.")) (void)read_foam(file);
  if (extension == ".ply") (void)read_mesh(file);
  const bool noisy = file.parent_path().filename() == "noisy";
  if (extension == ".exr" && noisy) (void)render::picture_of(render::read_layers(file));
  if (extension == ".exr" && !noisy) (void)render::read_exr(file);
}

}  // namespace

std::string why_unreadable(const std::filesystem::path& file) {
  try {
    read(file);
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

}  // namespace drench
