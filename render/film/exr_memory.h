#pragma once
// OpenEXR files as bytes in memory. The library swallows what goes wrong while it closes a file on
// the disk; here writing to the disk, checking and hashing are our own.

#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>

#include <string>

namespace drench::render {

/// The file of one picture: the header's data window, all of its lines.
/// @throws std::exception of the library; std::bad_alloc where the library would have swallowed it.
std::string exr_bytes(const Imf::Header& header, const Imf::FrameBuffer& pixels);

}  // namespace drench::render
