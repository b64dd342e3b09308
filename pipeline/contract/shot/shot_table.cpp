#include "pipeline/contract/shot/shot_table.h"

#include "pipeline/contract/shot/shot_rows.h"

namespace drench::shot_table {

namespace {

// ---- sections

template <auto MemberPointer>
Section single(std::string_view name, std::string_view description) {
  Section section;
  section.name = name;
  section.description = description;
  section.count = [](void*) { return size_t(1); };
  section.at = [](void* owner, size_t) { return field_of<MemberPointer>(owner); };
  return section;
}

Section inside(std::string_view parent, Section section) {
  section.parent = parent;
  return section;
}

template <auto MemberPointer>
Section repeated(std::string_view name, std::string_view parent, std::string_view description) {
  using Owner = typename Member<decltype(MemberPointer)>::Owner;
  Section section;
  section.name = name;
  section.parent = parent;
  section.description = description;
  section.repeated = true;
  section.count = [](void* owner) { return (static_cast<Owner*>(owner)->*MemberPointer).size(); };
  section.at = [](void* owner, size_t i) -> void* {
    return &(static_cast<Owner*>(owner)->*MemberPointer)[i];
  };
  section.append = [](void* owner) { (static_cast<Owner*>(owner)->*MemberPointer).emplace_back(); };
  return section;
}

template <class Object>
Section named(Section section) {
  section.name_of = [](void* object) -> const std::string* {
    return &static_cast<Object*>(object)->name;
  };
  return section;
}

template <class Object>
Section typed(Section section) {
  section.type_of = [](void* object) { return int(static_cast<Object*>(object)->type); };
  return named<Object>(section);
}

Section modelled(Section section) {
  section.type_of = [](void* object) { return int(static_cast<Cloth*>(object)->model); };
  section.type_key = "model";
  return named<Cloth>(section);
}

Section emitters(Section section) {
  section.type_of = [](void* object) { return int(static_cast<FluidEmitter*>(object)->type); };
  return section;
}

Section sinks(Section section) {
  section.type_of = [](void* object) { return int(static_cast<Sink*>(object)->shape.type); };
  section.name_of = [](void* object) -> const std::string* {
    return &static_cast<Sink*>(object)->shape.name;
  };
  return section;
}

Section whole_shot() {
  Section section;
  section.name = "shot";
  section.description = "Time, chance and gravity.";
  section.count = [](void*) { return size_t(1); };
  section.at = [](void* owner, size_t) { return owner; };
  return section;
}

}  // namespace

const std::vector<Section>& sections() {
  static const std::vector<Section> table{
      whole_shot(),
      single<&Shot::domain>("domain", "The space of the simulation and its walls."),
      inside("domain", single<&Domain::wall_velocity>(
                           "domain.wall_velocity",
                           "Walls that move along themselves, as belts do: they drag the fluid "
                           "of the incompressible solver.")),
      single<&Shot::fluid>("fluid", "The fluid. Without sources there is none."),
      repeated<&Fluid::box>("fluid.box", "fluid", "A block of fluid at the start."),
      repeated<&Fluid::sphere>("fluid.sphere", "fluid", "A ball of fluid at the start."),
      emitters(repeated<&Fluid::emitter>(
          "fluid.emitter", "fluid",
          "An inlet, or a mesh that is kept full, standing or moving as its "
          "keys say.")),
      repeated<&Fluid::drops>("fluid.drops", "fluid",
                              "Drops with centres drawn evenly in a box and kept apart."),
      repeated<&Fluid::volume>("fluid.volume", "fluid",
                               "A closed mesh full of fluid at the start."),
      modelled(repeated<&Shot::cloth>("cloth", "", "A sheet of cloth: a grid or a mesh file.")),
      repeated<&Cloth::pin>("cloth.pin", "cloth",
                            "Vertices that are held, a list or a box: where they start, as keys "
                            "move them, or on an obstacle."),
      repeated<&Cloth::seam>("cloth.seam", "cloth",
                             "Springs that sew vertices of the sheet to another one, or its own: "
                             "edges of grids, or lists."),
      typed<Obstacle>(repeated<&Shot::obstacle>(
          "obstacle", "", "A solid in the fluid, standing or moving as its keys say.")),
      sinks(repeated<&Shot::sink>(
          "sink", "", "A drain: takes away the fluid that comes into it. No solid, not drawn.")),
      single<&Shot::wind>("wind", "Air that drags fluid and cloth along, still or moving."),
      single<&Shot::coupling>("coupling", "How fluid and cloth push each other."),
      typed<Probe>(repeated<&Shot::probe>(
          "probe", "", "A measurement, a row for every step in `sim/probe.NAME.csv`.")),
      single<&Shot::surface>("surface", "The surface built around the particles."),
      single<&Shot::foam>("foam", "Spray, foam and bubbles, particles of their own."),
      single<&Shot::camera>("camera", "A thin-lens camera that looks along -Z of its own frame."),
      typed<Light>(repeated<&Shot::light>("light", "", "A light.")),
      typed<Material>(repeated<&Shot::material>(
          "material", "", "A material; water, cotton and ground are built in.")),
      single<&Shot::ground>("ground", "A plane under the scene; the simulation does not know it."),
      single<&Shot::render>("render", "The picture."),
      single<&Shot::layers>("layers", "What else a frame's EXR holds, for compositing."),
      single<&Shot::view>("view",
                          "How PNGs and movies show frames: by the built-in transform, or with any "
                          "of these keys by OpenColorIO."),
  };
  return table;
}

const std::vector<Parameter>& parameters() {
  static const std::vector<Parameter> table = [] {
    std::vector<Parameter> all;
    for (const auto& part :
         {shot_rows(), fluid_rows(), source_rows(), cloth_rows(), obstacle_rows(), probe_rows(),
          foam_rows(), surface_rows(), picture_rows()}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }();
  return table;
}

const Section* find_section(std::string_view name) {
  for (const Section& section : sections()) {
    if (section.name == name) return &section;
  }
  return nullptr;
}

const Parameter* find_parameter(std::string_view section, std::string_view key) {
  for (const Parameter& parameter : parameters()) {
    if (parameter.section == section && parameter.key == key) return &parameter;
  }
  return nullptr;
}

std::vector<const Parameter*> parameters_of(std::string_view section) {
  std::vector<const Parameter*> rows;
  for (const Parameter& parameter : parameters()) {
    if (parameter.section == section) rows.push_back(&parameter);
  }
  return rows;
}

bool applies(const Parameter& parameter, const Section& section, void* object) {
  if (section.type_of == nullptr) return true;
  return (parameter.types >> section.type_of(object) & 1u) != 0;
}

}  // namespace drench::shot_table
