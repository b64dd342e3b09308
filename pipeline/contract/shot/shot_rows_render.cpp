// Rows of all that only the picture is made of: camera, lights, materials, ground, film.
#include "pipeline/contract/shot/shot_rows.h"

namespace drench::shot_table {

namespace {

std::vector<Parameter> camera_rows() {
  return {
      row<&Camera::position>("camera", "position", "m", coordinate, render, "may be animated"),
      row<&Camera::target>("camera", "target", "m", coordinate, render,
                           "looked at; may be animated"),
      row<&Camera::fov_deg>("camera", "fov_deg", "deg", {0.1, 170}, render,
                            "horizontal field of view; may be animated"),
      row<&Camera::focus_distance>("camera", "focus_distance", "m", {0, 1e6}, render,
                                   "0: the distance to the target; may be animated"),
      row<&Camera::lens_radius>("camera", "lens_radius", "m", {0, 10}, render,
                                "0: a pinhole; may be animated"),
      row<&Camera::blades>("camera", "blades", "", {0, 64}, render,
                           "of the aperture, whose corners lie lens_radius from its middle; 0: "
                           "round"),
      row<&Camera::blade_rotation_deg>("camera", "blade_rotation_deg", "deg", {-360, 360}, render,
                                       "clockwise in the picture; 0: a corner is up"),
      row<&Camera::squeeze>("camera", "squeeze", "", {0.25, 4}, render,
                            "of an anamorphic lens: blur is narrower than high by this factor; "
                            "the field of view is not changed"),
      row<&Camera::up>("camera", "up", "", coordinate, render,
                       "up in the picture; any length but 0"),
      row<&Camera::shutter_open>("camera", "shutter_open", "frame", {-10, 10}, render,
                                 "relative to the frame"),
      row<&Camera::shutter_close>("camera", "shutter_close", "frame", {-10, 10}, render,
                                  "relative to the frame"),
      row<&Camera::shutter_opening>("camera", "shutter_opening", "", fraction, render,
                                    "share of the shutter in which it opens evenly; 0: at once"),
      row<&Camera::shutter_closing>("camera", "shutter_closing", "", fraction, render,
                                    "share in which it closes; 0.5 and 0.5 give a triangle"),
      row<&Camera::rolling_shutter>("camera", "rolling_shutter", "", {0, 100}, render,
                                    "how much later the bottom row is exposed than the top one, "
                                    "in times from shutter_open to shutter_close; 0: all at once"),
      row<&Camera::position>("camera", "interp", "", none, render,
                             "between the keys of every animated value of the camera")
          .interpolation({Interpolation::linear, Interpolation::smooth, Interpolation::step}),
  };
}

std::vector<Parameter> light_rows() {
  return {
      row<&Light::type>("light", "type", "", none, render, "kind of light").needed().identity(),
      row<&Light::name>("light", "name", "", none, render, "light, light2, ... unless given")
          .identity(),
      row<&Light::group>("light", "group", "", none, render,
                         "lights of one group share a layer; none: the light's name"),
      row<&Light::radiance>("light", "radiance", "W/(sr m^2)", {0, 1e9}, render,
                            "colour and strength; of a sun the irradiance facing it, W/m^2; of an "
                            "environment with a map, its factor"),
      row<&Light::center>("light", "center", "m", coordinate, render, "centre")
          .only(LightType::rectangle, LightType::sphere, LightType::disk),
      row<&Light::u>("light", "u", "m", coordinate, render, "half edge; light leaves along u x v")
          .only(LightType::rectangle),
      row<&Light::v>("light", "v", "m", coordinate, render, "half edge").only(LightType::rectangle),
      row<&Light::radius>("light", "radius", "m", {0, 1e4}, render, "radius")
          .only(LightType::sphere, LightType::disk),
      row<&Light::direction>("light", "direction", "", coordinate, render,
                             "the way its light travels")
          .only(LightType::sun, LightType::disk),
      row<&Light::angle_deg>("light", "angle_deg", "deg", {0, 180}, render, "apparent diameter")
          .only(LightType::sun),
      row<&Light::map>("light", "map", "", none, render,
                       "latitude-longitude picture, best EXR or HDR; none: constant")
          .only(LightType::environment),
      row<&Light::rotation_deg>("light", "rotation_deg", "deg", {-36000, 36000}, render, "about Y")
          .only(LightType::environment),
      row<&Light::split_suns>("light", "split_suns", "", none, render,
                              "small bright regions of the map become suns: less noise")
          .only(LightType::environment),
      row<&Light::horizon>("light", "horizon", "", {0, 1000}, render,
                           "sky without a map: radiance at the horizon over that at the zenith")
          .as(Kind::spectrum)
          .only(LightType::environment),
      row<&Light::below>("light", "below", "", {0, 1000}, render,
                         "sky without a map: radiance below the horizon over that at the zenith")
          .as(Kind::spectrum)
          .only(LightType::environment),
  };
}

std::vector<Parameter> material_rows() {
  return {
      row<&Material::name>("material", "name", "", none, render, "built-in ones may be redefined")
          .needed()
          .identity(),
      row<&Material::type>("material", "type", "", none, render, "how light meets it").identity(),
      row<&Material::reflectance>("material", "reflectance", "", fraction, render,
                                  "diffuse reflection, of a coated one under its coat; of metal, "
                                  "of light that faces it")
          .only(MaterialType::cloth, MaterialType::diffuse, MaterialType::metal,
                MaterialType::coated),
      row<&Material::edge>("material", "edge", "", fraction, render,
                           "its colour at 82 degrees over that of Schlick's formula there")
          .only(MaterialType::metal),
      row<&Material::roughness>("material", "roughness", "", fraction, render,
                                "its square is the alpha of GGX facets; below 0.01 smooth")
          .only(MaterialType::dielectric, MaterialType::metal, MaterialType::coated),
      row<&Material::emission>("material", "emission", "W/(sr m^2)", {0, 1e9}, render,
                               "light of its own, of obstacles only, from their outer side")
          .only(MaterialType::diffuse),
      row<&Material::transmittance>("material", "transmittance", "", fraction, render,
                                    "diffuse transmission; with reflectance at most 1")
          .only(MaterialType::cloth),
      row<&Material::sheen>("material", "sheen", "", fraction, render,
                            "of light that fuzz on both faces returns, most along the surface; "
                            "the rest falls on the cloth")
          .only(MaterialType::cloth),
      row<&Material::sheen_roughness>("material", "sheen_roughness", "", {0.1, 1}, render,
                                      "0.1 shines at the very rim, 1 is dusty all over")
          .only(MaterialType::cloth),
      row<&Material::yarn_specular>("material", "yarn_specular", "", fraction, render,
                                    "of light that yarns along u and v mirror, on meshes with "
                                    "uv and the ground; with sheen at most 1")
          .only(MaterialType::cloth),
      row<&Material::yarn_roughness>("material", "yarn_roughness", "", {0.1, 1}, render,
                                     "its square is the slope of the fibres along a yarn: 0.3 "
                                     "is satin, 0.6 wool")
          .only(MaterialType::cloth),
      row<&Material::gap>("material", "gap", "", {0, 0.99}, render,
                          "share of its area that is open between yarns: light goes straight on. "
                          "The other values are those of the rest. Not of the ground")
          .only(MaterialType::cloth),
      row<&Material::film_roughness>("material", "film_roughness", "", {0.05, 1}, render,
                                     "of the water on it where its vertices have wetness; as "
                                     "roughness, 1 follows every thread")
          .only(MaterialType::cloth),
      row<&Material::ior>("material", "ior", "", {1, 4}, render,
                          "index of refraction, of the body, the coat, or what wets the cloth; "
                          "glass and varnish 1.5")
          .only(MaterialType::dielectric, MaterialType::coated, MaterialType::cloth),
      row<&Material::priority>("material", "priority", "", {-100, 100}, render,
                               "where bodies overlap the highest is; of equals, an obstacle")
          .only(MaterialType::dielectric),
      row<&Material::absorption>("material", "absorption", "1/m", {0, 1e6}, render, "in the volume")
          .as(Kind::spectrum)
          .only(MaterialType::dielectric),
      row<&Material::texture>("material", "texture", "", none, render,
                              "EXR, HDR, PNG, JPEG or TIFF that multiplies reflectance")
          .only(MaterialType::cloth, MaterialType::diffuse, MaterialType::metal,
                MaterialType::coated),
      row<&Material::normal_map>("material", "normal_map", "", none, render,
                                 "the same of normals, never converted: x along u, y along v, on "
                                 "meshes with uv and the ground"),
      row<&Material::texture_size>("material", "texture_size", "", {1e-6, 1e6}, render,
                                   "edge that texture and normal_map cover, in uv; on the ground "
                                   "in m"),
      row<&Material::checker>("material", "checker", "", none, render, "built-in checker")
          .only(MaterialType::diffuse, MaterialType::coated),
      row<&Material::checker_size>("material", "checker_size", "m", {1e-6, 1e4}, render,
                                   "edge of one of its squares")
          .only(MaterialType::diffuse, MaterialType::coated),
  };
}

std::vector<Parameter> render_rows() {
  return {
      row<&Ground::present>("ground", "present", "", none, mesh | render,
                            "a horizontal plane that is drawn; true when [ground] is written"),
      row<&Ground::height>("ground", "height", "m", coordinate, mesh | render, "its y"),
      row<&Ground::half_size>("ground", "half_size", "m", {1e-3, 1e6}, render, "half its edge"),
      row<&Ground::center>("ground", "center", "m", coordinate, render, "centre; y is unused"),
      row<&Ground::material>("ground", "material", "", none, render, "name of a [[material]]"),
      row<&Ground::matte>("ground", "matte", "", none, render, matte_text),

      row<&RenderSettings::width>("render", "width", "pixel", {1, 16384}, render, "of a frame"),
      row<&RenderSettings::height>("render", "height", "pixel", {1, 16384}, render, "of a frame"),
      row<&RenderSettings::crop_min>("render", "crop_min", "pixel", {0, 16384}, render,
                                     "first column and row to render, from the top left"),
      row<&RenderSettings::crop_max>("render", "crop_max", "pixel", {0, 16384}, render,
                                     "first column and row beyond; [0, 0]: the whole frame"),
      row<&RenderSettings::samples>(
          "render", "samples", "", {1, 1e6}, render,
          "camera samples a pixel, or with an error the most a pixel gets"),
      row<&RenderSettings::error>(
          "render", "error", "", {0, 1}, render,
          "relative MSE at which a frame is good enough, as its samples tell: mean of error^2 / "
          "(colour^2 + 0.01); 0: every pixel gets all samples"),
      row<&RenderSettings::denoise>("render", "denoise", "", none, render,
                                    "smooths the beauty's noise; what was rendered is noisy.RGB"),
      row<&RenderSettings::denoise_frames>(
          "render", "denoise_frames", "", {0, 3}, denoise,
          "before and after a frame that denoise looks at, too, so that it does not flicker; 0: "
          "each frame alone, and no files of noisy frames"),
      row<&RenderSettings::denoiser>("render", "denoiser", "", none, denoise,
                                     "regression, or oidn: Open Image Denoise, loaded from where "
                                     "LD_LIBRARY_PATH says; it sees "
                                     "each frame alone, and alpha is still denoised by regression"),
      row<&RenderSettings::depth>("render", "depth", "", {1, 256}, render,
                                  "diffuse bounces; specular ones end by chance"),
      row<&RenderSettings::motion_blur>("render", "motion_blur", "", none, render,
                                        "from the stored velocities, over the shutter"),
      row<&RenderSettings::background>(
          "render", "background", "", none, render,
          "what the camera sees where there is nothing: the sky, or clear, alpha 0, for a plate"),
      row<&RenderSettings::refraction_alpha>(
          "render", "refraction_alpha", "", none, render,
          "of smooth water and glass before a clear background or what is matte: opaque, or "
          "transparent, so that a plate shows through, undistorted"),
      row<&RenderSettings::photons>(
          "render", "photons", "", {0, 1000}, render,
          "started for each camera sample, for light of lamps through water; 0: by paths alone"),
      row<&RenderSettings::seed>("render", "seed", "", seeds, render, "of the samples"),
  };
}

std::vector<Parameter> layer_rows() {
  return {
      row<&LayerSettings::albedo>("layers", "albedo", "", none, render,
                                  "albedo.RGB: of what is seen, also through water and glass"),
      row<&LayerSettings::normal>("layers", "normal", "", none, render,
                                  "N.XYZ: of what is met first, in the world's axes"),
      row<&LayerSettings::depth>("layers", "depth", "", none, render,
                                 "depth.Z: m along the view, of the nearest in the pixel; 1e10 "
                                 "where there is nothing"),
      row<&LayerSettings::position>("layers", "position", "", none, render,
                                    "P.XYZ: m in the world, of the nearest in the pixel"),
      row<&LayerSettings::motion>("layers", "motion", "", none, render,
                                  "motion.XYZ: from this frame to the next, pixels to the right "
                                  "and up and m away, of the nearest in the pixel"),
      row<&LayerSettings::variance>("layers", "variance", "", none, render,
                                    "variance.RGB: of the beauty, as its samples tell"),
      row<&LayerSettings::samples>("layers", "samples", "", none, render,
                                   "samples.Y: camera samples of the pixel"),
      row<&LayerSettings::light_groups>(
          "layers", "light_groups", "", none, render,
          "light_GROUP.RGB: what the lights of a group add to the beauty; light of photons and of "
          "walks is light_caustics"),
      row<&LayerSettings::cryptomatte>("layers", "cryptomatte", "", none, render,
                                       "CryptoObject and CryptoMaterial, of what is met first"),
      row<&LayerSettings::opacity>(
          "layers", "opacity", "", none, render,
          "opacity.RGB: alpha by colour, for what tints a plate: coloured water and shadows"),
  };
}

std::vector<Parameter> view_rows() {
  return {
      row<&ViewSettings::ocio_config>("view", "ocio_config", "", none, no_stage,
                                      "OpenColorIO's config; with a display or view alone $OCIO"),
      row<&ViewSettings::display>("view", "display", "", none, no_stage,
                                  "of the config; its default if empty")
          .as(Kind::label),
      row<&ViewSettings::view>("view", "view", "", none, no_stage,
                               "of the display; its default if empty")
          .as(Kind::label),
  };
}

}  // namespace

std::vector<Parameter> picture_rows() {
  std::vector<Parameter> all;
  for (const auto& part :
       {camera_rows(), light_rows(), material_rows(), render_rows(), layer_rows(), view_rows()})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

const std::vector<Material>& built_in_materials() {
  static const std::vector<Material> materials = [] {
    Material water, cotton, ground;
    water.name = "water";
    water.type = MaterialType::dielectric;
    // Pure water, Pope and Fry 1997, at about 600, 540 and 450 nm: red goes first.
    water.absorption = {0.22f, 0.047f, 0.0092f};
    cotton.name = "cotton";
    cotton.type = MaterialType::cloth;
    cotton.reflectance = {0.55f, 0.53f, 0.50f};
    cotton.transmittance = {0.20f, 0.19f, 0.17f};
    ground.name = "ground";
    ground.reflectance = {0.35f, 0.35f, 0.35f};
    return std::vector<Material>{water, cotton, ground};
  }();
  return materials;
}

}  // namespace drench::shot_table
