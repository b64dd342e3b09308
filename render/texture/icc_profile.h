#pragma once
// ICC profiles that pictures carry: those of a matrix and curves, which is what cameras and paint
// programs write for RGB and grey.

#include <optional>
#include <span>
#include <string>

#include "render/texture/picture.h"

namespace drench::render {

/// Method: ICC.1:2022 (profile version 4.4), clauses 7 (header, tags), 8.3.3 (three-component
/// matrix-based profiles), 10.6 (curveType) and 10.18 (parametricCurveType); annex F.
class IccProfile {
 public:
  /// @param bytes  a whole profile; any bytes are safe.
  explicit IccProfile(std::span<const unsigned char> bytes);

  /// Its curves and primaries; none if it is not of this kind. One that is sRGB to the eye's
  /// precision gives ColourCode::srgb().
  const std::optional<ColourCode>& code() const { return code_; }
  const std::string& name() const { return name_; }        // its description, in ASCII
  const std::string& why_not() const { return why_not_; }  // why there is no code

 private:
  std::string name_ = "without a name", why_not_;
  std::optional<ColourCode> code_;
};

}  // namespace drench::render
