#pragma once
// Meshes compared bit by bit: == calls 0 and -0 equal, and NaN different from itself.

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "pipeline/contract/files/mesh_columns.h"
#include "pipeline/contract/frames.h"

namespace drench::test {

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

inline void expect_same_bits(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_TRUE(same_bits(a.position, b.position));
  EXPECT_TRUE(same_bits(a.velocity, b.velocity));
  EXPECT_TRUE(same_bits(a.normal, b.normal));
  EXPECT_TRUE(same_bits(a.uv, b.uv));
  EXPECT_TRUE(same_bits(a.rest_position, b.rest_position));
  EXPECT_TRUE(same_bits(a.triangle, b.triangle));
  EXPECT_TRUE(same_bits(a.contact, b.contact));
  for (const auto& [name, values] : mesh_columns)
    EXPECT_TRUE(same_bits(a.*values, b.*values)) << name;
}

}  // namespace drench::test
