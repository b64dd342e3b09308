#pragma once
// Seams that sew sheets together, over time.

#include <vector>

#include "pipeline/contract/shot/shot.h"

namespace drench::sim {

struct Scene;

/// A seam is a spring between each pair of vertices. Its rest length goes evenly from what it is at
/// the start of the simulation to the one it ends with.
class Sewing {
 public:
  Sewing() = default;
  /// Fills ClothTopology::seam. @param scene  with its sheets.
  /// @throws Error if a vertex of a seam is not there.
  Sewing(const Shot& shot, Scene& scene);
  /// Whether any seam is still drawn at a time, s since the first frame.
  bool draws(double time) const { return time < end_; }
  /// Rest lengths at a time, m.
  std::vector<float> lengths(double time) const;

 private:
  struct Drawn {
    double start, rest, time;  // m, s
  };
  std::vector<Drawn> spring_;
  double begin_ = 0, end_ = -1e30;  // s
};

}  // namespace drench::sim
