#pragma once
// Columns of vectors on the host.

#include <cstddef>
#include <vector>

namespace drench::sim {

/// Three floats a row; local frame.
struct HostVec {
  std::vector<float> x, y, z;
  size_t size() const { return x.size(); }
  void push(float a, float b, float c) { x.push_back(a), y.push_back(b), z.push_back(c); }
  void resize(size_t n) { x.resize(n), y.resize(n), z.resize(n); }
};

}  // namespace drench::sim
