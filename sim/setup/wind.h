#pragma once
// The wind of a shot over time.

#include "pipeline/contract/shot/shot.h"
#include "sim/wind_now.h"

namespace drench::sim {

struct LocalFrame;

/// Gusts are a sum of random plane waves (Kraichnan 1970) that the mean wind carries along
/// (Taylor's frozen turbulence 1938) and that turn over by themselves at the rate of their own
/// speed. The same shot has the same gusts: they are a function of place, time and shot.seed alone.
class Wind {
 public:
  Wind() = default;
  Wind(const Shot& shot, const LocalFrame& frame);
  /// @param time  s since the first frame.
  WindNow at(double time) const;

 private:
  struct Mode {
    V3d wave, amplitude;  // rad/m, m/s
    double phase = 0;     // rad, at the world's origin and time 0
  };
  V3d carried(double time) const;

  Animated<V3d> velocity_{V3d(0)};
  Timeline timeline_;
  V3d origin_{0};
  std::vector<Mode> mode_;
};

}  // namespace drench::sim
