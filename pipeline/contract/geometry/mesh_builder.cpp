#include "pipeline/contract/geometry/mesh_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/mesh_columns.h"
#include "pipeline/contract/geometry/polygon.h"
#include "pipeline/contract/log.h"

namespace drench {

namespace {

bool finite(float v) { return std::isfinite(v); }
bool finite(const Imath::V2f& v) { return std::isfinite(v.x) && std::isfinite(v.y); }
bool finite(const Imath::V3f& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Sets what is not finite to 0 and counts it.
template <class T>
void mend(std::vector<T>& column, uint64_t& bad) {
  for (T& value : column) {
    if (finite(value)) continue;
    value = T(0);
    ++bad;
  }
}

/// Appends to a vertex column what it holds for vertex v.
template <class T>
void repeat(std::vector<T>& column, size_t vertices, uint32_t v) {
  if (column.size() == vertices) column.push_back(column[v]);
}

}  // namespace

void MeshBuilder::fail(const std::string& why) const {
  throw Error(fmt::format("{}: {}. Export the mesh again", path_.string(), why));
}

void MeshBuilder::set_triangle(size_t k, const Corner& a, const Corner& b, const Corner& c) {
  mesh.triangle[k] = {a.vertex, b.vertex, c.vertex};
  if (wanted_ == CornerData::none) return;
  for (size_t i = 0; const Corner* corner : {&a, &b, &c}) {
    corner_[3 * k + i++] = *corner;
    by_corner_ |= corner->uv != none || corner->normal != none;
  }
}

void MeshBuilder::add_face(std::span<const Corner> corner, uint64_t number) {
  const size_t n = corner.size();
  if (n < 3) {
    if (short_faces_++ == 0) first_short_face_ = number;
    return;
  }
  const size_t first = mesh.triangle.size();
  mesh.triangle.resize(first + n - 2);
  if (wanted_ != CornerData::none) corner_.resize(3 * (first + n - 2));
  if (n == 3) return set_triangle(first, corner[0], corner[1], corner[2]);
  polygon_.push_back({first, polygon_corner_.size(), n, number});
  polygon_corner_.insert(polygon_corner_.end(), corner.begin(), corner.end());
}

void MeshBuilder::cut(const Polygon& polygon) {
  const std::span corner(polygon_corner_.data() + polygon.corner, polygon.corners);
  const std::span<const Imath::V3f> at = cut_by_.empty() ? mesh.position : cut_by_;
  std::vector<Imath::V3f> position;
  for (const Corner& c : corner) {
    if (c.vertex >= mesh.position.size()) refuse_vertex(polygon.triangle, c.vertex);
    if (c.vertex >= at.size()) fail("has faces of vertices that the first frame does not have");
    position.push_back(at[c.vertex]);
    if (!finite(position.back())) fail(fmt::format("has a vertex {} that is not finite", c.vertex));
  }
  const auto triangles = triangulate(position);
  if (!triangles) {
    const size_t n = corner.size();
    throw Error(fmt::format(
        "{}: a face of {} corners {}; its first corner is ({:.6g}, {:.6g}, {:.6g}). Cut it into "
        "triangles where it is modelled",
        location_of_(polygon.number), n,
        n > most_corners ? fmt::format("is not convex and has more than {}", most_corners)
                         : "crosses itself",
        position[0].x, position[0].y, position[0].z));
  }
  for (size_t k = 0; k < triangles->size(); ++k) {
    const auto& t = (*triangles)[k];
    set_triangle(polygon.triangle + k, corner[t[0]], corner[t[1]], corner[t[2]]);
  }
}

void MeshBuilder::refuse_vertex(size_t triangle, uint32_t index) const {
  fail(
      fmt::format("has a face without its vertex: triangle {} has index {} but only {} vertices "
                  "are there",
                  triangle, index, mesh.position.size()));
}

void MeshBuilder::check_vertices() const {
  for (size_t k = 0; k < mesh.triangle.size(); ++k) {
    const auto& t = mesh.triangle[k];
    const uint32_t largest = std::max({t.x, t.y, t.z});
    if (largest >= mesh.position.size()) refuse_vertex(k, largest);
    for (const uint32_t v : {t.x, t.y, t.z}) {
      if (!finite(mesh.position[v])) fail(fmt::format("has a vertex {} that is not finite", v));
    }
  }
}

void MeshBuilder::mend_columns() {
  mend(mesh.uv, bad_uv_), mend(uv, bad_uv_);
  for (auto* column : {&mesh.velocity, &mesh.rest_position}) mend(*column, bad_values_);
  for (const MeshColumn& column : mesh_columns) mend(mesh.*column.values, bad_values_);
  mend(mesh.normal, bad_normals_), mend(normal, bad_normals_);
  if (wanted_ != CornerData::uv_and_normal) return;
  for (auto* column : {&mesh.normal, &normal}) {
    for (Imath::V3f& n : *column) {
      const float length = n.length();
      const bool is_unit = std::abs(length - 1) < 1e-3f;  // but for rounding
      if (!is_unit) n = length > 1e-6f ? n / length : Imath::V3f(0);
    }
  }
}

/// Normals of the faces around, weighted by area, where a file gives none.
void MeshBuilder::fill_normals() {
  const auto is_missing = [](const Imath::V3f& n) { return n == Imath::V3f(0); };
  if (wanted_ != CornerData::uv_and_normal ||
      std::none_of(mesh.normal.begin(), mesh.normal.end(), is_missing))
    return;
  const auto point_of = [&](uint32_t v) { return mesh.point.empty() ? v : mesh.point[v]; };
  std::vector<Imath::V3f> sum(mesh.position.size(), Imath::V3f(0));
  for (const auto& t : mesh.triangle) {
    const Imath::V3f& a = mesh.position[t.x];
    const Imath::V3f n = (mesh.position[t.y] - a).cross(mesh.position[t.z] - a);
    for (const uint32_t v : {t.x, t.y, t.z}) sum[point_of(v)] += n;
  }
  for (uint32_t v = 0; v < sum.size(); ++v) {
    if (!is_missing(mesh.normal[v])) continue;
    const Imath::V3f& n = sum[point_of(v)];
    mesh.normal[v] = n.length() > 0 ? n.normalized() : Imath::V3f(0, 1, 0);
  }
}

/// Of texture coordinates and normals that are not there.
void MeshBuilder::drop_lost_indices() {
  for (Corner& c : corner_) {
    const bool uv_lost = c.uv != none && c.uv >= uv.size(),
               normal_lost = wanted_ == CornerData::uv_and_normal && c.normal != none &&
                             c.normal >= normal.size();
    if (uv_lost) c.uv = none;
    if (normal_lost) c.normal = none;
    lost_corners_ += uv_lost || normal_lost;
  }
}

void MeshBuilder::split_vertices() {
  drop_lost_indices();
  const size_t vertices = mesh.position.size();
  const bool has_uv =
      std::any_of(corner_.begin(), corner_.end(), [](const Corner& c) { return c.uv != none; });
  const bool has_normal =
      wanted_ == CornerData::uv_and_normal &&
      std::any_of(corner_.begin(), corner_.end(), [](const Corner& c) { return c.normal != none; });
  if (has_uv) mesh.uv.assign(vertices, Imath::V2f(0));
  if (has_normal) mesh.normal.assign(vertices, Imath::V3f(0));
  std::vector<uint32_t> next(vertices, none);  // of the kinds of a vertex
  std::vector<char> used(vertices, 0);
  std::vector<uint32_t> point(vertices);
  for (uint32_t v = 0; v < vertices; ++v) point[v] = v;
  for (size_t k = 0; k < corner_.size(); ++k) {
    const Corner& c = corner_[k];
    if (has_uv && c.uv == none) ++without_uv_;
    const Imath::V2f t = c.uv != none ? uv[c.uv] : Imath::V2f(0);
    const Imath::V3f n = has_normal && c.normal != none ? normal[c.normal] : Imath::V3f(0);
    uint32_t v = c.vertex;
    if (used[v]) {
      const auto same = [&] {
        return (!has_uv || mesh.uv[v] == t) && (!has_normal || mesh.normal[v] == n);
      };
      while (!same() && next[v] != none) v = next[v];
      if (!same()) {
        next[v] = uint32_t(mesh.position.size());
        mesh.position.push_back(mesh.position[c.vertex]);
        v = next[v];
        next.push_back(none), used.push_back(0), point.push_back(c.vertex);
        if (has_uv) mesh.uv.push_back(t);
        if (has_normal) mesh.normal.push_back(n);
      }
    }
    used[v] = 1;
    if (has_uv) mesh.uv[v] = t;
    if (has_normal) mesh.normal[v] = n;
    auto& triangle = mesh.triangle[k / 3];
    triangle[int(k % 3)] = v;
  }
  if (mesh.position.size() == vertices) return;
  for (size_t v = vertices; v < point.size(); ++v) {
    repeat(mesh.velocity, v, point[v]);
    repeat(mesh.rest_position, v, point[v]);
    if (!has_uv) repeat(mesh.uv, v, point[v]);
    if (!has_normal) repeat(mesh.normal, v, point[v]);
    for (const MeshColumn& column : mesh_columns) repeat(mesh.*column.values, v, point[v]);
  }
  mesh.point = std::move(point);
}

void MeshBuilder::warn() const {
  const auto say = [&](const std::string& text) { log_file_warning("mesh", path_, text); };
  if (short_faces_ > 0) {
    say(
        fmt::format("{} faces of fewer than three corners were left out, the first at {}; they "
                    "enclose nothing",
                    short_faces_, location_of_(first_short_face_)));
  }
  if (lost_corners_ > 0) {
    say(
        fmt::format("{} of {} corners name a texture coordinate or normal that is not there; they "
                    "are taken as without one. Export the mesh again if a texture shows there",
                    lost_corners_, corner_.size()));
  }
  if (without_uv_ > 0) {
    say(
        fmt::format("{} of {} corners have no texture coordinate, and (0, 0) was taken; unwrap "
                    "these faces too if a texture shows there",
                    without_uv_, corner_.size()));
  }
  if (bad_uv_ > 0) {
    say(
        fmt::format("{} texture coordinates are not finite, and (0, 0) was taken; unwrap the mesh "
                    "again if a texture shows there",
                    bad_uv_));
  }
  if (bad_normals_ > 0) {
    say(fmt::format(
        "{} normals are not finite; those of the faces around are taken where they show",
        bad_normals_));
  }
  if (bad_values_ > 0) {
    say(fmt::format("{} velocities or other values of vertices are not finite, and 0 was taken",
                    bad_values_));
  }
}

TriangleMesh MeshBuilder::finish() {
  if (mesh.triangle.empty() && short_faces_ > 0)
    fail(fmt::format("has {} faces, all of 2 vertices or fewer", short_faces_));
  for (const Polygon& polygon : polygon_) cut(polygon);
  check_vertices();
  mend_columns();
  if (by_corner_) split_vertices();
  fill_normals();
  mesh.velocity.resize(mesh.position.size(), Imath::V3f(0));
  warn();
  return std::move(mesh);
}

}  // namespace drench
