#pragma once
// The rendered frames as an H.264 MP4, made by ffmpeg, which is optional.

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "pipeline/contract/files/files.h"
#include "pipeline/driver/contact_sheet.h"

namespace drench {

/// The first executable `ffmpeg` on PATH.
std::optional<std::filesystem::path> find_ffmpeg();

/// Sends the frames, through the view, to ffmpeg (started directly, no shell). Uses
/// libx264, else mpeg4; 4:2:0, so that an odd last row or column is cut off. Equal frames give
/// equal files.
/// @param images  EXR frames of one size, at least one.
/// @param keep_going  asked before every frame; false ends ffmpeg and throws Stopped.
/// @throws Error if a frame cannot be read, the sizes differ, or ffmpeg fails, with its last words.
WrittenFile write_movie(const std::filesystem::path& path, const std::vector<NumberedImage>& images,
                        double fps, const std::function<bool()>& keep_going,
                        const render::ViewTransform& view = {});

}  // namespace drench
