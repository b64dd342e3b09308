#include "pipeline/driver/json_lines.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/descriptor.h"
#include "pipeline/contract/files/files.h"
#include "pipeline/driver/file_lock.h"

namespace drench {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

/// What is not whole is cut off again: the next line must not be glued to half of this one.
/// @return errno, 0 once all is there
int append(int descriptor, const fs::path& file, std::string_view lines) {
  const FileLock lock(descriptor, file);
  struct stat before {};
  if (::fstat(descriptor, &before) != 0) return errno;
  const ssize_t done = ::write(descriptor, lines.data(), lines.size());
  if (done == ssize_t(lines.size())) return 0;
  const int reason = done < 0 ? errno : ENOSPC;
  (void)!::ftruncate(descriptor, before.st_size);
  return reason;
}

}  // namespace

void append_lines(const fs::path& path, std::string_view lines) {
  // O_NONBLOCK: opening a FIFO must not wait for a reader.
  Descriptor file(path, O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_NONBLOCK, 0666);
  int reason = file.is_open() ? 0 : errno;
  struct stat status {};
  if (reason == 0 && ::fstat(file.value(), &status) != 0) reason = errno;
  const bool pipe = reason == ENXIO;  // without a reader
  if (pipe || (reason == 0 && !S_ISREG(status.st_mode))) {
    throw Error(fmt::format("{}: is not a regular file; move it away", path.string()));
  }
  if (reason == 0) reason = append(file.value(), path, lines);
  if (reason == 0) reason = file.close();
  if (reason == 0) return;
  throw Error(fmt::format("{}: cannot be written: {}", path.string(), system_reason(reason)));
}

std::vector<json> read_json_lines(const fs::path& file) {
  std::vector<json> lines;
  std::error_code code;
  if (!fs::exists(file, code)) return lines;
  const std::string text = read_text(file, uint64_t(1) << 32);
  for (size_t begin = 0, end; (end = text.find('\n', begin)) != text.npos; begin = end + 1) {
    json line =
        json::parse(text.begin() + ptrdiff_t(begin), text.begin() + ptrdiff_t(end), nullptr, false);
    if (line.is_object()) lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace drench
