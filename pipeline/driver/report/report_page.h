#pragma once
// One HTML page that says all that is known of a run, with its frames, and loads nothing.

#include <string>
#include <vector>

#include "pipeline/driver/report/report_data.h"

namespace drench {

/// A frame as it stands in the page, small and large: "data:image/jpeg;base64,...", or where the
/// page finds it.
struct PageImage {
  int frame = 0;
  std::string small, large;
  std::string other;  // of the run that it is compared with; empty: none
  bool in_work = false;
};

struct PageImages {
  std::vector<PageImage> images;
  double scale = 1;      // of the large ones, to the frames' own size
  std::string movie;     // URL; empty: none
  std::string compared;  // the folder of the other run; empty: none
  std::string state;     // what changes when the page would; empty: it stays as it is
};

std::string report_page(const ReportData& data, const PageImages& images);

}  // namespace drench
