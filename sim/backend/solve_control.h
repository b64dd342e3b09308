#pragma once
// When an iterative solve ends. Its control lies where the data are, and launches decide there.

#include "sim/backend/column.h"

namespace drench::sim::DRENCH_BACKEND {

/// Has a solve of at most `most` iterations ended before its iteration 0, 1, ...? Asking makes the
/// host wait for a GPU: it asks before every eighth iteration only, and launches of a solve that is
/// done do nothing.
template <class Control>
bool ended(const Column<Control>& control, int iteration, int most) {
  if (iteration >= most) return true;
#if defined(__CUDACC__)
  constexpr int patience = 8;
  if (iteration == 0 || iteration % patience != 0) return false;
#endif
  return value_at(control, 0).done != 0;
}

}  // namespace drench::sim::DRENCH_BACKEND
