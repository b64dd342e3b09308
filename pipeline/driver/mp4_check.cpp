#include "pipeline/driver/mp4_check.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <string_view>
#include <vector>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"

namespace drench {

namespace {

constexpr uint64_t largest_index = uint64_t(1) << 30;  // bytes; 12 a picture

/// A file that parts are read of.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& file)
      : file_(file), descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
    struct stat status {};
    if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0) fail(errno);
    size_ = uint64_t(status.st_size);
  }
  ~Reader() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  uint64_t size() const { return size_; }
  /// As many of these bytes as there are.
  std::string bytes(uint64_t from, uint64_t count) const {
    std::string bytes(from < size_ ? std::min(count, size_ - from) : 0, '\0');
    for (size_t done = 0; done < bytes.size();) {
      const ssize_t got =
          ::pread(descriptor_, bytes.data() + done, bytes.size() - done, off_t(from + done));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) fail(got < 0 ? errno : EIO);
      done += size_t(got);
    }
    return bytes;
  }

 private:
  [[noreturn]] void fail(int reason) const {
    throw Error(fmt::format("{}: cannot be read: {}", file_.string(), system_reason(reason)));
  }

  const std::filesystem::path file_;
  const int descriptor_;
  uint64_t size_ = 0;
};

uint64_t big_endian(std::string_view bytes, size_t at, size_t count) {
  uint64_t value = 0;
  for (size_t k = 0; k < count; ++k) value = value << 8 | uint8_t(bytes[at + k]);
  return value;
}

struct Box {
  std::string type;
  uint64_t begin = 0, body = 0, end = 0;  // offsets
};

/// Size and type; nothing if the bytes do not hold one that ends at `limit` at the latest.
std::optional<Box> box_of(std::string_view head, uint64_t at, uint64_t limit) {
  if (head.size() < 8) return {};
  Box box{std::string(head.substr(4, 4)), at, at + 8, 0};
  uint64_t size = big_endian(head, 0, 4);
  if (size == 1) {  // the true size follows
    if (head.size() < 16) return {};
    size = big_endian(head, 8, 8);
    box.body += 8;
  }
  if (size < box.body - at || size > limit - at) return {};
  box.end = at + size;
  return box;
}

/// The first box of that type within a box's bytes, as bytes of its own; empty without one.
std::string_view inside(std::string_view bytes, std::string_view type) {
  for (uint64_t at = 0; at < bytes.size();) {
    const std::optional<Box> box = box_of(bytes.substr(at, 16), at, bytes.size());
    if (!box) return {};
    if (box->type == type) return bytes.substr(box->body, box->end - box->body);
    at = box->end;
  }
  return {};
}

/// Number of pictures and their bytes, of the index's table of sizes (stsz).
struct Pictures {
  uint64_t count = 0, bytes = 0;
};

std::optional<Pictures> pictures_of(std::string_view index) {
  std::string_view table = index;
  for (const char* type : {"trak", "mdia", "minf", "stbl", "stsz"}) table = inside(table, type);
  if (table.size() < 12) return {};
  Pictures pictures{big_endian(table, 8, 4), 0};
  const uint64_t one_size = big_endian(table, 4, 4);
  if (one_size == 0 && (table.size() - 12) / 4 < pictures.count) return {};
  pictures.bytes = one_size * pictures.count;
  for (uint64_t k = 0; one_size == 0 && k < pictures.count; ++k)
    pictures.bytes += big_endian(table, 12 + 4 * k, 4);
  return pictures;
}

}  // namespace

std::string why_not_whole_mp4(const std::filesystem::path& file, size_t frames) {
  const Reader reader(file);
  std::optional<Pictures> pictures;
  uint64_t data = 0;
  for (uint64_t at = 0; at < reader.size();) {
    const std::optional<Box> box = box_of(reader.bytes(at, 16), at, reader.size());
    if (!box) return fmt::format("it was cut off in the part at byte {}", at);
    if (box->type == "mdat") data += box->end - box->body;
    if (box->type == "moov" && box->end - box->body <= largest_index)
      pictures = pictures_of(reader.bytes(box->body, box->end - box->body));
    at = box->end;
  }
  if (!pictures) return "it has no index";
  if (pictures->count != frames)
    return fmt::format("it holds {} of {} pictures", pictures->count, frames);
  if (pictures->bytes == 0 || pictures->bytes > data)
    return fmt::format("its pictures have {} bytes and its data {}", pictures->bytes, data);
  return {};
}

}  // namespace drench
