#pragma once

namespace drench::sim {

/// Vertices that follow each other.
struct VertexRange {
  int first, count;
  constexpr bool contains(int v) const { return v >= first && v < first + count; }
};

}  // namespace drench::sim
