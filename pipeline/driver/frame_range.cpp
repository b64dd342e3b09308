#include "pipeline/driver/frame_range.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <numeric>

#include "pipeline/contract/error.h"

namespace drench {

namespace {

constexpr int64_t max_frames = 1'000'000;

[[noreturn]] void reject(std::string_view item, std::string_view why) {
  throw Error(
      fmt::format("--frames: '{}' {}; write for example 1001-1048, 1001-1048x2 or "
                  "1001,1010-1020",
                  item, why));
}

/// Takes a signed integer off the front of `rest`.
int take_number(std::string_view& rest, std::string_view item) {
  int value = 0;
  const auto [end, code] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (code == std::errc::result_out_of_range) reject(item, "holds a number that is too large");
  if (code != std::errc()) reject(item, "is not a frame range");
  rest.remove_prefix(size_t(end - rest.data()));
  return value;
}

struct Span {
  int first, last, step;
};

Span parse_item(std::string_view item, const Timeline& timeline) {
  std::string_view rest = item;
  Span span{take_number(rest, item), 0, 1};
  span.last = span.first;
  const bool has_end = rest.starts_with('-');
  if (has_end) {
    rest.remove_prefix(1);
    span.last = take_number(rest, item);
  }
  if (rest.starts_with('x')) {
    rest.remove_prefix(1);
    span.step = take_number(rest, item);
    if (!has_end) span.last = timeline.last;
    if (span.step < 1) reject(item, "has a step below 1");
  }
  if (!rest.empty()) reject(item, "is not a frame range");
  if (span.last < span.first) {
    reject(item, fmt::format("runs backwards, from {} to {}", span.first, span.last));
  }
  if (span.first < timeline.first) {
    reject(item, fmt::format("starts before the shot's first frame, {}", timeline.first));
  }
  return span;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

}  // namespace

std::vector<int> parse_frames(std::string_view text, const Timeline& timeline) {
  std::vector<int> frames;
  for (bool more = true; more;) {
    const size_t comma = text.find(',');
    more = comma != std::string_view::npos;
    const std::string_view item = trimmed(text.substr(0, comma));
    if (more) text.remove_prefix(comma + 1);
    const Span span = parse_item(item, timeline);
    const int64_t count = (int64_t(span.last) - span.first) / span.step + 1;
    if (count + int64_t(frames.size()) > max_frames) {
      reject(item, fmt::format("makes more than {} frames", max_frames));
    }
    for (int64_t k = 0; k < count; ++k) frames.push_back(int(span.first + k * span.step));
  }
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  return frames;
}

std::vector<int> all_frames(const Timeline& timeline) {
  if (int64_t(timeline.last) - timeline.first >= max_frames) {
    throw Error(fmt::format("the shot has {} frames; at most {} are taken at once, give --frames",
                            int64_t(timeline.last) - timeline.first + 1, max_frames));
  }
  std::vector<int> frames(size_t(timeline.last - timeline.first + 1));
  std::iota(frames.begin(), frames.end(), timeline.first);
  return frames;
}

std::string format_frames(const std::vector<int>& sorted) {
  std::string text;
  for (size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
    const int step = begin + 1 < sorted.size() ? sorted[begin + 1] - sorted[begin] : 1;
    end = begin + 1;
    while (end < sorted.size() && sorted[end] - sorted[end - 1] == step) ++end;
    // Two frames far apart are a list, not a range with a step.
    if (step != 1 && end - begin < 3) end = begin + 1;
    if (!text.empty()) text += ", ";
    text += std::to_string(sorted[begin]);
    if (end - begin > 1) text += fmt::format("-{}", sorted[end - 1]);
    if (end - begin > 1 && step != 1) text += fmt::format("x{}", step);
  }
  return text;
}

}  // namespace drench
