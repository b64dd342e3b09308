#pragma once
// Pictures for a page: JPEG in memory, and bytes as text.

#include <string>
#include <vector>

#include "pipeline/driver/contact_sheet.h"

namespace drench {

/// @param quality  1 ... 100. @throws Error if the picture is larger than JPEG allows
std::vector<uint8_t> jpeg_bytes(const Picture& picture, int quality);

/// "data:image/jpeg;base64,..."
std::string data_url(std::string_view type, const std::vector<uint8_t>& bytes);

}  // namespace drench
