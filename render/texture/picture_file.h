#pragma once
// For the readers of the formats: the file that is read, its messages, and the memory it may take.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/texture/picture.h"

namespace drench::render {

class PictureFile {
 public:
  /// @param format  "PNG"
  PictureFile(const std::filesystem::path& path, std::vector<std::byte> bytes, PictureUse use,
              PictureMemory& memory, const char* format)
      : path_(path), bytes_(std::move(bytes)), use_(use), memory_(memory), format_(format) {}

  const std::filesystem::path& path() const { return path_; }
  const std::vector<std::byte>& bytes() const { return bytes_; }
  bool is_data() const { return use_ == PictureUse::data; }
  bool is_sky() const { return use_ == PictureUse::sky; }

  [[noreturn]] void fail(const std::string& why) const;
  void warn(const std::string& text) const;
  void warn_of_alpha(uint64_t transparent) const;  // pixels that are not opaque; none: no word

  /// Sets the size and makes room for the samples, all 0.
  /// @param beside  bytes that reading takes besides, for a while
  void make_room(Raster& picture, uint64_t width, uint64_t height, uint64_t beside = 0) const;

  /// @throws Error if there is no room for what is taken for a while. @param what  "its tile"
  void check_room(const std::string& what, uint64_t bytes) const;

  /// What an ICC profile says of samples; one that cannot be used, as are curves of floats, is a
  /// warning, and the code is that of samples without a profile.
  ColourCode code_of_profile(const unsigned char* profile, size_t size,
                             Raster::Sample sample) const;

  /// Primaries that a file names besides; none if they are those of sRGB within rounding or, with a
  /// warning, span no colour space.
  /// @param where  "its cHRM chunk"
  std::optional<Imf::Chromaticities> other_primaries(const Imf::Chromaticities& found,
                                                     const char* where) const;

 private:
  std::filesystem::path path_;
  std::vector<std::byte> bytes_;
  PictureUse use_;
  PictureMemory& memory_;
  const char* format_;
};

/// Each leaves `bytes` filled and every other member set. @throws Error as read_picture.
Raster read_png(const PictureFile& file);
Raster read_jpeg(const PictureFile& file);
Raster read_tiff(const PictureFile& file);
Raster read_hdr(const PictureFile& file);
Raster read_exr_picture(const PictureFile& file);

/// Where pixels stand that are stored in one of TIFF's eight orientations (TIFF 6.0, tag 274).
class Orientation {
 public:
  /// @param code  1 to 8  @param columns, rows  as stored
  Orientation(int code, int columns, int rows) : code_(code), columns_(columns), rows_(rows) {}

  bool is_turned() const { return code_ >= 5; }  // stored rows are the picture's columns
  int width() const { return is_turned() ? rows_ : columns_; }
  int height() const { return is_turned() ? columns_ : rows_; }
  /// The picture's pixel, row-major from its top left.
  size_t pixel(int column, int row) const {
    if (code_ == 2 || code_ == 3 || code_ == 7 || code_ == 8) column = columns_ - 1 - column;
    if (code_ == 3 || code_ == 4 || code_ == 6 || code_ == 7) row = rows_ - 1 - row;
    return is_turned() ? size_t(column) * size_t(rows_) + size_t(row)
                       : size_t(row) * size_t(columns_) + size_t(column);
  }

 private:
  int code_, columns_, rows_;
};

}  // namespace drench::render
