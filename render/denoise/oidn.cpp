#include "render/denoise/oidn.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "pipeline/contract/error.h"

namespace drench::render {

namespace {

using Plane = NoisyPicture::Plane;

constexpr int cpu_device = 1, float3 = 3;

/// Three planes as one, pixel by pixel.
std::vector<float> packed(const Plane* const (&planes)[3]) {
  std::vector<float> out(3 * planes[0]->size());
  for (size_t p = 0; p < planes[0]->size(); ++p)
    for (size_t c = 0; c < 3; ++c) out[3 * p + c] = (*planes[c])[p];
  return out;
}

std::vector<float> packed_features(const NoisyPicture& picture, size_t first) {
  return packed(
      {&picture.feature[first], &picture.feature[first + 1], &picture.feature[first + 2]});
}

std::vector<float> packed_colours(const NoisyPicture& picture) {
  const auto* first = picture.half[0];
  const auto* second = picture.half[1];
  std::vector<float> out = packed({&first[0], &first[1], &first[2]});
  for (size_t p = 0; p < first[0].size(); ++p)
    for (size_t c = 0; c < 3; ++c) out[3 * p + c] = (out[3 * p + c] + second[c][p]) / 2;
  return out;
}

void* opened(const std::string& file) {
  if (!file.empty()) return dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  for (const char* name :
       {"libOpenImageDenoise.so.2", "libOpenImageDenoise.so.1", "libOpenImageDenoise.so"})
    if (void* library = dlopen(name, RTLD_NOW | RTLD_LOCAL)) return library;
  return nullptr;
}

}  // namespace

/// What is used of the library's C interface (OpenImageDenoise/oidn.h), by the names of version 2
/// or of version 1.
struct OpenImageDenoise::Library {
  using Device = struct OidnDevice*;
  using Filter = struct OidnFilter*;

  void* handle = nullptr;
  Device device = nullptr;
  Device (*new_device)(int type) = nullptr;
  void (*set_device_flag)(Device, const char* name, bool value) = nullptr;
  int (*device_number)(Device, const char* name) = nullptr;
  void (*commit_device)(Device) = nullptr;
  int (*device_error)(Device, const char** message) = nullptr;
  void (*release_device)(Device) = nullptr;
  Filter (*new_filter)(Device, const char* type) = nullptr;
  void (*set_image)(Filter, const char* name, void* pixels, int format, size_t width, size_t height,
                    size_t offset, size_t pixel_stride, size_t row_stride) = nullptr;
  void (*set_filter_flag)(Filter, const char* name, bool value) = nullptr;
  void (*commit_filter)(Filter) = nullptr;
  void (*execute)(Filter) = nullptr;
  void (*release_filter)(Filter) = nullptr;

  ~Library() {
    if (device) release_device(device);
    if (handle) dlclose(handle);
  }

  template <class Function>
  void find(Function*& function, const char* name, const char* older = nullptr) {
    void* symbol = dlsym(handle, name);
    if (!symbol && older) symbol = dlsym(handle, older);
    if (!symbol)
      throw Error(fmt::format(
          "render.denoiser is \"oidn\", but the library found has no function "
          "{}; install a release of Open Image Denoise from 2020 or later, or use the denoiser "
          "\"regression\"",
          name));
    function = reinterpret_cast<Function*>(symbol);
  }

  void find_all() {
    find(new_device, "oidnNewDevice");
    find(set_device_flag, "oidnSetDeviceBool", "oidnSetDevice1b");
    find(device_number, "oidnGetDeviceInt", "oidnGetDevice1i");
    find(commit_device, "oidnCommitDevice");
    find(device_error, "oidnGetDeviceError");
    find(release_device, "oidnReleaseDevice");
    find(new_filter, "oidnNewFilter");
    find(set_image, "oidnSetSharedFilterImage");
    find(set_filter_flag, "oidnSetFilterBool", "oidnSetFilter1b");
    find(commit_filter, "oidnCommitFilter");
    find(execute, "oidnExecuteFilter");
    find(release_filter, "oidnReleaseFilter");
  }

  void check() const {
    const char* message = "";
    if (device_error(device, &message) == 0) return;
    throw Error(fmt::format("Open Image Denoise: {}; mend that, or use the denoiser \"regression\"",
                            message));
  }
};

OpenImageDenoise::OpenImageDenoise(const std::string& file) : library_(new Library) {
  library_->handle = opened(file);
  if (!library_->handle)
    throw Error(
        fmt::format("render.denoiser is \"oidn\", but Open Image Denoise cannot be loaded: {}. "
                    "Install it, let LD_LIBRARY_PATH name its folder, or use the denoiser "
                    "\"regression\"",
                    dlerror()));
  library_->find_all();
  library_->device = library_->new_device(cpu_device);
  library_->check();
  // Threads that it ties to cores would be those that render the next frame.
  library_->set_device_flag(library_->device, "setAffinity", false);
  library_->commit_device(library_->device);
  library_->check();
}

OpenImageDenoise::~OpenImageDenoise() = default;

int OpenImageDenoise::version() const {
  return library_->device_number(library_->device, "version");
}

std::vector<Plane> OpenImageDenoise::denoise(const NoisyPicture& picture) const {
  std::vector<float> colour = packed_colours(picture), albedo = packed_features(picture, 0),
                     normal = packed_features(picture, 3), clean(colour.size());
  const std::unique_ptr<struct OidnFilter, decltype(library_->release_filter)> filter(
      library_->new_filter(library_->device, "RT"), library_->release_filter);
  library_->check();
  const auto image = [&](const char* name, std::vector<float>& pixels) {
    library_->set_image(filter.get(), name, pixels.data(), float3, size_t(picture.width),
                        size_t(picture.height), 0, 0, 0);
  };
  image("color", colour);
  image("albedo", albedo);
  image("normal", normal);
  image("output", clean);
  library_->set_filter_flag(filter.get(), "hdr", true);
  library_->commit_filter(filter.get());
  library_->execute(filter.get());
  library_->check();
  std::vector<Plane> out(3, Plane(clean.size() / 3));
  for (size_t p = 0; p < clean.size(); ++p) out[p % 3][p / 3] = clean[p];
  return out;
}

}  // namespace drench::render
