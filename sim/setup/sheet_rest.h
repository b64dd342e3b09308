#pragma once
// Sheets that lie still sleep: they are not solved for until something comes near.

#include <vector>

#include "pipeline/contract/shot/shot.h"
#include "sim/setup/obstacles.h"

namespace drench::sim {

struct Scene;

/// What of it a checkpoint holds; by sheets but for `mark`.
struct SheetRestState {
  double since = 0;            // s since the first frame: when the window that runs now began
  HostVec mark;                // m, vertices at that time
  std::vector<double> square;  // m^2, mean over the vertices of how far they came in the window
                               // before, squared
  std::vector<int> still;      // windows that follow each other, in which it came that little
  std::vector<char> busy;      // whether anything touched it in the window that runs now
  std::vector<char> asleep;
  std::vector<float> pull;  // PinsNow's of the step before; empty: there was none
};

/// A sheet sleeps once it has come less far than its sleeping speed allows in four windows of half
/// a second, in the last no farther than in the one before: what grows from little, as buckling
/// does, is no rest. With it sleeps all that is near it, or nothing does. Nothing sleeps without
/// gravity: what drifts there has no end. Near are sheets whose bounding boxes come within the sum
/// of their thicknesses, or that a seam joins. What wakes it is fluid,
/// an obstacle or a pin that moves, a pin that lets go, or another sheet that is awake.
class SheetRest {
 public:
  SheetRest() = default;
  SheetRest(const Shot& shot, const Scene& scene);

  /// Whether any sheet may ever sleep: if not, nothing else is to be called.
  bool any() const { return !sheet_.empty(); }
  /// Takes up a state; an empty one is of the shot's start.
  void start(Solver& solver, const SheetRestState& state, double time);
  const SheetRestState& state() const { return state_; }
  int asleep() const;

  /// What moves in a step that is to be made.
  struct Motion {
    bool everywhere;                         // wind blows, or seams are drawn
    const std::vector<PlacedBox>& obstacle;  // bounds of those that move
    const PinsNow& pins;
  };
  /// Wakes what that touches.
  void before_step(Solver& solver, const Motion& motion);
  /// Wakes what fluid and other sheets have come near to; at the end of a window sends to sleep.
  void after_step(Solver& solver, double time);

 private:
  struct Box {
    float low[3], high[3];  // m, local
  };
  struct Sheet {
    VertexRange vertices;
    double speed;     // m/s; 0: it never sleeps
    float thickness;  // m
  };
  /// By sheets.
  using Flags = std::vector<char>;

  /// How far a sheet came in the window before and in the one that ends: means over its vertices,
  /// squared, m^2. Still: as little as it may for long enough.
  struct Windows {
    double before = 0, now = 0;
    bool still = true;
  };

  void look(const HostVec& place);
  std::vector<Windows> measure(const HostVec& place, double elapsed);
  bool near(size_t a, size_t b) const;
  bool meets(const PlacedBox& box, size_t sheet) const;
  /// Wakes what is near to what is awake, and tells the solver if anything changed.
  void wake(Solver& solver, const Flags& touched);
  void send_to_sleep(Solver& solver, const std::vector<Windows>& windows);
  /// Of every sheet the first of those that it hangs together with.
  std::vector<size_t> heaps() const;

  std::vector<Sheet> sheet_;
  std::vector<char> joined_;  // of two sheets, by rows
  std::vector<int> pin_sheet_;
  std::vector<Box> box_;  // of each sheet, as it was seen last
  SheetRestState state_;
};

}  // namespace drench::sim
