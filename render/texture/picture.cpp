#include "render/texture/picture.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <new>
#include <span>
#include <string_view>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "pipeline/contract/log.h"
#include "render/color/color.h"
#include "render/texture/icc_profile.h"
#include "render/texture/picture_file.h"

namespace drench::render {

namespace {

namespace fs = std::filesystem;

constexpr uint64_t max_file_size = uint64_t(1) << 32;
constexpr uint64_t max_pixels = uint64_t(1) << 28;  // 16384 x 16384
/// Beyond this a conversion of primaries may leave float's range.
constexpr float max_sample = 1e37f;
constexpr double bytes_per_gib = double(1 << 30);

using Reader = Raster (*)(const PictureFile&);
struct Format {
  const char* name;
  std::string_view magic;
  Reader read;
};

using namespace std::string_view_literals;
constexpr Format known_formats[] = {
    {"PNG", "\x89PNG"sv, read_png},
    {"JPEG", "\xff\xd8\xff"sv, read_jpeg},
    {"EXR", "\x76\x2f\x31\x01"sv, read_exr_picture},
    {"HDR", "#?"sv, read_hdr},
    {"TIFF", "II*\0"sv, read_tiff},
    {"TIFF", "MM\0*"sv, read_tiff},
    {"TIFF", "II+\0"sv, read_tiff},
    {"TIFF", "MM\0+"sv, read_tiff},
};

/// What a file is by bytes that stand at an offset in it.
struct Signature {
  size_t at;
  std::string_view bytes, name;
};
constexpr Signature unread_formats[] = {
    {0, "GIF8"sv, "a GIF"},
    {8, "WEBP"sv, "a WebP"},
    {0, "BM"sv, "a BMP"},
    {0, "8BPS"sv, "a Photoshop document"},
    {0, "DDS "sv, "a DDS"},
    {4, "ftypavif"sv, "an AVIF"},
    {4, "ftyphei"sv, "a HEIF"},
    {4, "ftypmif1"sv, "a HEIF"},
    {4, "jP  \r\n"sv, "a JPEG 2000"},
    {0, "\xff\x0a"sv, "a JPEG XL"},
    {4, "JXL \r\n"sv, "a JPEG XL"},
    {0, "\xabKTX"sv, "a KTX"},
    {0, "PF\n"sv, "a PFM"},
    {0, "Pf\n"sv, "a PFM"},
    {0, "P6"sv, "a PPM"},
    {0, "P5"sv, "a PGM"},
    {0, "SDPX"sv, "a DPX"},
    {0, "XPDS"sv, "a DPX"},
    {0, "gimp xcf"sv, "a GIMP document"},
    {0, "%PDF"sv, "a PDF"},
    {0, "PK\x03\x04"sv, "a ZIP archive"},
    {0, "\x1f\x8b"sv, "a gzip archive"},
    {0, "BLENDER"sv, "a Blender file"},
    {0, "<svg"sv, "an SVG"},
    {0, "<?xml"sv, "XML text"},
    {0, "<!DOCTYPE"sv, "a web page, no download of a picture"},
    {0, "<html"sv, "a web page, no download of a picture"},
    {0, "version https://git-lfs"sv, "a pointer of Git LFS; fetch the file itself"},
};

bool holds(const std::vector<std::byte>& file, size_t at, std::string_view bytes) {
  return file.size() >= at + bytes.size() &&
         std::memcmp(file.data() + at, bytes.data(), bytes.size()) == 0;
}

/// "it is a WebP", or its first bytes.
std::string looks_like(const std::vector<std::byte>& file) {
  if (file.empty()) return "it is empty";
  for (const Signature& known : unread_formats)
    if (holds(file, known.at, known.bytes)) return fmt::format("it is {}", known.name);
  std::string codes;
  for (size_t k = 0; k < std::min<size_t>(file.size(), 8); ++k)
    codes += fmt::format("{}{:02x}", k > 0 ? " " : "", int(file[k]));
  return fmt::format("its first bytes are {}, which begin no known format", codes);
}

[[noreturn]] void fail_unread(const fs::path& path, const std::vector<std::byte>& file) {
  throw Error(fmt::format("{}: not a usable picture: {}; give an EXR, HDR, PNG, JPEG or TIFF",
                          path.string(), looks_like(file)));
}

template <class Value, class Finite>
void check_finite(const PictureFile& file, const Raster& picture, const Finite& finite) {
  for (size_t p = 0; p < picture.pixels(); ++p)
    for (int c = 0; c < picture.colours; ++c) {
      Value value;
      std::memcpy(&value,
                  picture.bytes.data() + (p * size_t(picture.stride) + size_t(c)) * sizeof(Value),
                  sizeof value);
      if (!finite(value))
        file.fail(fmt::format("pixel {}, {} is {} ({}); repair it", p % size_t(picture.width),
                              p / size_t(picture.width),
                              std::isfinite(float(value))
                                  ? fmt::format("above {} in size", max_sample)
                                  : "not finite",
                              float(value)));
    }
}

void check_finite(const PictureFile& file, const Raster& picture) {
  if (picture.sample == Raster::Sample::f16)
    check_finite<Imath::half>(file, picture, [](Imath::half h) { return h.isFinite(); });
  if (picture.sample == Raster::Sample::f32)
    check_finite<float>(file, picture, [](float f) { return std::abs(f) <= max_sample; });
}

bool is_real(Raster::Sample sample) {
  return sample == Raster::Sample::f16 || sample == Raster::Sample::f32;
}

bool is_curved(const ColourCode& code) {
  for (const auto& curve : code.to_linear)
    for (int k = 0; k <= 255; ++k)
      if (std::abs(curve(float(k) / 255) - float(k) / 255) > 1e-3f) return true;
  return false;
}

std::string described(const Raster& picture, uint64_t width, uint64_t height) {
  return fmt::format("{} x {} pixels of {} x {} bits", width, height, picture.stride,
                     8 * bytes_of(picture.sample));
}

}  // namespace

void PictureMemory::take(const fs::path& path, const std::string& what, uint64_t bytes) {
  const uint64_t left = most_ - std::min(taken_, most_);
  if (bytes > left)
    throw Error(fmt::format(
        "{}: {} take {:.3g} GiB, and --memory {:.3g} leaves {:.3g} GiB for it; give a smaller "
        "picture or a larger --memory",
        path.string(), what, double(bytes) / bytes_per_gib, double(most_) / bytes_per_gib,
        double(left) / bytes_per_gib));
  taken_ += bytes;
}

PictureMemory& PictureMemory::without_limit() {
  thread_local PictureMemory memory;
  return memory;
}

ColourCode ColourCode::srgb() {
  return {{srgb_decode, srgb_decode, srgb_decode}, rec709_chromaticities()};
}

ColourCode ColourCode::linear(const Imf::Chromaticities& primaries) {
  const auto same = [](float code) { return code; };
  return {{same, same, same}, primaries};
}

size_t bytes_of(Raster::Sample sample) {
  return sample == Raster::Sample::u8 ? 1 : sample == Raster::Sample::f32 ? 4 : 2;
}

void PictureFile::fail(const std::string& why) const {
  throw Error(fmt::format("{}: not a usable picture: this {} cannot be read: {}", path_.string(),
                          format_, why));
}

void PictureFile::warn(const std::string& text) const {
  log_warning("render", fmt::format("{}: {}", path_.string(), text));
}

void PictureFile::warn_of_alpha(uint64_t transparent) const {
  if (transparent > 0)
    warn(
        fmt::format("its alpha is not used; {} pixels are not opaque. Lay them over a ground in "
                    "the file, or leave the alpha out",
                    transparent));
}

void PictureFile::make_room(Raster& picture, uint64_t width, uint64_t height,
                            uint64_t beside) const {
  if (width == 0 || height == 0 || width > max_pixels || height > max_pixels ||
      width * height > max_pixels)
    fail(fmt::format("it has {} x {} pixels; there must be 1 to {}", width, height, max_pixels));
  const uint64_t own = width * height * uint64_t(picture.stride) * bytes_of(picture.sample);
  memory_.take(path_, described(picture, width, height), own + beside);
  memory_.give_back(beside);
  picture.width = int(width);
  picture.height = int(height);
  picture.bytes.resize(own);
}

void PictureFile::check_room(const std::string& what, uint64_t bytes) const {
  memory_.take(path_, what, bytes);
  memory_.give_back(bytes);
}

ColourCode PictureFile::code_of_profile(const unsigned char* profile, size_t size,
                                        Raster::Sample sample) const {
  const IccProfile icc(std::span(profile, size));
  const bool real = is_real(sample);
  if (icc.code() && !(real && is_curved(*icc.code()))) return *icc.code();
  if (!is_data())
    warn(
        fmt::format("its ICC profile '{}' is not applied, {}; its values are taken as {}sRGB. "
                    "Convert it to that in the program that made it",
                    icc.name(), icc.code() ? "its curves do not reach above 1" : icc.why_not(),
                    real ? "linear " : ""));
  return real ? ColourCode::linear(rec709_chromaticities()) : ColourCode::srgb();
}

std::optional<Imf::Chromaticities> PictureFile::other_primaries(const Imf::Chromaticities& found,
                                                                const char* where) const {
  const Imf::Chromaticities same = rec709_chromaticities();
  const auto near = [](const Imath::V2f& a, const Imath::V2f& b) {
    return a.equalWithAbsError(b, 0.002f);
  };
  if (near(found.red, same.red) && near(found.green, same.green) && near(found.blue, same.blue) &&
      near(found.white, same.white))
    return {};
  try {
    color_conversion(found, acescg_chromaticities());
    return found;
  } catch (const Error&) {
    warn(fmt::format("the chromaticities in {} span no colour space; those of sRGB are taken",
                     where));
    return {};
  }
}

Raster read_picture(const fs::path& path, PictureUse use, PictureMemory& memory) {
  std::error_code none;
  const uint64_t size = fs::file_size(path, none);
  if (!none) memory.take(path, "the bytes of the file", std::min(size, max_file_size));
  std::vector<std::byte> bytes = read_file(path, max_file_size);
  for (const Format& format : known_formats) {
    if (!holds(bytes, 0, format.magic)) continue;
    const PictureFile file(path, std::move(bytes), use, memory, format.name);
    try {
      Raster picture = format.read(file);
      check_finite(file, picture);
      memory.give_back(size);
      return picture;
    } catch (const std::bad_alloc&) {
      file.fail("there is not enough memory for it; give a smaller picture");
    }
  }
  fail_unread(path, bytes);
}

}  // namespace drench::render
