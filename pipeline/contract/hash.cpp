#include "pipeline/contract/hash.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

#define XXH_INLINE_ALL
#include <fmt/format.h>
#include <xxhash.h>

#include "pipeline/contract/error.h"

namespace drench {

namespace {

uint64_t parse_hex(std::string_view digits, std::string_view whole) {
  uint64_t value = 0;
  for (char c : digits) {
    int digit = -1;
    if (c >= '0' && c <= '9') digit = c - '0';
    if (c >= 'a' && c <= 'f') digit = c - 'a' + 10;
    if (digit < 0) {
      throw Error(
          fmt::format("digest '{}' holds a character that is not a lower-case hex digit; "
                      "32 of them are expected",
                      whole));
    }
    value = value << 4 | uint64_t(digit);
  }
  return value;
}

}  // namespace

std::string Digest::hex() const { return fmt::format("{:016x}{:016x}", high, low); }

Digest Digest::from_hex(std::string_view text) {
  if (text.size() != 32) {
    throw Error(fmt::format("a digest has 32 hex digits, this text has {} characters: '{}'",
                            text.size(), text.substr(0, 64)));
  }
  return {parse_hex(text.substr(0, 16), text), parse_hex(text.substr(16), text)};
}

struct Hasher::State {
  alignas(64) XXH3_state_t hash;
};

Hasher::Hasher() : state_(std::make_unique<State>()) { XXH3_128bits_reset(&state_->hash); }
Hasher::~Hasher() = default;

Hasher& Hasher::bytes(const void* data, size_t size) {
  if (size > 0) XXH3_128bits_update(&state_->hash, data, size);
  return *this;
}

Hasher& Hasher::text(std::string_view text) {
  return value(uint64_t(text.size())).bytes(text.data(), text.size());
}

Digest Hasher::finish() const {
  const XXH128_hash_t hash = XXH3_128bits_digest(&state_->hash);
  return {hash.high64, hash.low64};
}

Digest hash_bytes(const void* data, size_t size) {
  const XXH128_hash_t hash = XXH3_128bits(data, size);
  return {hash.high64, hash.low64};
}

Digest hash_file(const std::filesystem::path& file) {
  // O_NONBLOCK: opening a FIFO must not wait for a writer.
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  struct stat status {};
  int reason = descriptor < 0 || ::fstat(descriptor, &status) != 0 ? errno : 0;
  const bool other = reason == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
  if (reason == 0 && !S_ISREG(status.st_mode)) reason = other ? EINVAL : EISDIR;
  Hasher hasher;
  std::vector<char> buffer(reason == 0 ? 1 << 20 : 0);
  while (reason == 0) {
    const ssize_t got = ::read(descriptor, buffer.data(), buffer.size());
    if (got == 0) break;
    if (got < 0 && errno != EINTR) reason = errno;
    if (got > 0) hasher.bytes(buffer.data(), size_t(got));
  }
  if (descriptor >= 0) ::close(descriptor);
  if (reason != 0) {
    throw Error(fmt::format("{}: cannot be read for its digest: {}", file.string(),
                            other ? "it is not a regular file" : std::strerror(reason)));
  }
  return hasher.finish();
}

}  // namespace drench
