#pragma once
// Cases drawn by chance from seeds that can be run again.

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <string>

#include "tests/sim/support.h"
#include "tests/stress/report.h"

namespace drench::stress_tests {

class Chance {
 public:
  explicit Chance(int seed) : random_(uint64_t(seed)) {
    for (int k = 0; k < 4; ++k) random_();  // neighbouring seeds begin alike
  }
  double operator()() { return random_(); }
  int below(int n) { return int(random_() * n); }
  double between(double low, double high) { return low + (high - low) * random_(); }
  double log_between(double low, double high) { return low * std::pow(high / low, random_()); }
  template <class T, size_t N>
  const T& one_of(const T (&list)[N]) {
    return list[below(int(N))];
  }

 private:
  sim_tests::Random random_;
};

/// Seeds 0, 1, ...: `quick` or `many` of them, or the one that DRENCH_STRESS_SEED names.
class Seeds {
 public:
  Seeds(int quick, int many) : end_(long_form() ? many : quick) {
    if (const char* one = std::getenv("DRENCH_STRESS_SEED"))
      begin_ = std::atoi(one), end_ = begin_ + 1, only_ = true;
  }
  struct Iterator {
    int seed;
    int operator*() const { return seed; }
    Iterator& operator++() { return ++seed, *this; }
    bool operator!=(const Iterator& other) const { return seed != other.seed; }
  };
  Iterator begin() const { return {begin_}; }
  Iterator end() const { return {end_}; }
  /// A row is due after every 500 seeds and the last: what a long run has found when it is stopped.
  bool row_after(int seed) const { return (seed + 1) % 500 == 0 || seed + 1 == end_; }
  int count(int last) const { return last + 1 - begin_; }
  bool only() const { return only_; }
  std::string text(int last) const { return fmt::format("seeds {} to {}", begin_, last); }

 private:
  int begin_ = 0, end_;
  bool only_ = false;
};

}  // namespace drench::stress_tests
