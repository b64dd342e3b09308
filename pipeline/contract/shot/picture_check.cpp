#include "pipeline/contract/shot/picture_check.h"

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "pipeline/contract/shot/check_base.h"

namespace drench {

namespace {

class PictureChecker : CheckBase {
 public:
  using CheckBase::CheckBase;

  void check() const {
    check_camera();
    check_crop();
    check_denoise();
    for (size_t i = 0; i < shot_.light.size(); ++i) check_light(i);
    for (size_t i = 0; i < shot_.material.size(); ++i) check_material(i);
    check_material_uses();
    check_environments();
    check_names();
  }

 private:
  void check_camera() const {
    const Camera& camera = shot_.camera;
    if (camera.shutter_open > camera.shutter_close) {
      fail(
          "camera.shutter_open",
          fmt::format("camera.shutter_open is {} and camera.shutter_close is {}; the shutter would "
                      "close before it opens. Exchange them",
                      camera.shutter_open, camera.shutter_close));
    }
    check_not_zero("camera.up", camera.up);
    check_aperture_and_curve();
    std::set<double> frames;
    for (const auto& [frame, value] : camera.position.keys) frames.insert(frame);
    for (const auto& [frame, value] : camera.target.keys) frames.insert(frame);
    for (const double frame : frames) {
      const V3d view = camera.target.at(frame) - camera.position.at(frame);
      if (!(view.length() > 1e-6)) {
        fail("camera.target", fmt::format("camera.position and camera.target are both {} at frame "
                                          "{}; the camera looks nowhere. Move one of them",
                                          text_of(camera.target.at(frame)), frame));
      }
      if (view.normalized().cross(camera.up.normalized()).length() < 1e-6) {
        fail("camera.up", fmt::format("camera.up is {}, along the view at frame {}, so the picture "
                                      "has no upright. Use another up, for example [0, 0, -1]",
                                      text_of(camera.up), frame));
      }
    }
  }

  void check_crop() const {
    const RenderSettings& r = shot_.render;
    if (r.crop_max == V2i(0, 0) && r.crop_min == V2i(0, 0)) return;
    if (r.crop_min.x < r.crop_max.x && r.crop_min.y < r.crop_max.y && r.crop_max.x <= r.width &&
        r.crop_max.y <= r.height)
      return;
    fail("render.crop_max",
         fmt::format("render.crop_min is [{}, {}] and render.crop_max is [{}, {}]; that is no part "
                     "of a frame of {} x {} pixels. Let max be greater than min and no greater "
                     "than the frame",
                     r.crop_min.x, r.crop_min.y, r.crop_max.x, r.crop_max.y, r.width, r.height));
  }

  void check_denoise() const {
    const RenderSettings& r = shot_.render;
    if (!r.denoise || r.samples >= 16) return;
    fail("render.denoise",
         fmt::format("render.denoise needs at least 16 samples a pixel to tell noise from detail; "
                     "render.samples is {}. Give more or leave denoise out",
                     r.samples));
  }

  void check_aperture_and_curve() const {
    const Camera& camera = shot_.camera;
    if (camera.blades == 1 || camera.blades == 2) {
      fail("camera.blades",
           fmt::format("camera.blades is {}, which enclose no opening. Use 0 for a "
                       "round aperture, or 3 and more",
                       camera.blades));
    }
    if (camera.shutter_opening + camera.shutter_closing > 1 + 1e-9) {
      fail("camera.shutter_opening",
           fmt::format(
               "camera.shutter_opening is {} and camera.shutter_closing is {}, together more "
               "than the whole time; the shutter would close before it is open. Keep the "
               "sum at most 1",
               camera.shutter_opening, camera.shutter_closing));
    }
  }

  void check_group(const std::string& key, const std::string& group) const {
    if (group == "caustics") {
      fail(key,
           "the group of lights \"caustics\" is that of what comes through water; choose another "
           "name");
    }
  }

  void check_environments() const {
    size_t environments = 0;
    for (size_t i = 0; i < shot_.light.size(); ++i) {
      if (shot_.light[i].type != LightType::environment || ++environments == 1) continue;
      fail(fmt::format("light[{}].type", i),
           fmt::format("light \"{}\" is a second environment, and light comes from one sky only. "
                       "Remove one of them",
                       shot_.light[i].name));
    }
  }

  /// What is drawn has one name each for its matte, and what shines one for its group of lights.
  void check_names() const {
    std::map<std::string, std::string> seen{
        {"fluid", "the fluid"}, {"foam", "the foam"}, {"ground", "the ground"}};
    const auto check = [&](const auto& objects, const std::string& section) {
      for (size_t i = 0; i < objects.size(); ++i) {
        const std::string key = fmt::format("{}[{}].name", section, i), &name = objects[i].name;
        const auto [other, is_new] = seen.emplace(name, "a thing of [[" + section + "]]");
        if (!is_new && shot_.layers.cryptomatte) {
          fail(key, fmt::format("\"{}\" is the name of {} already, and both would have one "
                                "Cryptomatte. Give each its own name",
                                name, other->second));
        }
        if (shines(objects[i].material)) check_group(key, name);
      }
    };
    check(shot_.cloth, "cloth");
    check(shot_.obstacle, "obstacle");
  }

  bool shines(const std::string& material) const {
    return std::any_of(shot_.material.begin(), shot_.material.end(), [&](const Material& m) {
      return m.name == material && m.emission != V3f(0);
    });
  }

  void check_light(size_t i) const {
    const Light& light = shot_.light[i];
    const std::string path = fmt::format("light[{}]", i);
    check_group(path + (light.group.empty() ? ".name" : ".group"),
                light.group.empty() ? light.name : light.group);
    if (light.type == LightType::rectangle && !(light.u.cross(light.v).length() > 1e-12)) {
      fail(path, fmt::format("{0}.u is {1} and {0}.v is {2}; the light has no area. Give two half "
                             "edges that are not parallel",
                             path, text_of(light.u), text_of(light.v)));
    }
    if (light.type == LightType::sphere || light.type == LightType::disk) {
      check_positive(path + ".radius", light.radius, " m", "the light has no area");
    }
    if (light.type == LightType::sun)
      check_positive(path + ".angle_deg", light.angle_deg, " degrees", "the sun has no disc");
    if (light.type == LightType::sun || light.type == LightType::disk)
      check_not_zero(path + ".direction", light.direction);
  }

  void check_material(size_t i) const {
    const Material& material = shot_.material[i];
    for (int c = 0; c < 3; ++c) {
      const double sum = double(material.reflectance[c]) + material.transmittance[c];
      if (sum > 1 + 1e-5) {  // float rounding of the two
        fail(fmt::format("material[{}].reflectance", i),
             fmt::format("material \"{}\" reflects {:.4g} and transmits {:.4g} of the {}; together "
                         "more light than arrives. Keep the sum at most 1",
                         material.name, material.reflectance[c], material.transmittance[c],
                         c == 0   ? "red"
                         : c == 1 ? "green"
                                  : "blue"));
      }
    }
    for (int c = 0; c < 3; ++c) {
      const double sum = double(material.sheen[c]) + material.yarn_specular[c];
      if (sum > 1 + 1e-5) {
        fail(fmt::format("material[{}].{}", i,
                         material.yarn_specular[c] > 0 ? "yarn_specular" : "sheen"),
             fmt::format(
                 "material \"{}\" has a sheen of {:.4g} and a yarn_specular of {:.4g} in {}; "
                 "together more light than arrives. Keep the sum at most 1",
                 material.name, material.sheen[c], material.yarn_specular[c],
                 c == 0   ? "red"
                 : c == 1 ? "green"
                          : "blue"));
      }
    }
  }

  void check_use(const std::string& key, const std::string& name, MaterialType refused,
                 std::string_view user, std::string_view advice) const {
    const auto found = std::find_if(shot_.material.begin(), shot_.material.end(),
                                    [&](const Material& m) { return m.name == name; });
    if (found == shot_.material.end()) {
      std::vector<std::string> names;
      for (const Material& material : shot_.material) names.push_back(material.name);
      fail(key, fmt::format("{} is \"{}\", which no [[material]] defines; there are {}. Add one or "
                            "use one of these",
                            key, name, fmt::join(names, ", ")));
    }
    if (found->type == refused) {
      fail(key, fmt::format("{} is \"{}\", a material that {} cannot have. {}", key, name, user,
                            advice));
    }
  }

  void check_material_uses() const {
    check_use("fluid.material", shot_.fluid.material, MaterialType::cloth, "a closed volume",
              "Use type dielectric, diffuse, metal or coated");
    for (size_t i = 0; i < shot_.cloth.size(); ++i) {
      check_use(fmt::format("cloth[{}].material", i), shot_.cloth[i].material,
                MaterialType::dielectric, "an open sheet",
                "Use type cloth, diffuse, metal or coated");
    }
    for (size_t i = 0; i < shot_.obstacle.size(); ++i) {
      if (shot_.obstacle[i].type != ObstacleType::plane) continue;
      check_use(fmt::format("obstacle[{}].material", i), shot_.obstacle[i].material,
                MaterialType::dielectric, "a plane",
                "Use type diffuse, metal or coated, or an obstacle of type box");
    }
    check_use("ground.material", shot_.ground.material, MaterialType::dielectric, "the ground",
              "Use type diffuse, metal or coated");
    for (const Material& m : shot_.material)
      if (m.name == shot_.ground.material && m.gap > 0)
        fail("ground.material",
             fmt::format("ground.material is \"{}\", which has a gap of {}, but there is nothing "
                         "below the ground. Use a material without, or a sheet of cloth",
                         m.name, m.gap));
    check_catchers();
    check_dark("fluid.material", shot_.fluid.material, "the fluid");
    check_dark("ground.material", shot_.ground.material, "the ground");
    for (size_t i = 0; i < shot_.cloth.size(); ++i)
      check_dark(fmt::format("cloth[{}].material", i), shot_.cloth[i].material, "cloth");
  }

  void check_catchers() const {
    for (size_t i = 0; i < shot_.obstacle.size(); ++i) {
      if (shot_.obstacle[i].matte != Matte::shadow_catcher) continue;
      check_use(fmt::format("obstacle[{}].material", i), shot_.obstacle[i].material,
                MaterialType::dielectric, "a shadow catcher",
                "Use type diffuse, metal or coated, the colour of what the plate shows there");
    }
  }

  void check_dark(const std::string& key, const std::string& name, std::string_view user) const {
    for (const Material& m : shot_.material)
      if (m.name == name && m.emission != V3f(0))
        fail(key, fmt::format("{} is \"{}\", which has an emission, but {} does not shine. Use a "
                              "material without, or an obstacle",
                              key, name, user));
  }
};

}  // namespace

void check_picture(const Shot& shot, const ShotSources& sources) {
  PictureChecker(shot, sources).check();
}

}  // namespace drench
