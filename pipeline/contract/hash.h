#pragma once
// XXH3-128: the identity of files and of everything a step depends on.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace drench {

struct Digest {
  uint64_t high = 0, low = 0;
  bool operator==(const Digest&) const = default;
  std::string hex() const;                        // 32 lower-case hex digits
  static Digest from_hex(std::string_view text);  // throws Error unless 32 hex digits
};

/// Streaming hash. Strings are added with their length, so that ("ab","c") differs from ("a","bc").
class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher& bytes(const void* data, size_t size);
  Hasher& text(std::string_view text);
  template <class T>
  requires std::is_arithmetic_v<T> Hasher& value(T value) { return bytes(&value, sizeof value); }
  Hasher& digest(const Digest& digest) { return value(digest.high).value(digest.low); }
  Digest finish() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

Digest hash_bytes(const void* data, size_t size);
/// @throws Error if the file cannot be read.
Digest hash_file(const std::filesystem::path& file);

}  // namespace drench
