#include "sim/setup/mesh_emitter.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "sim/setup/scene.h"

namespace drench::sim {

namespace {

constexpr double least_distance = 0.9;  // spacings, as of sources that overlap

Obstacle frame_of(const FluidEmitter& emitter) {
  Obstacle frame;
  frame.position = emitter.center, frame.rotation_deg = emitter.rotation_deg;
  return frame;
}

/// Whole cells of the domain; along periodic axes there is no end.
CellRange cells_of(const Shot& shot) {
  CellRange range;
  for (size_t k = 0; k < 3; ++k) {
    if (shot.domain.axis[k] == Axis::periodic) continue;
    const double size = shot.domain.max[int(k)] - shot.domain.min[int(k)];
    range.first[k] = 0, range.last[k] = int64_t(size / shot.fluid.spacing + 1e-6);
  }
  return range;
}

/// Marks the cells of a box whose places are near a particle.
class NearParticles {
 public:
  NearParticles(const Scene& scene, const std::vector<Cell>& cells);
  bool near(const Cell& cell) const { return near_[index(cell)] != 0; }
  /// A particle and its images, m local.
  void mark(const V3d& particle);

 private:
  size_t index(const Cell& c) const {
    return size_t(((c[2] - first_[2]) * size_[1] + c[1] - first_[1]) * size_[0] + c[0] - first_[0]);
  }
  void mark_around(const V3d& p);

  double a_, period_[3];
  V3d corner_;  // of cell 0, 0, 0
  Cell first_, size_;
  std::vector<char> near_;
};

NearParticles::NearParticles(const Scene& scene, const std::vector<Cell>& cells)
    : a_(scene.frame.spacing), first_(cells.front()) {
  Cell last = first_;
  for (const Cell& c : cells) {
    for (size_t k = 0; k < 3; ++k)
      first_[k] = std::min(first_[k], c[k]), last[k] = std::max(last[k], c[k]);
  }
  const Parameters& p = scene.parameters;
  for (size_t k = 0; k < 3; ++k) {
    size_[k] = last[k] - first_[k] + 1;
    period_[k] = p.periodic[k] ? double(p.high[k]) - double(p.low[k]) : 0;
    corner_[int(k)] = double(p.low[k]);
  }
  near_.resize(size_t(size_[0]) * size_t(size_[1]) * size_t(size_[2]));
}

void NearParticles::mark(const V3d& particle) {
  int64_t first[3] = {0, 0, 0}, last[3] = {0, 0, 0};  // images along each axis
  for (int k = 0; k < 3; ++k) {
    const double low = corner_[k] + double(first_[size_t(k)] - 1) * a_ - particle[k];
    const double high = low + double(size_[size_t(k)] + 2) * a_;
    if (period_[k] > 0) {
      first[k] = int64_t(std::ceil(low / period_[k])),
      last[k] = int64_t(std::floor(high / period_[k]));
    } else if (low > 0 || high < 0) {
      return;
    }
  }
  for (int64_t z = first[2]; z <= last[2]; ++z) {
    for (int64_t y = first[1]; y <= last[1]; ++y) {
      for (int64_t x = first[0]; x <= last[0]; ++x) {
        mark_around(particle +
                    V3d(double(x) * period_[0], double(y) * period_[1], double(z) * period_[2]));
      }
    }
  }
}

void NearParticles::mark_around(const V3d& p) {
  const V3d at = (p - corner_) / a_;  // the place of a cell is at cell + 0.5
  int64_t begin[3], end[3];
  for (int k = 0; k < 3; ++k) {
    const int64_t cell = int64_t(std::floor(at[k])), first = first_[size_t(k)];
    begin[k] = std::max(cell - 1, first);
    end[k] = std::min(cell + 1, first + size_[size_t(k)] - 1);
  }
  for (int64_t z = begin[2]; z <= end[2]; ++z) {
    for (int64_t y = begin[1]; y <= end[1]; ++y) {
      for (int64_t x = begin[0]; x <= end[0]; ++x) {
        const V3d d = at - V3d(double(x) + 0.5, double(y) + 0.5, double(z) + 0.5);
        if (d.length2() < least_distance * least_distance) near_[index({x, y, z})] = 1;
      }
    }
  }
}

}  // namespace

MeshEmitter::MeshEmitter(const Shot& shot, size_t index, const LevelSetMaker& make_level_set)
    : shot_(shot),
      index_(index),
      start_(shot.fluid.emitter[index].start - shot.preroll),
      stop_(shot.fluid.emitter[index].stop - shot.preroll),
      frame_(frame_of(shot.fluid.emitter[index])),
      interior_(
          shot,
          read_closed_mesh(shot.fluid.emitter[index].mesh_file, shot.fluid.emitter[index].scale),
          shot.fluid.emitter[index].inset, fmt::format("fluid.emitter[{}]", index),
          make_level_set) {
  const double first = film_frame(start_);
  const double last = std::max(first, std::min(film_frame(stop_), double(shot.timeline.last)));
  for (double frame = first; cells_at(frame).empty(); frame = std::min(frame + 1, last)) {
    if (frame < last && moves()) continue;
    const FluidEmitter& emitter = shot.fluid.emitter[index];
    throw Error(fmt::format(
        "{}: fluid.emitter[{}] never holds a particle: nowhere within the domain is {} {} spacings "
        "(fluid.spacing {} m) or more inside its surface. Move it into the domain, or use a "
        "smaller spacing, a larger scale, or a smaller inset",
        shot.file.string(), index, emitter.mesh_file.string(), emitter.inset, shot.fluid.spacing));
  }
}

bool MeshEmitter::moves() const {
  return frame_.position.keys.size() > 1 || frame_.rotation_deg.keys.size() > 1;
}

const std::vector<Cell>& MeshEmitter::cells_at(double frame) {
  if (known_ && (cells_frame_ == frame || !moves())) return cells_;
  cells_ = interior_.cells(shot_, obstacle_pose(frame_, frame), cells_of(shot_));
  cells_frame_ = frame, known_ = true;
  return cells_;
}

V3d MeshEmitter::carried(const V3d& place, double frame) const {
  if (!moves()) return V3d(0);
  constexpr double step = 1e-3;  // frames
  const V3d own = obstacle_pose(frame_, frame).to_own(place);
  // Forward: what appears where the mesh starts off flies with it.
  return (obstacle_pose(frame_, frame + step).to_world(own) - place) * (shot_.timeline.fps / step);
}

std::vector<NewParticle> MeshEmitter::missing(const Scene& scene, const HostVec& position,
                                              double time) {
  std::vector<NewParticle> found;
  const double frame = film_frame(time);
  const std::vector<Cell>& cells = cells_at(frame);
  if (cells.empty()) return found;
  NearParticles particles(scene, cells);
  for (size_t i = 0; i < position.size(); ++i)
    particles.mark(V3d(position.x[i], position.y[i], position.z[i]));
  for (const Cell& cell : cells) {
    if (particles.near(cell)) continue;
    const V3d place = place_of(shot_, cell);
    found.push_back({place, shot_.fluid.emitter[index_].velocity + carried(place, frame)});
    // The lattice may meet itself across a seam.
    particles.mark(V3d(scene.place(0, place.x), scene.place(1, place.y), scene.place(2, place.z)));
  }
  return found;
}

std::vector<V3d> MeshEmitter::places(double time) {
  std::vector<V3d> all;
  for (const Cell& cell : cells_at(film_frame(time))) all.push_back(place_of(shot_, cell));
  return all;
}

void MeshEmitter::add_corners(double frame, std::vector<V3d>& all) const {
  const Pose pose = obstacle_pose(frame_, frame);
  for (int c = 0; c < 8; ++c) all.push_back(pose.to_world(interior_.corner(c)));
}

std::vector<V3d> MeshEmitter::corners() const {
  std::vector<V3d> all;
  for (const Animated<V3d>* track : {&frame_.position, &frame_.rotation_deg}) {
    for (const auto& [frame, value] : track->keys) add_corners(frame, all);
  }
  return all;
}

double MeshEmitter::fastest() const {
  constexpr double part = 0.25;  // frames
  double speed = 0;
  for (double f = shot_.timeline.first; moves() && f < shot_.timeline.last; f += part) {
    std::vector<V3d> corners;
    add_corners(f, corners);
    for (const V3d& p : corners) speed = std::max(speed, carried(p, f).length());
  }
  return speed + shot_.fluid.emitter[index_].velocity.length();
}

std::vector<MeshEmitter> mesh_emitters(const Shot& shot, const LevelSetMaker& make_level_set) {
  std::vector<MeshEmitter> emitters;
  for (size_t e = 0; e < shot.fluid.emitter.size(); ++e) {
    if (shot.fluid.emitter[e].type == EmitterType::mesh)
      emitters.emplace_back(shot, e, make_level_set);
  }
  return emitters;
}

}  // namespace drench::sim
