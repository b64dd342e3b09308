#pragma once
// What the checks of a shot's parts share. Only for the files that hold checks.

#include <fmt/format.h>

#include <string>
#include <string_view>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/shot_check.h"

namespace drench {

inline std::string text_of(const V3d& v) { return fmt::format("[{}, {}, {}]", v.x, v.y, v.z); }

class CheckBase {
 public:
  CheckBase(const Shot& shot, const ShotSources& sources) : shot_(shot), sources_(sources) {}

 protected:
  [[noreturn]] void fail(const std::string& key, const std::string& text) const {
    throw Error(fmt::format("{}: {}", sources_.at(key), text));
  }

  void check_not_zero(const std::string& key, const V3d& v) const {
    if (!(v.length() > 1e-9)) {
      fail(key, fmt::format("{} is {}, which has no direction; give it a length other than 0", key,
                            text_of(v)));
    }
  }

  void check_positive(const std::string& key, double value, std::string_view unit,
                      std::string_view why) const {
    if (!(value > 0)) {
      fail(key, fmt::format("{} is {}{}; {}. Use a value above 0", key, value, unit, why));
    }
  }

  const Shot& shot_;
  const ShotSources& sources_;
};

}  // namespace drench
