#include "pipeline/contract/geometry/subdivision.h"

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

namespace drench {

namespace {

using Imath::V2f;
using Imath::V3f;
namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

constexpr size_t most_triangles = size_t(1) << 18;
constexpr int most_levels = 2;

/// A place on the limit surface, as OpenSubdiv sums it.
struct Place {
  V3f at{0};
  void Clear() { at = V3f(0); }
  void AddWithWeight(const Place& other, float weight) { at += other.at * weight; }
};

/// What is linear between corners; columns that a mesh has not stay 0.
struct Linear {
  V3f position{0}, velocity{0};
  V2f uv{0};
  float wetness = 0;

  void Clear() { *this = {}; }
  void AddWithWeight(const Linear& other, float weight) {
    position += other.position * weight, velocity += other.velocity * weight;
    uv += other.uv * weight, wetness += other.wetness * weight;
  }
};

uint32_t point_of(const TriangleMesh& mesh, uint32_t vertex) {
  return mesh.point.empty() ? vertex : mesh.point[vertex];
}

std::vector<Linear> linear_of(const TriangleMesh& mesh) {
  std::vector<Linear> values(mesh.position.size());
  for (size_t v = 0; v < values.size(); ++v) {
    const auto take = [&](auto& to, const auto& from) {
      if (!from.empty()) to = from[v];
    };
    take(values[v].position, mesh.position), take(values[v].velocity, mesh.velocity);
    take(values[v].uv, mesh.uv), take(values[v].wetness, mesh.wetness);
  }
  return values;
}

/// Topology of the points, with the vertices as face-varying values of them.
std::unique_ptr<Far::TopologyRefiner> refiner_of(const TriangleMesh& mesh) {
  std::vector<int> point, vertex, triangles_at(mesh.position.size(), 0), corner;
  for (const auto& t : mesh.triangle)
    for (const uint32_t v : {t.x, t.y, t.z}) {
      vertex.push_back(int(v));
      point.push_back(int(point_of(mesh, v)));
      ++triangles_at[size_t(point.back())];
    }
  // A corner of a grid has one triangle or two, and is to be one in either case.
  for (size_t v = 0; v < triangles_at.size(); ++v)
    if (triangles_at[v] == 2) corner.push_back(int(v));
  const std::vector<int> corners_of(mesh.triangle.size(), 3);
  const std::vector<float> sharp(corner.size(), Sdc::Crease::SHARPNESS_INFINITE);

  Far::TopologyDescriptor::FVarChannel channel;
  channel.numValues = int(mesh.position.size());
  channel.valueIndices = vertex.data();
  Far::TopologyDescriptor topology;
  topology.numVertices = int(mesh.position.size());
  topology.numFaces = int(mesh.triangle.size());
  topology.numVertsPerFace = corners_of.data();
  topology.vertIndicesPerFace = point.data();
  topology.numCorners = int(corner.size());
  topology.cornerVertexIndices = corner.data();
  topology.cornerWeights = sharp.data();
  topology.numFVarChannels = 1;
  topology.fvarChannels = &channel;

  Sdc::Options rules;
  rules.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
  rules.SetFVarLinearInterpolation(Sdc::Options::FVAR_LINEAR_ALL);
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  return std::unique_ptr<Far::TopologyRefiner>(
      Factory::Create(topology, Factory::Options(Sdc::SCHEME_LOOP, rules)));
}

/// Values of the last level from those of the first.
template <class Value, class Count, class Interpolate>
std::vector<Value> refined(std::vector<Value> values, int levels, const Count& count,
                           const Interpolate& interpolate) {
  for (int level = 1; level <= levels; ++level) {
    std::vector<Value> finer(size_t(count(level)));
    interpolate(level, values, finer);
    values = std::move(finer);
  }
  return values;
}

/// The way from the flat place towards the smooth one, of which the length stays below `limit`.
V3f within(const V3f& flat, const V3f& smooth, float limit) {
  const V3f way = smooth - flat;
  return flat + way * (limit / std::sqrt(limit * limit + way.length2()));
}

void append(const TriangleMesh& mesh, const Linear& value, TriangleMesh& out) {
  if (!mesh.velocity.empty()) out.velocity.push_back(value.velocity);
  if (!mesh.uv.empty()) out.uv.push_back(value.uv);
  if (!mesh.wetness.empty()) out.wetness.push_back(value.wetness);
}

}  // namespace

TriangleMesh subdivided(const TriangleMesh& mesh, int levels, float limit) {
  if (levels == 0 || mesh.triangle.empty()) return mesh;
  const std::unique_ptr<Far::TopologyRefiner> refiner = refiner_of(mesh);
  if (!refiner) throw std::runtime_error("OpenSubdiv takes no sheet of this topology");
  Far::TopologyRefiner::UniformOptions uniform(levels);
  uniform.fullTopologyInLastLevel = true;  // the limit asks for it
  refiner->RefineUniform(uniform);
  const Far::PrimvarRefiner primvars(*refiner);
  const Far::TopologyLevel& last = refiner->GetLevel(levels);

  std::vector<Place> control(mesh.position.size());
  for (size_t v = 0; v < control.size(); ++v) control[v].at = mesh.position[v];
  const std::vector<Place> places = refined(
      std::move(control), levels,
      [&](int level) { return refiner->GetLevel(level).GetNumVertices(); },
      [&](int level, const auto& from, auto& to) { primvars.Interpolate(level, from, to); });
  std::vector<Place> smooth(places.size());
  primvars.Limit(places, smooth);
  const std::vector<Linear> linear = refined(
      linear_of(mesh), levels,
      [&](int level) { return refiner->GetLevel(level).GetNumFVarValues(); },
      [&](int level, const auto& from, auto& to) {
        primvars.InterpolateFaceVarying(level, from, to);
      });

  TriangleMesh out;
  constexpr uint32_t unseen = ~0u;
  std::vector<uint32_t> vertex(linear.size(), unseen), first_at(places.size(), unseen);
  for (int face = 0; face < last.GetNumFaces(); ++face) {
    const auto at = last.GetFaceVertices(face), value = last.GetFaceFVarValues(face);
    Imath::Vec3<uint32_t> triangle;
    for (int k = 0; k < 3; ++k) {
      uint32_t& v = vertex[size_t(value[k])];
      if (v == unseen) {
        v = uint32_t(out.position.size());
        uint32_t& first = first_at[size_t(at[k])];
        if (first == unseen) first = v;
        const Linear& flat = linear[size_t(value[k])];
        out.position.push_back(first < v ? out.position[first]
                                         : within(flat.position, smooth[size_t(at[k])].at, limit));
        if (!mesh.point.empty()) out.point.push_back(first);
        append(mesh, flat, out);
      }
      triangle[k] = v;
    }
    out.triangle.push_back(triangle);
  }
  return out;
}

int automatic_levels(size_t triangles) {
  int levels = most_levels;
  while (levels > 0 && triangles << (2 * levels) > most_triangles) --levels;
  return levels;
}

}  // namespace drench
