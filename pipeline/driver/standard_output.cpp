#include "pipeline/driver/standard_output.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "pipeline/contract/error.h"

namespace drench {

void print(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw Error("standard output: cannot be written; is the disk full or the reader gone?");
  }
}

std::string json_line(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace drench
