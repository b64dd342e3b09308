#pragma once
// The viewer's page: WebGL 2, nothing from elsewhere.

#include <string>

namespace drench {

std::string view_page();

}  // namespace drench
