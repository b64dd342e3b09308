#pragma once
// Properties of one number that vertices of mesh files have, as files name them.

#include <string_view>
#include <vector>

#include "pipeline/contract/frames.h"

namespace drench {

struct MeshColumn {
  std::string_view name;
  std::vector<float> TriangleMesh::*values;
};

inline constexpr MeshColumn mesh_columns[] = {
    {"source", &TriangleMesh::source},         {"age", &TriangleMesh::age},
    {"wetness", &TriangleMesh::wetness},       {"strain_max", &TriangleMesh::strain_max},
    {"strain_min", &TriangleMesh::strain_min}, {"stress_max", &TriangleMesh::stress_max},
    {"stress_min", &TriangleMesh::stress_min}};

}  // namespace drench
