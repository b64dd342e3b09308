#include "pipeline/driver/stats_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "pipeline/driver/standard_output.h"

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
  const std::string line = json_line(object);
  const std::scoped_lock lock(mutex_);
  // O_NONBLOCK: opening a FIFO must not wait for a reader.
  const int flags = O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  const int descriptor = ::open(file_.c_str(), flags, 0666);
  struct stat before {};
  int reason = descriptor < 0 || ::fstat(descriptor, &before) != 0 ? errno : 0;
  const bool pipe = reason == ENXIO;  // without a reader
  const bool regular = !pipe && (reason != 0 || S_ISREG(before.st_mode));
  if (reason == 0 && regular) {
    const ssize_t done = ::write(descriptor, line.data(), line.size());
    if (done != ssize_t(line.size())) {
      reason = done < 0 ? errno : ENOSPC;
      // The next line must not be glued to half of this one.
      (void)!::ftruncate(descriptor, before.st_size);
    }
  }
  if (descriptor >= 0 && ::close(descriptor) != 0 && reason == 0) reason = errno;
  if (!regular) {
    throw Error(fmt::format("{}: is not a regular file; move it away", file_.string()));
  }
  if (reason != 0) {
    throw Error(fmt::format("{}: cannot be written: {}", file_.string(), system_reason(reason)));
  }
}

}  // namespace drench
