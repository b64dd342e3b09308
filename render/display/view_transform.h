#pragma once
// How a film is shown: 8-bit sRGB for PNGs and movies.

#include <memory>
#include <string>

#include "pipeline/contract/shot/shot.h"
#include "render/film/film.h"

namespace drench::render {

/// OpenColorIO's transform from linear ACEScg to a display.
class OcioView;

/// The built-in view of linear ACEScg on an sRGB display, or one of an OpenColorIO config.
class ViewTransform {
 public:
  ViewTransform() = default;  // the built-in one
  /// @param settings  without any name and config the built-in one
  /// @throws Error if this build has no OpenColorIO, the config cannot be read or knows no ACEScg,
  ///         or has no such display or view.
  explicit ViewTransform(const ViewSettings& settings);

  /// 3 x width x height, row-major from the top left. Premultiplied colours are shown over black.
  std::vector<uint8_t> operator()(const Film& film) const;
  /// What tells this transform from any other, with all the files it comes from; empty: built-in.
  std::string key() const;

 private:
  std::shared_ptr<const OcioView> ocio_;
};

}  // namespace drench::render
