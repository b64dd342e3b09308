#include "pipeline/contract/files/mesh_text.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"

namespace drench {

std::string plain_text(const std::filesystem::path& path, std::string text) {
  if (text.starts_with("\xef\xbb\xbf")) return text.substr(3);
  const bool little = text.starts_with("\xff\xfe"), big = text.starts_with("\xfe\xff");
  if (!little && !big) return text;
  if (text.size() % 2 != 0) {
    throw Error(
        fmt::format("{}: is UTF-16 and ends within a character: cut off or damaged. Export "
                    "the mesh again",
                    path.string()));
  }
  std::string plain;
  plain.reserve(text.size() / 2);
  for (size_t k = 2; k < text.size(); k += 2) {
    const auto low = static_cast<unsigned char>(text[k + (big ? 1 : 0)]),
               high = static_cast<unsigned char>(text[k + (big ? 0 : 1)]);
    plain.push_back(high == 0 && low < 128 ? char(low) : '?');
  }
  return plain;
}

template <class T>
std::optional<T> NumberReader::read(std::string_view word) {
  std::array<char, 64> with_point;
  if (word.starts_with('+')) word.remove_prefix(1);
  if (const size_t comma = word.find(','); comma != std::string_view::npos) {
    if (points_ || word.size() > with_point.size()) return {};
    word.copy(with_point.data(), word.size());
    with_point[comma] = '.';
    word = {with_point.data(), word.size()};
    ++commas_;
  } else if (word.find('.') != std::string_view::npos) {
    if (commas_ > 0) return {};
    points_ = true;
  }
  T value = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc() || end != word.data() + word.size()) return {};
  return value;
}

std::optional<double> NumberReader::real(std::string_view word) { return read<double>(word); }

std::optional<float> NumberReader::single(std::string_view word) {
  if (const std::optional<float> value = read<float>(word)) return value;
  // What floats call out of range because it is next to nothing.
  if (const std::optional<double> wide = read<double>(word)) return float(*wide);
  return {};
}

void NumberReader::warn(const std::filesystem::path& path) const {
  if (commas_ == 0) return;
  log_file_warning("mesh", path,
                   fmt::format("{} numbers have a decimal comma, which was taken for a point; "
                               "export with points",
                               commas_));
}

}  // namespace drench
