#include "pipeline/contract/geometry/obstacle.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string_view>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/mesh_columns.h"
#include "pipeline/contract/geometry/shells.h"
#include "pipeline/contract/geometry/weld.h"
#include "pipeline/contract/log.h"

namespace drench {

namespace {

constexpr double pi = std::numbers::pi;
using Triangle = Imath::Vec3<uint32_t>;
using OpenEdges = std::vector<std::pair<uint32_t, uint32_t>>;

/// Turns the axes about x, then y, then z of the world.
void turn(V3d (&axis)[3], const V3d& degrees) {
  for (int k = 0; k < 3; ++k) {
    const double angle = degrees[k] * pi / 180, c = std::cos(angle), s = std::sin(angle);
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    for (V3d& a : axis) {
      const double u = a[i], v = a[j];
      a[i] = c * u - s * v, a[j] = s * u + c * v;
    }
  }
}

/// Position of the first %d or %0Nd in a file name, and its length and digits.
struct Field {
  size_t at = std::string::npos, length = 0;
  int digits = 0;
};
Field frame_field(const std::string& name) {
  for (size_t at = name.find('%'); at != std::string::npos; at = name.find('%', at + 1)) {
    const std::string_view rest = std::string_view(name).substr(at);
    if (rest.starts_with("%d")) return {at, 2, 0};
    if (rest.size() >= 4 && rest[1] == '0' && rest[2] >= '1' && rest[2] <= '9' && rest[3] == 'd')
      return {at, 4, rest[2] - '0'};
  }
  return {};
}

/// Between two corners of open edges, of the first thousand.
double narrowest_gap(const TriangleMesh& mesh, const OpenEdges& open) {
  std::set<uint32_t> rim;
  for (const auto& [a, b] : open) {
    rim.insert({a, b});
    if (rim.size() > 1000) break;
  }
  double gap = std::numeric_limits<double>::infinity();
  for (auto a = rim.begin(); a != rim.end(); ++a)
    for (auto b = rim.begin(); b != a; ++b)
      gap = std::min(gap, V3d(mesh.position[*a] - mesh.position[*b]).length());
  return gap;
}

/// What is wrong at the first open edge, and what to do.
std::string fault_at(const TriangleMesh& mesh, const std::vector<uint32_t>& first,
                     const OpenEdges& open) {
  std::multiset<std::array<uint32_t, 3>> faces;  // at the edge, their corners in order
  for (const Triangle& t : mesh.triangle) {
    std::array<uint32_t, 3> corner{first[t.x], first[t.y], first[t.z]};
    std::sort(corner.begin(), corner.end());
    const auto has = [&](uint32_t v) { return std::count(corner.begin(), corner.end(), v) == 1; };
    if (has(open.front().first) && has(open.front().second)) faces.insert(corner);
  }
  for (const auto& face : faces)
    if (faces.count(face) > 1) return "A face lies there more than once: remove doubled faces";
  if (faces.size() == 2)
    return "Both triangles there pass it the same way: one of them is turned; orient all faces in "
           "one way";
  if (faces.size() > 2)
    return fmt::format("{} triangles meet there: remove faces within the solid", faces.size());
  return fmt::format(
      "The nearest of their corners are {:.3g} apart, in the file's unit; gaps up to {:.3g} are "
      "closed. It needs an inside: close its holes, merge its vertices by distance, and orient it "
      "in one way",
      narrowest_gap(mesh, open), weld_fraction * diagonal_of(mesh));
}

[[noreturn]] void refuse_open(const TriangleMesh& mesh, const std::filesystem::path& file,
                              const std::vector<uint32_t>& first, const OpenEdges& open) {
  // Nine digits tell any two floats apart.
  const auto corner = [&](uint32_t v) {
    const V3f& p = mesh.position[v];
    return fmt::format("({:.9g}, {:.9g}, {:.9g})", p.x, p.y, p.z);
  };
  const auto [a, b] = open.front();
  throw Error(fmt::format(
      "{}: the mesh is not closed: the edge from {} to {} has not as many triangles one way as the "
      "other, and so have {} edges in all. {}",
      file.string(), corner(a), corner(b), open.size(), fault_at(mesh, first, open)));
}

/// Joins vertices where the surface is open by less than rounding. @throws Error if it stays open.
void close_gaps(TriangleMesh& mesh, const std::filesystem::path& file) {
  const Welded welded = weld(mesh, weld_fraction * diagonal_of(mesh));
  const auto open = free_edges(mesh, welded.first);
  if (!open.empty()) refuse_open(mesh, file, welded.first, open);
  size_t moved = 0;
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    const V3f& first = mesh.position[welded.first[v]];
    if (welded.first[v] == v || mesh.position[v] == first) continue;
    mesh.position[v] = first;
    ++moved;
  }
  if (moved > 0) {
    log_file_warning("mesh", file,
                     fmt::format("hairline gaps were closed: {} vertices moved by up to {:.3g} of "
                                 "the file's unit onto their neighbours. Merge its vertices by "
                                 "distance",
                                 moved, welded.widest));
  }
}

/// Leaves out triangles of which two corners are at one point: they enclose nothing.
void drop_collapsed(TriangleMesh& mesh, const std::filesystem::path& file) {
  const auto& at = mesh.position;
  const size_t dropped = std::erase_if(mesh.triangle, [&](const Triangle& t) {
    return at[t.x] == at[t.y] || at[t.y] == at[t.z] || at[t.z] == at[t.x];
  });
  if (dropped == 0) return;
  mesh.contact.clear();
  log_file_warning("mesh", file,
                   fmt::format("{} triangles with two corners at one place were left out; they "
                               "enclose nothing. Merge its vertices by distance",
                               dropped));
}

/// Leaves out vertices that no triangle has: they are no points of a solid.
void drop_unused_vertices(TriangleMesh& mesh, const std::filesystem::path& file) {
  const size_t n = mesh.position.size();
  constexpr auto unused = uint32_t(-1);
  std::vector<uint32_t> number(n, unused);
  for (const Triangle& t : mesh.triangle)
    for (const uint32_t v : {t.x, t.y, t.z})
      number[v] = number[mesh.point.empty() ? v : mesh.point[v]] = 0;
  uint32_t kept = 0;
  for (uint32_t& v : number)
    if (v != unused) v = kept++;
  if (kept == n) return;
  const auto shrink = [&](auto& column) {
    if (column.size() != n) return;
    for (size_t v = 0; v < n; ++v)
      if (number[v] != unused) column[number[v]] = column[v];
    column.resize(kept);
  };
  shrink(mesh.position), shrink(mesh.velocity), shrink(mesh.normal), shrink(mesh.uv);
  shrink(mesh.rest_position);
  for (const MeshColumn& column : mesh_columns) shrink(mesh.*column.values);
  for (uint32_t& v : mesh.point) v = number[v];
  shrink(mesh.point);
  for (Triangle& t : mesh.triangle) t = {number[t.x], number[t.y], number[t.z]};
  log_file_warning("mesh", file,
                   fmt::format("{} vertices belong to no triangle and were left out; remove them "
                               "where the mesh is modelled",
                               n - kept));
}

/// Turns normals that point away from their faces.
void turn_normals(TriangleMesh& mesh) {
  if (mesh.normal.empty()) return;
  std::vector<V3d> face(mesh.position.size(), V3d(0));
  for (const Triangle& t : mesh.triangle) {
    const V3d a(mesh.position[t.x]);
    const V3d n = (V3d(mesh.position[t.y]) - a).cross(V3d(mesh.position[t.z]) - a);
    for (const uint32_t v : {t.x, t.y, t.z}) face[v] += n;
  }
  for (size_t v = 0; v < face.size(); ++v)
    if (face[v].dot(V3d(mesh.normal[v])) < 0) mesh.normal[v] = -mesh.normal[v];
}

bool is_drawn_as_glass(const Shot& shot, const Obstacle& obstacle) {
  return obstacle.visible &&
         std::any_of(shot.material.begin(), shot.material.end(), [&](const Material& m) {
           return m.name == obstacle.material && m.type == MaterialType::dielectric;
         });
}

void add_quad(TriangleMesh& mesh, const V3d& corner, const V3d& u, const V3d& v) {
  const auto first = uint32_t(mesh.position.size());
  const V3d normal = u.cross(v).normalized();
  for (int k = 0; k < 4; ++k) {
    const double s = k & 1, t = k >> 1;
    mesh.position.push_back(V3f(corner + u * s + v * t));
    mesh.normal.push_back(V3f(normal));
    mesh.uv.emplace_back(float(s * u.length()), float(t * v.length()));
  }
  mesh.triangle.emplace_back(first, first + 1, first + 3);
  mesh.triangle.emplace_back(first, first + 3, first + 2);
}

TriangleMesh box_mesh(const V3d& size) {
  TriangleMesh mesh;
  for (int k = 0; k < 3; ++k) {
    V3d u(0), v(0);
    u[(k + 1) % 3] = size[(k + 1) % 3], v[(k + 2) % 3] = size[(k + 2) % 3];
    V3d low = size * -0.5, high = low;
    high[k] = -low[k];
    add_quad(mesh, high, u, v);
    add_quad(mesh, low, v, u);
  }
  return mesh;
}

TriangleMesh plane_mesh(double half) {
  TriangleMesh mesh;
  add_quad(mesh, V3d(-half, 0, -half), V3d(0, 0, 2 * half), V3d(2 * half, 0, 0));
  return mesh;
}

/// By latitude and longitude; half a degree of arc is 1e-5 radii off.
TriangleMesh sphere_mesh(double radius) {
  constexpr int rows = 96, columns = 192;
  TriangleMesh mesh;
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const double theta = pi * j / rows, phi = 2 * pi * i / columns;
      const V3d n(std::sin(theta) * std::cos(phi), std::cos(theta),
                  -std::sin(theta) * std::sin(phi));
      mesh.position.push_back(V3f(n * radius));
      mesh.normal.push_back(V3f(n));
      mesh.uv.emplace_back(float(phi * radius), float((pi - theta) * radius));
    }
  }
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const uint32_t a = uint32_t(j * (columns + 1) + i), b = a + columns + 1;
      if (j > 0) mesh.triangle.emplace_back(a, b, a + 1);
      if (j + 1 < rows) mesh.triangle.emplace_back(a + 1, b, b + 1);
    }
  }
  return mesh;
}

TriangleMesh own_mesh(const Shot& shot, const Obstacle& obstacle, int frame,
                      const SequenceShape& shape) {
  switch (obstacle.type) {
    case ObstacleType::plane:
      return plane_mesh((shot.domain.max - shot.domain.min).length());
    case ObstacleType::box:
      return box_mesh(obstacle.size);
    case ObstacleType::sphere:
      return sphere_mesh(obstacle.radius);
    case ObstacleType::mesh:
      return read_obstacle_mesh(shot, obstacle, frame, shape, CornerData::uv_and_normal);
  }
  throw std::logic_error("own_mesh: no such type");
}

}  // namespace

Pose obstacle_pose(const Obstacle& obstacle, double frame) {
  Pose pose{obstacle.position.at(frame), {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)}};
  if (obstacle.type == ObstacleType::plane) {
    const V3d n = obstacle.normal.normalized();
    const V3d helper = std::abs(n.y) > 0.9 ? V3d(0, 0, 1) : V3d(0, 1, 0);
    const V3d u = n.cross(helper).normalized();
    pose.axis[0] = u, pose.axis[1] = n, pose.axis[2] = u.cross(n);
  }
  turn(pose.axis, obstacle.rotation_deg.at(frame));
  return pose;
}

LevelSetBounds bounds_in_own_space(const Shot& shot, const Obstacle& obstacle, double begin,
                                   double end) {
  LevelSetBounds bounds;
  for (const Axis axis : shot.domain.axis)
    if (axis == Axis::periodic) return bounds;
  const V3d size = shot.domain.max - shot.domain.min;
  const double margin =
      shot.cloth.empty() ? 2 * support_ratio(shot) * shot.fluid.spacing : size.length();
  for (int k = 0; k < 3; ++k) bounds.low[k] = 1e30, bounds.high[k] = -1e30;
  const bool moves = obstacle.position.keys.size() > 1 || obstacle.rotation_deg.keys.size() > 1;
  constexpr double part = 0.25;  // frames
  V3d before[8];
  double travel = 0;  // m, farthest of a corner from one look to the next
  const int looks = moves ? int(std::min(std::ceil((end - begin) / part), 1e5)) : 0;
  for (int look = 0; look <= looks; ++look) {
    const Pose pose =
        obstacle_pose(obstacle, begin + (looks > 0 ? (end - begin) * look / looks : 0));
    for (int c = 0; c < 8; ++c) {
      V3d corner;
      for (int k = 0; k < 3; ++k)
        corner[k] = c >> k & 1 ? shot.domain.max[k] + margin : shot.domain.min[k] - margin;
      const V3d own = pose.to_own(corner);
      for (int k = 0; k < 3; ++k) {
        bounds.low[k] = std::min(bounds.low[k], own[k]);
        bounds.high[k] = std::max(bounds.high[k], own[k]);
      }
      if (look > 0) travel = std::max(travel, (own - before[c]).length());
      before[c] = own;
    }
  }
  for (int k = 0; k < 3; ++k) bounds.low[k] -= travel, bounds.high[k] += travel;
  return bounds;
}

bool is_sequence(const std::filesystem::path& mesh_file) {
  std::error_code code;
  return frame_field(mesh_file.filename().string()).at != std::string::npos &&
         !std::filesystem::exists(mesh_file, code);
}

std::filesystem::path sequence_file(const std::filesystem::path& pattern, int frame) {
  std::string name = pattern.filename().string();
  const Field field = frame_field(name);
  if (field.at == std::string::npos) throw std::logic_error("sequence_file: no sequence");
  name.replace(field.at, field.length, fmt::format("{:0{}}", frame, field.digits));
  return pattern.parent_path() / name;
}

SequenceShape read_sequence_shape(const Shot& shot, const Obstacle& obstacle) {
  if (!is_sequence(obstacle.mesh_file)) return {};
  return read_mesh(sequence_file(obstacle.mesh_file, shot.timeline.first)).position;
}

TriangleMesh read_closed_mesh(const std::filesystem::path& file, double scale, CornerData corners,
                              const SequenceShape& shape) {
  TriangleMesh mesh = read_mesh(file, corners, shape);
  close_gaps(mesh, file);
  if (shape.empty()) drop_collapsed(mesh, file);
  if (mesh.triangle.empty())
    throw Error(file.string() + ": has no triangles; a solid or volume needs some");
  drop_unused_vertices(mesh, file);
  orient_shells(mesh);
  turn_normals(mesh);
  for (V3f& p : mesh.position) p *= float(scale);
  return mesh;
}

TriangleMesh read_obstacle_mesh(const Shot& shot, const Obstacle& obstacle, int frame,
                                const SequenceShape& shape, CornerData corners) {
  const bool sequence = is_sequence(obstacle.mesh_file);
  const int known = std::clamp(frame, shot.timeline.first, shot.timeline.last);
  const std::filesystem::path file =
      sequence ? sequence_file(obstacle.mesh_file, known) : obstacle.mesh_file;
  TriangleMesh mesh = read_closed_mesh(file, obstacle.scale, corners, shape);
  if (corners == CornerData::uv_and_normal && is_drawn_as_glass(shot, obstacle) &&
      shells_meet(mesh))
    log_file_warning("mesh", file,
                     "shells of this glass cross or touch, and a picture takes each of their faces "
                     "for the glass's end: it is too thin there. Unite them where they are "
                     "modelled, or give each an obstacle, overlapping");
  return mesh;
}

void check_obstacle_meshes(const Shot& shot) {
  for (const Obstacle& o : shot.obstacle) {
    if (o.type != ObstacleType::mesh) continue;
    const SequenceShape shape = read_sequence_shape(shot, o);
    const int first = shot.timeline.first;
    const TriangleMesh mesh = read_obstacle_mesh(shot, o, first, shape, CornerData::uv_and_normal);
    for (int frame = first + 1; !shape.empty() && frame <= shot.timeline.last; ++frame) {
      check_same_topology(mesh,
                          read_obstacle_mesh(shot, o, frame, shape, CornerData::uv_and_normal), o);
    }
  }
}

TriangleMesh obstacle_surface(const Shot& shot, const Obstacle& obstacle, int frame) {
  const bool deforms = obstacle.type == ObstacleType::mesh && is_sequence(obstacle.mesh_file);
  const SequenceShape shape = deforms ? read_sequence_shape(shot, obstacle) : SequenceShape{};
  TriangleMesh mesh = own_mesh(shot, obstacle, frame, shape);
  TriangleMesh before, after;
  if (deforms) {
    before = read_obstacle_mesh(shot, obstacle, frame - 1, shape);
    after = read_obstacle_mesh(shot, obstacle, frame + 1, shape);
    check_same_topology(mesh, before, obstacle), check_same_topology(mesh, after, obstacle);
  }
  const int between =
      std::min(frame + 1, shot.timeline.last) - std::max(frame - 1, shot.timeline.first);
  constexpr double step = 1e-3;  // frames
  const Pose pose = obstacle_pose(obstacle, frame), earlier = obstacle_pose(obstacle, frame - step),
             later = obstacle_pose(obstacle, frame + step);
  mesh.velocity.clear();
  bool moves = false;
  for (size_t k = 0; k < mesh.position.size(); ++k) {
    const V3d own(mesh.position[k]);
    V3d velocity = (later.to_world(own) - earlier.to_world(own)) / (2 * step);  // m a frame
    if (deforms && between > 0) {
      const size_t point = mesh.point.empty() ? k : mesh.point[k];
      const V3d change = V3d(after.position[point] - before.position[point]) / between;
      velocity += pose.to_world(change) - pose.position;
    }
    moves |= velocity.length2() > 0;
    mesh.velocity.push_back(V3f(velocity * shot.timeline.fps));
    mesh.position[k] = V3f(pose.to_world(own));
    if (!mesh.normal.empty())
      mesh.normal[k] = V3f(pose.to_world(V3d(mesh.normal[k])) - pose.position);
  }
  if (!moves) mesh.velocity.clear();
  return mesh;
}

void check_same_topology(const TriangleMesh& mesh, const TriangleMesh& other,
                         const Obstacle& obstacle) {
  // Where vertices are split depends on a frame's normals; points do not.
  const std::vector<uint32_t> point = points_of(mesh), other_point = points_of(other);
  bool same = mesh.triangle.size() == other.triangle.size();
  for (size_t k = 0; same && k < mesh.triangle.size(); ++k) {
    const Triangle &t = mesh.triangle[k], &u = other.triangle[k];
    const uint32_t y = point[t.y], z = point[t.z], v = other_point[u.y], w = other_point[u.z];
    same = point[t.x] == other_point[u.x] && ((y == v && z == w) || (y == w && z == v));
  }
  if (same) return;
  throw Error(fmt::format(
      "obstacle \"{}\": the files of {} do not have the same triangles in every frame, so that "
      "there is nothing to interpolate. Export the sequence with constant topology",
      obstacle.name, obstacle.mesh_file.string()));
}

}  // namespace drench
