#include "pipeline/contract/error.h"
#include "render/display/ocio_view.h"

namespace drench::render {

std::shared_ptr<const OcioView> make_ocio_view(const ViewSettings&) {
  throw Error(
      "[view]: this build has no OpenColorIO; install libopencolorio-dev and build again (with "
      "DRENCH_OCIO on), or leave the section out for the built-in view transform");
}

}  // namespace drench::render
