#include "render/display/ocio_view.h"

#include <OpenColorIO/OpenColorIO.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>

#include "pipeline/contract/error.h"
#include "pipeline/contract/hash.h"
#include "render/color/color.h"

namespace drench::render {

namespace {

namespace ocio = OCIO_NAMESPACE;

/// ACES2065-1, which configs name by a role when they do not call ACEScg by its name.
Imf::Chromaticities aces2065_chromaticities() {
  return {{0.7347f, 0.2653f}, {0, 1}, {0.0001f, -0.077f}, {0.32168f, 0.33767f}};
}

std::string config_path(const ViewSettings& settings) {
  if (!settings.ocio_config.empty()) return settings.ocio_config.string();
  const char* set = std::getenv("OCIO");
  if (!set || !*set)
    throw Error(
        "[view] asks for OpenColorIO, but there is no config; give view.ocio_config or set $OCIO "
        "to one, or leave the section out for the built-in view transform");
  return set;
}

/// A name that is asked for, the config's own choice if it is empty.
std::string chosen(const std::string& what, const std::string& asked, const std::string& fallback,
                   const std::vector<std::string>& there, const std::string& path) {
  const std::string name = asked.empty() ? fallback : asked;
  if (std::find(there.begin(), there.end(), name) != there.end()) return name;
  throw Error(fmt::format("{}: there is no {} '{}'; there are: {}. Give view.{} one of these", path,
                          what, name, fmt::join(there, ", "), what));
}

class ConfigView final : public OcioView {
 public:
  explicit ConfigView(const ViewSettings& settings) {
    const std::string path = config_path(settings);
    try {
      make(settings, path);
    } catch (const ocio::Exception& e) {
      throw Error(fmt::format(
          "{}: OpenColorIO cannot use this config: {}; mend it or give view.ocio_config another",
          path, e.what()));
    }
  }

  void apply(std::vector<float>& rgb) const override {
    if (to_aces2065_)
      for (size_t k = 0; k + 2 < rgb.size(); k += 3) {
        const V3f aces = (*to_aces2065_)({rgb[k], rgb[k + 1], rgb[k + 2]});
        for (int c = 0; c < 3; ++c) rgb[k + size_t(c)] = aces[c];
      }
    ocio::PackedImageDesc pixels(rgb.data(), long(rgb.size() / 3), 1, 3);
    cpu_->apply(pixels);
  }

  std::string key() const override { return key_; }

 private:
  void make(const ViewSettings& settings, const std::string& path) {
    // The library would wait for a FIFO's writer, and names no reason for what it cannot open.
    if (!path.starts_with("ocio://")) (void)hash_file(path);
    const ocio::ConstConfigRcPtr config = ocio::Config::CreateFromFile(path.c_str());
    std::string from = "ACEScg";
    if (!config->getColorSpace(from.c_str())) {
      from = ocio::ROLE_INTERCHANGE_SCENE;
      if (!config->getColorSpace(from.c_str()))
        throw Error(fmt::format(
            "{}: the config has no colour space ACEScg and no role {}, so that there is no way "
            "from Drench's colours to a display; add one to it or give view.ocio_config another",
            path, from));
      to_aces2065_.emplace(color_conversion(acescg_chromaticities(), aces2065_chromaticities()));
    }
    std::vector<std::string> displays, views;
    for (int k = 0; k < config->getNumDisplays(); ++k) displays.push_back(config->getDisplay(k));
    const std::string display =
        chosen("display", settings.display, config->getDefaultDisplay(), displays, path);
    for (int k = 0; k < config->getNumViews(display.c_str()); ++k)
      views.push_back(config->getView(display.c_str(), k));
    const std::string view =
        chosen("view", settings.view, config->getDefaultView(display.c_str()), views, path);
    const ocio::DisplayViewTransformRcPtr transform = ocio::DisplayViewTransform::Create();
    transform->setSrc(from.c_str());
    transform->setDisplay(display.c_str());
    transform->setView(view.c_str());
    const ocio::ConstProcessorRcPtr processor = config->getProcessor(transform);
    cpu_ = processor->getDefaultCPUProcessor();
    key_ = fmt::format("{} {} {}", ocio::GetVersion(), from, cpu_->getCacheID());
  }

  std::optional<ColorMatrix> to_aces2065_;
  ocio::ConstCPUProcessorRcPtr cpu_;
  std::string key_;
};

}  // namespace

std::shared_ptr<const OcioView> make_ocio_view(const ViewSettings& settings) {
  return std::make_shared<const ConfigView>(settings);
}

}  // namespace drench::render
