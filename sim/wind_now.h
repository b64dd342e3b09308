#pragma once
// The wind of one moment, as a step reads it. Host and device, both builds.

namespace drench::sim {

/// A uniform stream and plane waves across their own directions, so that nothing of it diverges:
/// u(x) = velocity + sum_k amplitude_k sin(wave_k . x + phase_k). Positions in the local frame.
struct WindNow {
  static constexpr int most_modes = 12;
  float velocity[3] = {0, 0, 0};  // m/s
  int modes = 0;
  float wave[most_modes][3] = {};       // rad/m
  float amplitude[most_modes][3] = {};  // m/s
  float phase[most_modes] = {};         // rad

  bool blows() const {
    return modes > 0 || velocity[0] != 0 || velocity[1] != 0 || velocity[2] != 0;
  }
};

}  // namespace drench::sim
