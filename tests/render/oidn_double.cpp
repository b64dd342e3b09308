// A library with the C interface of Open Image Denoise (OpenImageDenoise/oidn.h), by the names of
// version 2, or 1 with OIDN_DOUBLE_1, for machines that have no such library. It denoises nothing:
// a pixel becomes colour + 10 albedo + 100 normal, so that a test sees which plane came where. It
// refuses what the interface forbids, and pictures one pixel wide.

#include <cstddef>
#include <map>
#include <string>

#ifdef OIDN_DOUBLE_1
#define FLAG(object) oidnSet##object##1b
#define NUMBER oidnGetDevice1i
#else
#define FLAG(object) oidnSet##object##Bool
#define NUMBER oidnGetDeviceInt
#endif

namespace drench::render::test {

int alive = 0;

struct Device {
  std::string error;
  bool affinity = true, committed = false;
  Device() { ++alive; }
  ~Device() { --alive; }
};

struct Image {
  float* pixels;
  int format;
  size_t width, height;
};

struct Filter {
  explicit Filter(Device& on) : device(on) { ++alive; }
  ~Filter() { --alive; }

  Device& device;
  std::map<std::string, Image> image;
  bool hdr = false, committed = false;

  std::string forbidden() {
    if (!committed) return "the filter is not committed";
    if (!hdr) return "the picture is not said to be HDR";
    if (image.size() != 4) return "an image is missing";
    for (const auto& [name, i] : image) {
      if (i.format != 3) return name + " is no FLOAT3";
      if (i.width != image["color"].width || i.height != image["color"].height)
        return name + " is of another size";
    }
    return image["color"].width == 1 ? "out of memory for one pixel" : "";
  }

  void execute() {
    device.error = forbidden();
    if (!device.error.empty()) return;
    for (size_t p = 0; p < 3 * image["color"].width * image["color"].height; ++p)
      image["output"].pixels[p] = image["color"].pixels[p] + 10 * image["albedo"].pixels[p] +
                                  100 * image["normal"].pixels[p];
  }
};

}  // namespace drench::render::test

using drench::render::test::Device;
using drench::render::test::Filter;

#pragma GCC visibility push(default)

extern "C" {

int oidn_double_alive() { return drench::render::test::alive; }

Device* oidnNewDevice(int) { return new Device; }
void FLAG(Device)(Device* device, const char* name, bool value) {
  if (name == std::string("setAffinity")) device->affinity = value;
}
int NUMBER(Device*, const char* name) { return name == std::string("version") ? 20301 : 0; }
void oidnCommitDevice(Device* device) {
  if (device->affinity) device->error = "threads are tied to cores";
  device->committed = true;
}
int oidnGetDeviceError(Device* device, const char** message) {
  static std::string last;
  last = device->error;
  device->error.clear();
  *message = last.c_str();
  return last.empty() ? 0 : 1;
}
void oidnReleaseDevice(Device* device) { delete device; }

Filter* oidnNewFilter(Device* device, const char* type) {
  if (!device->committed) device->error = "the device is not committed";
  if (type != std::string("RT")) device->error = "no such filter";
  return new Filter(*device);
}
void oidnSetSharedFilterImage(Filter* filter, const char* name, void* pixels, int format,
                              size_t width, size_t height, size_t, size_t, size_t) {
  filter->image[name] = {static_cast<float*>(pixels), format, width, height};
}
void FLAG(Filter)(Filter* filter, const char* name, bool value) {
  if (name == std::string("hdr")) filter->hdr = value;
}
void oidnCommitFilter(Filter* filter) { filter->committed = true; }
void oidnExecuteFilter(Filter* filter) { filter->execute(); }
void oidnReleaseFilter(Filter* filter) { delete filter; }

}  // extern "C"

#pragma GCC visibility pop
