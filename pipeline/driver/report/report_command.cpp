// `drench report`: reads an output folder and writes OUT/report.html.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "pipeline/driver/commands.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/report/frame_jpeg.h"
#include "pipeline/driver/report/jpeg.h"
#include "pipeline/driver/report/report_page.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

constexpr double most_bytes = 96e6;           // of all frames at full size, about
constexpr double bytes_a_pixel = 0.4;         // of a JPEG, about
constexpr uint64_t largest_movie = 48 << 20;  // bytes

PageImages images_of(const ReportData& data, const fs::path& compared) {
  PageImages page;
  const std::vector<int> frames = data.rendered();
  std::optional<ReportData> other;
  if (!compared.empty()) other = read_report_data(compared);
  const RenderSettings& render = data.job.shot.render;
  const double pixels =
      double(render.width) * render.height * double(frames.size()) * (other ? 2 : 1);
  page.scale = std::min(1.0, std::sqrt(most_bytes / std::max(1.0, pixels * bytes_a_pixel)));
  page.images.resize(frames.size());
  const FrameReader reader(data.job);
  const std::optional<FrameReader> other_reader =
      other ? std::optional<FrameReader>(std::in_place, other->job) : std::nullopt;
  const auto url = [](const FrameReader& from, const render::Film& film, double scale) {
    return data_url("image/jpeg", from.jpeg(film, scale));
  };
  tbb::parallel_for(size_t(0), frames.size(), [&](size_t k) {
    const render::Film film = reader.read(frames[k]);
    PageImage& image = page.images[k];
    image.frame = frames[k];
    image.small = url(reader, film, small_scale(film));
    image.large = url(reader, film, page.scale);
    if (other_reader && other_reader->has(frames[k]))
      image.other = url(*other_reader, other_reader->read(frames[k]), page.scale);
  });
  if (other) page.compared = compared.string();
  if (!data.movie.empty() && fs::file_size(data.movie) <= largest_movie) {
    const std::vector<std::byte> bytes = read_file(data.movie, largest_movie);
    const auto* begin = reinterpret_cast<const uint8_t*>(bytes.data());
    page.movie = data_url("video/mp4", {begin, begin + bytes.size()});
  }
  return page;
}

}  // namespace

void report_command(const fs::path& folder, const fs::path& compared) {
  const ReportData data = read_report_data(folder);
  const fs::path file = folder / layout::report;
  write_file_whole(file, report_page(data, images_of(data, compared)));
  log_info("report", fmt::format("wrote {}", file.string()));
}

}  // namespace drench
