#include "render/film/cryptomatte.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>

namespace drench::render {

uint32_t murmur3(std::string_view name) {
  constexpr uint32_t c1 = 0xcc9e2d51u, c2 = 0x1b873593u;
  const auto byte = [&](size_t k) { return uint32_t(uint8_t(name[k])); };
  const auto mixed = [](uint32_t k) { return std::rotl(k * c1, 15) * c2; };
  uint32_t h = 0;
  const size_t blocks = name.size() / 4, rest = name.size() % 4;
  for (size_t b = 0; b < blocks; ++b) {
    const uint32_t k =
        byte(4 * b) | byte(4 * b + 1) << 8 | byte(4 * b + 2) << 16 | byte(4 * b + 3) << 24;
    h = std::rotl(h ^ mixed(k), 13) * 5 + 0xe6546b64u;
  }
  uint32_t tail = 0;
  for (size_t k = rest; k-- > 0;) tail = tail << 8 | byte(4 * blocks + k);
  h ^= mixed(tail);
  h ^= uint32_t(name.size());
  h = (h ^ h >> 16) * 0x85ebca6bu;
  h = (h ^ h >> 13) * 0xc2b2ae35u;
  return h ^ h >> 16;
}

float cryptomatte_id(std::string_view name) {
  uint32_t bits = murmur3(name);
  // An exponent of all zeros or ones would be a denormal, infinity or NaN.
  const uint32_t exponent = bits >> 23 & 255;
  if (exponent == 0 || exponent == 255) bits ^= 1u << 23;
  return std::bit_cast<float>(bits);
}

std::vector<std::pair<std::string, std::string>> cryptomatte_header(
    const std::string& layer, const std::vector<std::string>& names) {
  nlohmann::json manifest = nlohmann::json::object();
  for (const std::string& name : names)
    manifest[name] = fmt::format("{:08x}", std::bit_cast<uint32_t>(cryptomatte_id(name)));
  const std::string key = "cryptomatte/" + fmt::format("{:08x}", murmur3(layer)).substr(0, 7) + "/";
  return {{key + "name", layer},
          {key + "hash", "MurmurHash3_32"},
          {key + "conversion", "uint32_to_float32"},
          {key + "manifest", manifest.dump()}};
}

void CryptomattePixel::add(int thing) {
  if (thing < 0) return;
  for (auto& [known, count] : counts_)
    if (known == thing) {
      ++count;
      return;
    }
  counts_.emplace_back(thing, 1);
}

void CryptomattePixel::archive(CheckpointArchive& file) {
  uint16_t things = uint16_t(counts_.size());
  file.value(things);
  counts_.resize(things);
  for (auto& [thing, count] : counts_) file.value(thing), file.value(count);
}

std::array<float, 2 * CryptomattePixel::ranks> CryptomattePixel::ranked(
    const std::vector<float>& ids, int samples) const {
  std::vector<std::pair<int, int>> sorted = counts_;
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first < b.first;
  });
  std::array<float, 2 * ranks> out{};
  for (size_t k = 0; k < std::min(sorted.size(), size_t(ranks)); ++k) {
    out[2 * k] = ids[size_t(sorted[k].first)];
    out[2 * k + 1] = float(sorted[k].second) / float(samples);
  }
  return out;
}

}  // namespace drench::render
