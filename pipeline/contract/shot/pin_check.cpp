#include "pipeline/contract/shot/pin_check.h"

#include "pipeline/contract/shot/check_base.h"
#include "pipeline/contract/shot/probe_check.h"

namespace drench {

namespace {

class PinChecker : CheckBase {
 public:
  using CheckBase::CheckBase;

  void check() const {
    for (size_t i = 0; i < shot_.cloth.size(); ++i) {
      const Cloth& cloth = shot_.cloth[i];
      for (size_t k = 0; k < cloth.pin.size(); ++k)
        check_pin(cloth, fmt::format("cloth[{}].pin[{}]", i, k), cloth.pin[k]);
      for (size_t k = 0; k < cloth.seam.size(); ++k)
        check_seam(cloth, fmt::format("cloth[{}].seam[{}]", i, k), cloth.seam[k]);
    }
  }

 private:
  void check_pin(const Cloth& cloth, const std::string& path, const ClothPin& pin) const {
    if (pin.vertices.empty() != pin.box.has_value()) {
      fail(path, fmt::format("{} needs either vertices = [...] or box = {{min, max}}, and not both",
                             path));
    }
    check_vertices(cloth, path + ".vertices", pin.vertices);
    check_motion(path, pin);
    if (pin.release == 0) {
      fail(
          path + ".release",
          fmt::format("{0}.release is 0 s: the group is let go before it is held. Use a time after "
                      "the start of the simulation, or remove {0}",
                      path));
    }
    if (!pin.stands()) {
      const char* key = !pin.on.empty()      ? ".on"
                        : pin.moves()        ? ".position"
                        : pin.stiffness != 0 ? ".stiffness"
                                             : ".release";
      check_implicit(path + key, path, "holds vertices in other places than they start");
    }
  }

  void check_motion(const std::string& path, const ClothPin& pin) const {
    const bool keyed = pin.position.keys.size() > 1 || pin.rotation_deg.keys.size() > 1;
    if (!pin.on.empty() && keyed) {
      fail(path + ".on", fmt::format("{0}.on is \"{1}\", which carries the group, but {0} has keys "
                                     "of its own. Remove one of them",
                                     path, pin.on));
    }
    if (!pin.on.empty() && !obstacle_named(shot_, pin.on)) {
      std::vector<std::string> names;
      for (const Obstacle& obstacle : shot_.obstacle) names.push_back(obstacle.name);
      fail(path + ".on",
           fmt::format("{}.on is \"{}\", which is not an obstacle; the obstacles of this shot: {}",
                       path, pin.on,
                       names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
    }
    const auto check_keys = [&](const char* key, const Animated<V3d>& track) {
      const V3d& value = track.keys.front().second;
      if (track.keys.size() > 1 || value == V3d(0)) return;
      fail(
          path + key,
          fmt::format("{}{} is {}, one value for all time: only what keys change by moves a group, "
                      "which starts where its sheet has it. Use [[frame, value], ...], or move "
                      "the sheet",
                      path, key, text_of(value)));
    };
    check_keys(".position", pin.position);
    check_keys(".rotation_deg", pin.rotation_deg);
  }

  void check_vertices(const Cloth& cloth, const std::string& key,
                      const std::vector<uint32_t>& list) const {
    const double vertices = (cloth.cells.x + 1.0) * (cloth.cells.y + 1.0);
    for (const uint32_t vertex : list) {
      if (cloth.mesh_file.empty() && vertex >= vertices) {
        fail(key,
             fmt::format("{} holds {}, but the {} x {} grid of \"{}\" has vertices 0 to {:.0f}",
                         key, vertex, cloth.cells.x, cloth.cells.y, cloth.name, vertices - 1));
      }
    }
  }

  void check_implicit(const std::string& key, const std::string& path,
                      std::string_view what) const {
    if (!shot_.fluid.present() || is_incompressible(shot_)) return;
    fail(key, fmt::format("{} {}, but the fluid is weakly compressible and takes its sheets along "
                          "in explicit steps, which know pins at rest only. Use fluid.solver = "
                          "\"incompressible\" and coupling.scheme = \"exact\", or remove it",
                          path, what));
  }

  void check_seam(const Cloth& cloth, const std::string& path, const ClothSeam& seam) const {
    const Cloth& other = other_sheet(cloth, path, seam);
    const size_t here = side(cloth, path, "edge", seam.edge, "vertices", seam.vertices),
                 there =
                     side(other, path, "to_edge", seam.to_edge, "to_vertices", seam.to_vertices);
    if (here != there) {
      fail(path, fmt::format("{} sews {} vertices of \"{}\" to {} of \"{}\"; each needs one other. "
                             "Give both sheets as many cells along the seam, or use lists of equal "
                             "length",
                             path, here, cloth.name, there, other.name));
    }
    if (&cloth == &other && seam.edge == seam.to_edge && seam.vertices == seam.to_vertices) {
      fail(path,
           fmt::format("{} sews vertices of \"{}\" to themselves. Set {}.to to another sheet, "
                       "or to_edge to another edge",
                       path, cloth.name, path));
    }
    if (seam.rest_length < 0 && seam.rest_length != -1) {
      fail(path + ".rest_length",
           fmt::format("{}.rest_length is {} m; give a length, or -1 for what contact keeps the "
                       "sheets apart",
                       path, seam.rest_length));
    }
    check_implicit(path, path, "sews sheets");
  }

  const Cloth& other_sheet(const Cloth& cloth, const std::string& path,
                           const ClothSeam& seam) const {
    if (seam.to.empty()) return cloth;
    std::vector<std::string> names;
    for (const Cloth& one : shot_.cloth) {
      if (one.name == seam.to) return one;
      names.push_back(one.name);
    }
    fail(path + ".to",
         fmt::format("{}.to is \"{}\", which is not a sheet; the sheets of this shot: "
                     "{}",
                     path, seam.to, fmt::join(names, ", ")));
  }

  /// How many vertices one side of a seam has.
  size_t side(const Cloth& cloth, const std::string& path, const char* edge_key, GridEdge edge,
              const char* list_key, const std::vector<uint32_t>& list) const {
    if ((edge == GridEdge::none) == list.empty()) {
      fail(path,
           fmt::format("{} needs either {} = \"u0\", \"u1\", \"v0\" or \"v1\", or {} = [...], "
                       "and not both",
                       path, edge_key, list_key));
    }
    check_vertices(cloth, path + "." + list_key, list);
    if (edge == GridEdge::none) return list.size();
    if (!cloth.mesh_file.empty()) {
      fail(path + "." + edge_key,
           fmt::format("{}.{} names an edge of a grid, but \"{}\" is a mesh. Use {} = [...]", path,
                       edge_key, cloth.name, list_key));
    }
    return edge_vertices(edge, cloth.cells).size();
  }
};

}  // namespace

std::vector<uint32_t> edge_vertices(GridEdge edge, const V2i& cells) {
  const auto nu = uint32_t(cells.x), nv = uint32_t(cells.y);
  const bool along_v = edge == GridEdge::u0 || edge == GridEdge::u1;
  std::vector<uint32_t> list;
  for (uint32_t k = 0; k <= (along_v ? nv : nu); ++k) {
    const uint32_t i = along_v ? (edge == GridEdge::u0 ? 0 : nu) : k,
                   j = along_v ? k : (edge == GridEdge::v0 ? 0 : nv);
    list.push_back(j * (nu + 1) + i);
  }
  return list;
}

void check_pins(const Shot& shot, const ShotSources& sources) { PinChecker(shot, sources).check(); }

}  // namespace drench
