#include "sim/probe_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/contract/error.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/probe_check.h"

namespace drench::sim {

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

std::vector<std::string> columns_of(ProbeType type) {
  switch (type) {
    case ProbeType::height:
      return {"height [m]"};
    case ProbeType::pressure:
      return {"pressure [Pa]", "mean pressure [Pa]"};
    case ProbeType::force:
      return {"force x [N]",      "force y [N]",      "force z [N]",
              "mean force x [N]", "mean force y [N]", "mean force z [N]"};
    case ProbeType::tip:
      return {"displacement x [m]", "displacement y [m]", "displacement z [m]"};
    case ProbeType::energy:
      return {"kinetic [J]", "potential [J]", "elastic [J]", "total [J]"};
    case ProbeType::volume:
      return {"particles [1]",        "volume [m^3]",         "centre of mass x [m]",
              "centre of mass y [m]", "centre of mass z [m]", "mean density error [1]"};
    case ProbeType::velocity:
      return {"velocity x [m/s]", "velocity y [m/s]", "velocity z [m/s]"};
    case ProbeType::front:
      return {"front [m]"};
  }
  return {};
}

size_t averaged_of(ProbeType type) {
  return type == ProbeType::pressure ? 1 : type == ProbeType::force ? 3 : 0;
}

ProbeKind kind_of(const Probe& probe, const Shot& shot) {
  switch (probe.type) {
    case ProbeType::height:
      return ProbeKind::height;
    case ProbeType::pressure:
      return probe.on.empty() && wall_under(probe, shot) ? ProbeKind::wall_pressure
                                                         : ProbeKind::inner_pressure;
    case ProbeType::force:
      if (wall_named(probe.target)) return ProbeKind::wall_force;
      return obstacle_named(shot, probe.target) ? ProbeKind::obstacle_force
                                                : ProbeKind::cloth_force;
    case ProbeType::tip:
      return ProbeKind::vertex;
    case ProbeType::energy:
      return ProbeKind::energy;
    case ProbeType::volume:
      return ProbeKind::volume;
    case ProbeType::velocity:
      return ProbeKind::velocity;
    case ProbeType::front:
      return ProbeKind::front;
  }
  return ProbeKind::volume;
}

size_t sheet_named(const Scene& scene, const std::string& name) {
  size_t s = 0;
  while (scene.sheet[s].name != name) ++s;  // check_probes has seen that it is there
  return s;
}

/// m, of the triangles around a vertex at rest.
double longest_edge_at(const Sheet& sheet, int vertex) {
  double longest = 0;
  for (const auto& t : sheet.triangle) {
    for (int c = 0; c < 3; ++c) {
      const uint32_t a = t[c], b = t[(c + 1) % 3];
      if (int(a) == vertex || int(b) == vertex)
        longest = std::max(longest, (sheet.rest[a] - sheet.rest[b]).length());
    }
  }
  return longest;
}

/// Number `vertex` of the sheet's file or grid.
int named_vertex(const Probe& probe, const Shot& shot, const Sheet& sheet) {
  const bool from_file = !sheet.of_file.empty();
  const int count = int(from_file ? sheet.of_file.size() : sheet.rest.size());
  if (probe.vertex >= count) {
    throw Error(fmt::format(
        "{}: probe \"{}\" names vertex {}, but sheet \"{}\" has vertices 0 to {}. Use one of "
        "these, or position",
        shot.file.string(), probe.name, probe.vertex, sheet.name, count - 1));
  }
  const int vertex = from_file ? sheet.of_file[size_t(probe.vertex)] : probe.vertex;
  if (vertex >= 0) return vertex;
  throw Error(fmt::format(
      "{}: probe \"{}\" names vertex {} of sheet \"{}\", which belongs to no triangle. Use "
      "another, or position",
      shot.file.string(), probe.name, probe.vertex, sheet.name));
}

int tip_vertex(const Probe& probe, const Shot& shot, const Sheet& sheet) {
  if (probe.vertex >= 0) return named_vertex(probe, shot, sheet);
  int best = 0;
  const auto far = [&](int v) { return (sheet.rest[size_t(v)] - probe.position).length2(); };
  for (int v = 1; v < int(sheet.rest.size()); ++v) {
    if (far(v) < far(best)) best = v;
  }
  const double off = std::sqrt(far(best)), reach = longest_edge_at(sheet, best);
  if (off <= reach) return best;
  const V3d& p = sheet.rest[size_t(best)];
  throw Error(fmt::format(
      "{}: probe \"{}\" at ({:.6g}, {:.6g}, {:.6g}) m is {:.3g} m off sheet \"{}\": the nearest "
      "vertex, at ({:.6g}, {:.6g}, {:.6g}) m, has no edge longer than {:.3g} m. Move it onto the "
      "sheet, or name the vertex",
      shot.file.string(), probe.name, probe.position.x, probe.position.y, probe.position.z, off,
      sheet.name, p.x, p.y, p.z, reach));
}

/// The integral of a sensor's weight (SoftDisc) over what of it lies between the walls: m^2 on a
/// wall, m^3 inside. Midpoints, within 0.1 %.
double extent_of(const ProbeQuery& q, const Parameters& p) {
  const V3d n(q.normal[0], q.normal[1], q.normal[2]);
  const V3d other = std::abs(n.x) < 0.6 ? V3d(1, 0, 0) : V3d(0, 1, 0);
  const V3d u = n.cross(other).normalized(), v = n.cross(u);
  const bool flat = q.kind == ProbeKind::wall_pressure;
  constexpr int rings = 200, spokes = 240;
  const int layers = flat ? 1 : 40;
  const double reach = double(q.radius) + q.rim, pi = 3.14159265358979323846;
  double sum = 0;
  for (int layer = 0; layer < layers; ++layer) {
    const double along = flat ? 0 : q.rim * (2 * (layer + 0.5) / layers - 1);
    const double thick = flat ? 1 : 2 * q.rim / layers * (1 - std::abs(along) / q.rim);
    for (int ring = 0; ring < rings; ++ring) {
      const double r = reach * (ring + 0.5) / rings;
      const double weight = std::min((reach - r) / (2 * q.rim), 1.0);
      int inside = 0;
      for (int spoke = 0; spoke < spokes; ++spoke) {
        const double angle = 2 * pi * (spoke + 0.5) / spokes;
        const V3d d = n * along + (u * std::cos(angle) + v * std::sin(angle)) * r;
        bool in = true;
        for (int k = 0; k < 3; ++k) {
          const double x = q.place[k] + d[k];
          if (p.wall[k] && !(flat && k == q.axis)) in &= x >= p.low[k] && x <= p.high[k];
        }
        inside += in;
      }
      sum += weight * thick * 2 * pi * r * reach / rings * inside / spokes;
    }
  }
  return sum;
}

void put(float (&to)[3], const V3d& from) {
  for (int k = 0; k < 3; ++k) to[k] = float(from[k]);
}

}  // namespace

ProbeSeries::ProbeSeries(const Shot& shot, const Scene& scene)
    : shot_(shot.name),
      frame_(scene.frame),
      timeline_(shot.timeline),
      spacing_(shot.fluid.spacing) {
  for (int k = 0; k < 3; ++k) {
    low_[k] = scene.parameters.low[k];
    period_[k] = scene.parameters.periodic[k] ? scene.parameters.high[k] - low_[k] : 0;
  }
  for (const Probe& probe : shot.probe) add(probe, shot, scene);
}

void ProbeSeries::add(const Probe& probe, const Shot& shot, const Scene& scene) {
  Series series{probe, {}, V3d(0), columns_of(probe.type), width_, averaged_of(probe.type), {}};
  if (!probe.on.empty()) series.carrier = shot.obstacle[size_t(*obstacle_named(shot, probe.on))];
  series.query.kind = kind_of(probe, shot);
  aim(series, shot, scene);
  width_ += series.columns.size();
  series_.push_back(std::move(series));
}

void ProbeSeries::aim(Series& series, const Shot& shot, const Scene& scene) const {
  const Probe& probe = series.probe;
  ProbeQuery& q = series.query;
  V3d place = probe.position;
  if (q.kind == ProbeKind::energy) {
    for (int k = 0; k < 3; ++k)
      place[k] = shot.gravity.keys.front().second[k] > 0 ? shot.domain.max[k] : shot.domain.min[k];
  }
  for (int k = 0; k < 3; ++k) q.place[k] = float(place[k] - frame_.origin[k]);
  if (q.kind == ProbeKind::wall_pressure || q.kind == ProbeKind::wall_force) {
    const DomainWall wall =
        q.kind == ProbeKind::wall_force ? *wall_named(probe.target) : *wall_under(probe, shot);
    q.axis = wall.axis, q.side = wall.side == Side::high;
  }
  if (probe.type == ProbeType::pressure) {
    put(q.normal, probe.normal.normalized());
    q.rim = scene.parameters.spacing;
    q.radius = std::max(float(probe.radius), q.rim);
    q.extent = float(extent_of(q, scene.parameters));
    if (series.carrier) q.on = *obstacle_named(shot, probe.on);
  }
  if (q.kind == ProbeKind::velocity) q.radius = float(std::max(probe.radius, spacing_));
  if (q.kind == ProbeKind::front) put(q.normal, probe.direction.normalized());
  if (q.kind == ProbeKind::cloth_force) {
    const size_t s = sheet_named(scene, probe.target);
    q.begin = scene.first_vertex[s], q.end = scene.first_vertex[s + 1];
  }
  if (q.kind == ProbeKind::obstacle_force) q.begin = *obstacle_named(shot, probe.target);
  if (q.kind == ProbeKind::vertex) {
    const size_t s = sheet_named(scene, probe.cloth);
    const Sheet& sheet = scene.sheet[s];
    const int node = sheet.node[size_t(tip_vertex(probe, shot, sheet))];
    q.begin = scene.first_vertex[s] + node;
    for (int k = 0; k < 3; ++k)
      series.rest[k] = frame_.to_local(k, sheet.rest[sheet.point[size_t(node)]][k]);
  }
}

std::vector<double> ProbeSeries::values_of(const Series& series,
                                           const std::vector<double>& answer) const {
  std::vector<double> values = answer;
  switch (series.probe.type) {
    case ProbeType::height:
      values[0] += frame_.origin[1];
      break;
    case ProbeType::tip:
      for (int k = 0; k < 3; ++k) values[size_t(k)] -= series.rest[k];
      break;
    case ProbeType::energy:
      values.push_back(answer[0] + answer[1] + answer[2]);
      break;
    case ProbeType::volume:
      values = {answer[0], answer[0] * spacing_ * spacing_ * spacing_};
      for (int k = 0; k < 3; ++k) values.push_back(answer[size_t(k) + 1] + frame_.origin[k]);
      values.push_back(answer[4]);
      break;
    case ProbeType::front:
      for (int k = 0; k < 3; ++k)
        values[0] += frame_.origin[k] * series.probe.direction.normalized()[k];
      break;
    case ProbeType::pressure:
    case ProbeType::force:
    case ProbeType::velocity:
      break;
  }
  return values;
}

void ProbeSeries::start(double time, Solver& solver) {
  if (series_.empty()) return;
  std::vector<ProbeQuery> known;
  for (const Series& s : series_) {
    if (s.averaged == 0) known.push_back(query_at(s, time));
  }
  const std::vector<std::vector<double>> answers = solver.probe(known);
  rows_.push_back(time);
  size_t next = 0;
  for (const Series& s : series_) {
    std::vector<double> values(s.columns.size(), unknown);
    if (s.averaged == 0) values = values_of(s, answers[next++]);
    rows_.insert(rows_.end(), values.begin(), values.end());
  }
}

void ProbeSeries::record(double time, Solver& solver) {
  if (series_.empty()) return;
  const double before = rows_[rows_.size() - width_];
  const auto asked = [&](const Series& s) { return s.averaged > 0 || due(s, before, time); };
  std::vector<ProbeQuery> queries;
  for (const Series& s : series_)
    if (asked(s)) queries.push_back(query_at(s, time));
  const std::vector<std::vector<double>> answers = solver.probe(queries);
  const size_t row = rows_.size();
  rows_.resize(row + width_, unknown);
  rows_[row] = time;
  size_t next = 0;
  for (const Series& s : series_) {
    if (!asked(s)) continue;
    const std::vector<double> values = values_of(s, answers[next++]);
    std::copy(values.begin(), values.end(), rows_.begin() + ptrdiff_t(row + s.first));
    for (size_t c = 0; c < s.averaged; ++c)
      rows_[row + s.first + s.averaged + c] = mean(s.first + c, s.probe.window);
  }
}

bool ProbeSeries::due(const Series& series, double before, double time) {
  const double interval = series.probe.interval;
  // Of a thousandth of an interval: steps end at its multiples but for rounding.
  const auto count = [&](double t) { return std::floor(t / interval + 1e-3); };
  return interval == 0 || count(time) > count(before);
}

ProbeQuery ProbeSeries::query_at(const Series& series, double time) const {
  ProbeQuery q = series.query;
  if (!series.carrier) return q;
  const Pose pose = obstacle_pose(*series.carrier, timeline_.first + time * timeline_.fps);
  const V3d place = pose.to_world(series.probe.position);
  for (int k = 0; k < 3; ++k) {
    double x = place[k] - frame_.origin[k];
    if (period_[k] > 0) x -= period_[k] * std::floor((x - low_[k]) / period_[k]);
    q.place[k] = float(x);
  }
  put(q.normal, (pose.to_world(series.probe.normal) - pose.position).normalized());
  return q;
}

/// Mean of a column over the `window` before the last row; a value holds over its whole step, since
/// it is what the step did to momentum over its length. Less where the rows do not reach so far.
double ProbeSeries::mean(size_t column, double window) const {
  const size_t last = rows_.size() / width_ - 1;
  const double end = rows_[last * width_], begin = end - window;
  double sum = 0, covered = 0;
  for (size_t r = last; r > 0; --r) {
    const double to = rows_[r * width_], from = std::max(rows_[(r - 1) * width_], begin);
    if (r < last && to <= begin) break;
    const double length = r == last && window == 0 ? 1 : to - from;
    sum += length * rows_[r * width_ + column], covered += length;
    if (window == 0) break;
  }
  return sum / covered;
}

bool ProbeSeries::fits(const std::vector<double>& rows) const {
  return series_.empty() ? rows.empty() : !rows.empty() && rows.size() % width_ == 0;
}

std::string ProbeSeries::definition(const Series& series) const {
  const Probe& p = series.probe;
  const ProbeQuery& q = series.query;
  const auto vector = [](const V3d& v) {
    return fmt::format("({:.9g}, {:.9g}, {:.9g})", v.x, v.y, v.z);
  };
  const std::string on =
      p.on.empty() ? "" : fmt::format(" of the obstacle \"{}\"'s own coordinates", p.on);
  const auto window = [&] {
    return fmt::format(
        "; the value of a row holds over the step that ends there; mean: over the {:.9g} s before "
        "each row, steps weighted by their length in it",
        p.window);
  };
  switch (q.kind) {
    case ProbeKind::height:
      return fmt::format(
          "y of the topmost place on the vertical line {} where the density reaches half of rest "
          "density; empty where none does",
          p.on.empty() ? fmt::format("at x = {:.9g} m, z = {:.9g} m", p.position.x, p.position.z)
                       : fmt::format("through {} m{}", vector(p.position), on));
    case ProbeKind::wall_pressure:
    case ProbeKind::inner_pressure:
      return fmt::format(
          "{} a disc of radius {:.9g} m about {} m{}, normal {}, its weight falling from 1 to 0 "
          "within a spacing of {:.9g} m about the rim{}",
          q.kind == ProbeKind::wall_pressure ? "force of the fluid on the wall over area, for"
                                             : "force on the obstacle or sheet that it lies on "
                                               "over area, or else stress along the "
                                               "normal, fluid-free parts counting as 0, in",
          std::max(p.radius, spacing_), vector(p.position), on, vector(p.normal.normalized()),
          spacing_, window());
    case ProbeKind::wall_force:
      return fmt::format("force of the fluid on the domain wall {}{}", p.target, window());
    case ProbeKind::cloth_force:
      return fmt::format("force of the fluid on the sheet \"{}\"{}", p.target, window());
    case ProbeKind::obstacle_force:
      return fmt::format("force of fluid and sheets on the obstacle \"{}\"{}", p.target, window());
    case ProbeKind::vertex:
      return fmt::format("displacement of a vertex of \"{}\" from its rest place {} m", p.cloth,
                         vector(V3d(frame_.to_world(0, float(series.rest.x)),
                                    frame_.to_world(1, float(series.rest.y)),
                                    frame_.to_world(2, float(series.rest.z)))));
    case ProbeKind::energy:
      return fmt::format(
          "kinetic and potential energy of fluid and cloth and energy of the cloth's springs; "
          "potential energy is 0 at {} m",
          vector(V3d(frame_.to_world(0, q.place[0]), frame_.to_world(1, q.place[1]),
                     frame_.to_world(2, q.place[2]))));
    case ProbeKind::velocity:
      return fmt::format(
          "mean velocity of the fluid in a ball of radius {:.9g} m about {} m{}; "
          "empty where there is none",
          std::max(p.radius, spacing_), vector(p.position), on);
    case ProbeKind::front:
      return fmt::format("place along {} of the farthest fluid: half a spacing beyond a particle",
                         vector(p.direction.normalized()));
    case ProbeKind::volume:
      return "particles, their volume at rest density, centre of mass, mean of max(density / rest "
             "density - 1, 0)";
  }
  return "";
}

std::vector<ProbeText> ProbeSeries::texts() const {
  std::vector<ProbeText> texts;
  for (const Series& s : series_) {
    fmt::memory_buffer out;
    const auto to = fmt::appender(out);
    fmt::format_to(to, "# drench probe \"{}\" of shot \"{}\"\n# {}\n", s.probe.name, shot_,
                   definition(s));
    fmt::format_to(
        to,
        "# time since the first frame; the first row is the state at the start, every "
        "other one the end of a step{}\ntime [s],{}\n",
        s.probe.interval > 0 ? fmt::format(", the first in every {:.9g} s", s.probe.interval) : "",
        fmt::join(s.columns, ","));
    for (size_t row = 0; row < rows_.size(); row += width_) {
      if (row > 0 && !due(s, rows_[row - width_], rows_[row])) continue;
      fmt::format_to(to, "{:.12g}", rows_[row]);
      for (size_t c = s.first; c < s.first + s.columns.size(); ++c) {
        const double value = rows_[row + c];
        std::isnan(value) ? fmt::format_to(to, ",") : fmt::format_to(to, ",{:.9g}", value);
      }
      fmt::format_to(to, "\n");
    }
    texts.push_back({s.probe.name, fmt::to_string(out)});
  }
  return texts;
}

}  // namespace drench::sim
