#include "pipeline/driver/stats_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files.h"

namespace drench {

void StatsFile::add(std::string_view step, int frame, double wall_s, const std::string& json) {
  nlohmann::json object = nlohmann::json::parse(json);
  object["frame"] = frame;
  object["wall_s"] = wall_s;
  add(step, object.dump());
}

void StatsFile::add(std::string_view step, const std::string& json) {
  nlohmann::json object = nlohmann::json::parse(json);
  object["step"] = step;
  const std::string line = object.dump() + "\n";
  const std::scoped_lock lock(mutex_);
  const int descriptor =
      ::open(file_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0666);
  const ssize_t done = descriptor < 0 ? -1 : ::write(descriptor, line.data(), line.size());
  const int reason = done < 0 ? errno : ENOSPC;
  if (descriptor >= 0) ::close(descriptor);
  if (done == ssize_t(line.size())) return;
  throw Error(fmt::format("{}: cannot be written: {}", file_.string(), system_reason(reason)));
}

}  // namespace drench
