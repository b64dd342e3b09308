#pragma once
// OpenColorIO, if the build has it: ocio_view.cpp, else ocio_absent.cpp.

#include <memory>
#include <string>
#include <vector>

#include "pipeline/contract/shot/shot.h"

namespace drench::render {

class OcioView {
 public:
  virtual ~OcioView() = default;
  /// Linear ACEScg to the display's code values, 3 floats a pixel, in place.
  virtual void apply(std::vector<float>& rgb) const = 0;
  /// Of the operations and tables, not of the names.
  virtual std::string key() const = 0;
};

/// @throws Error as ViewTransform.
std::shared_ptr<const OcioView> make_ocio_view(const ViewSettings& settings);

}  // namespace drench::render
