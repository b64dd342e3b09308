#pragma once
// One PNG that shows a whole shot: a grid of small frames with their numbers.

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "pipeline/contract/files/files.h"
#include "render/display/view_transform.h"

namespace drench {

struct NumberedImage {
  int frame = 0;
  std::filesystem::path file;  // EXR
};

/// 8-bit display-referred pixels, 3 x width x height, row-major from the top left.
struct Picture {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb;
};

/// Thumbnails of up to 64 frames, evenly picked, averaged in linear light and then taken through
/// the view; frame numbers in the corner.
/// @param images  at least one; frames of different sizes are an error.
/// @throws Error if a frame cannot be read.
Picture contact_sheet(const std::vector<NumberedImage>& images,
                      const render::ViewTransform& view = {});
WrittenFile write_contact_sheet(const std::filesystem::path& path,
                                const std::vector<NumberedImage>& images,
                                const render::ViewTransform& view = {});

/// Mean of the film's pixels under each pixel of a smaller one, in linear light.
render::Film shrink(const render::Film& film, int width, int height);

/// Writes digits and '-' of a built-in 5 x 7 font, white with a dark rim, `scale` pixels a dot,
/// with the top left corner of the first character at (x, y). What lies outside the picture is cut
/// off.
void draw_number(Picture& picture, int x, int y, int scale, std::string_view text);

}  // namespace drench
