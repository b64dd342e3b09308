// `drench report --watch`: the report of a run that goes on, in a browser.
#include <fmt/format.h>

#include <algorithm>

#include "pipeline/contract/error.h"
#include "pipeline/driver/commands.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/loopback_server.h"
#include "pipeline/driver/report/frame_jpeg.h"
#include "pipeline/driver/report/report_page.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

uint64_t size_of(const fs::path& file) {
  std::error_code code;
  const uint64_t size = fs::file_size(file, code);
  return code ? 0 : size;
}

/// When a file was written; 0: it is not there.
int64_t time_of(const fs::path& file) {
  std::error_code code;
  const fs::file_time_type time = fs::last_write_time(file, code);
  return code ? 0 : int64_t(fs::file_time_type::clock::to_sys(time).time_since_epoch().count());
}

std::string bytes_of(const fs::path& file, uint64_t most) {
  const std::vector<std::byte> bytes = read_file(file, most);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Address of a rendered frame; the digest makes it another when the frame is made again.
std::string frame_url(std::string_view run, const ReportData& data, int frame,
                      std::string_view size) {
  const auto record = data.files.find(layout::image(data.job.targets.shot, frame));
  const std::string digest = record == data.files.end() ? "" : record->second.digest.hex();
  return fmt::format("{}?frame={}&size={}&v={}", run, frame, size, digest.substr(0, 16));
}

class WatchedRun {
 public:
  WatchedRun(fs::path folder, fs::path compared)
      : folder_(std::move(folder)), compared_(std::move(compared)) {
    read_report_data(folder_);  // what cannot be read is said at once
    if (!compared_.empty()) read_report_data(compared_);
  }

  PageAnswer answer(const PageRequest& request) const {
    if (request.path == "/") return page();
    if (request.path == "/state") return {.body = state(), .type = "text/plain"};
    const Job job = job_in(folder_);
    if (request.path == "/movie")
      return {.body = bytes_of(folder_ / layout::movie(job.targets.shot), largest_movie),
              .type = "video/mp4",
              .changes = false};
    const std::optional<long> frame = request.number("frame");
    const std::vector<int>& frames = job.targets.frames;
    if (!frame || !std::binary_search(frames.begin(), frames.end(), int(*frame)))
      return nothing_there("no such frame");
    if (request.path == "/refining")
      return {.body = bytes_of(folder_ / layout::refining(job.targets.shot, int(*frame)),
                               largest_picture),
              .type = "image/png",
              .changes = false};
    if (request.path == "/frame") return picture(job, request, int(*frame));
    if (request.path == "/compared" && !compared_.empty())
      return picture(job_in(compared_), request, int(*frame));
    return nothing_there("no such thing");
  }

 private:
  static constexpr uint64_t largest_movie = uint64_t(1) << 30, largest_picture = 1 << 28;  // bytes

  /// Changes whenever the page would.
  std::string state() const {
    std::string text =
        fmt::format("{} {}", size_of(folder_ / layout::manifest), size_of(folder_ / layout::stats));
    int64_t newest = 0;
    std::error_code code;
    for (fs::directory_iterator entry(folder_ / "render", code), end; !code && entry != end;
         entry.increment(code))
      if (layout::is_in_work(entry->path().string()))
        newest = std::max(newest, time_of(entry->path()));
    return text + fmt::format(" {}", newest);
  }

  static PageAnswer picture(const Job& job, const PageRequest& request, int frame) {
    const FrameReader reader(job);
    if (!reader.has(frame)) return nothing_there("the frame is not there any more");
    const render::Film film = reader.read(frame);
    const auto size = request.parameters.find("size");
    const bool small = size != request.parameters.end() && size->second == "small";
    const std::vector<uint8_t> bytes = reader.jpeg(film, small ? small_scale(film) : 1);
    return {.body = {bytes.begin(), bytes.end()}, .type = "image/jpeg", .changes = false};
  }

  /// A rendered frame, or the picture of one in work; none: neither is there.
  std::optional<PageImage> image_of(const ReportData& data, int frame) const {
    if (data.is_rendered(frame))
      return PageImage{.frame = frame,
                       .small = frame_url("frame", data, frame, "small"),
                       .large = frame_url("frame", data, frame, "whole"),
                       .other = {}};
    const int64_t time = time_of(folder_ / layout::refining(data.job.targets.shot, frame));
    if (time == 0) return {};
    const std::string url = fmt::format("refining?frame={}&v={}", frame, time);
    return PageImage{.frame = frame, .small = url, .large = url, .other = {}, .in_work = true};
  }

  PageAnswer page() const {
    PageImages images;
    images.state = state();  // before what it tells of is read
    const ReportData data = read_report_data(folder_);
    std::optional<ReportData> other;
    if (!compared_.empty()) other = read_report_data(compared_);
    for (const int frame : data.job.targets.frames) {
      std::optional<PageImage> image = image_of(data, frame);
      if (!image) continue;
      if (other && other->is_rendered(frame))
        image->other = frame_url("compared", *other, frame, "whole");
      images.images.push_back(std::move(*image));
    }
    if (other) images.compared = compared_.string();
    if (!data.movie.empty()) images.movie = fmt::format("movie?v={}", time_of(data.movie));
    return {.body = report_page(data, images), .type = "text/html; charset=utf-8"};
  }

  const fs::path folder_, compared_;
};

}  // namespace

void watch_command(const fs::path& folder, const fs::path& compared, int port) {
  const WatchedRun run(folder, compared);
  serve_page(port, [&](const PageRequest& request) { return run.answer(request); });
}

}  // namespace drench
