#include "pipeline/driver/movie.h"

#include <fmt/format.h>

#include <string>
#include <string_view>

#include "pipeline/contract/error.h"
#include "pipeline/driver/child_process.h"
#include "pipeline/driver/mp4_check.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

std::vector<std::string> encode_command(const fs::path& ffmpeg, const fs::path& file, int width,
                                        int height, double fps, std::string_view codec) {
  // bitexact and no metadata: no version strings or times; a fixed thread count: the encoder's
  // decisions depend on it.
  constexpr const char* filter =
      "crop=trunc(iw/2)*2:trunc(ih/2)*2:0:0,"
      "scale=out_color_matrix=bt709:out_range=tv:flags=bitexact+accurate_rnd";
  std::vector<std::string> command{ffmpeg.string(),
                                   "-nostdin",
                                   "-xerror",
                                   "-hide_banner",
                                   "-loglevel",
                                   "error",
                                   "-y",
                                   "-f",
                                   "rawvideo",
                                   "-pix_fmt",
                                   "rgb24",
                                   "-s",
                                   fmt::format("{}x{}", width, height),
                                   "-r",
                                   fmt::format("{}", fps),
                                   "-i",
                                   "pipe:0",
                                   "-vf",
                                   filter,
                                   "-colorspace",
                                   "bt709",
                                   "-color_primaries",
                                   "bt709",
                                   "-color_trc",
                                   "bt709",
                                   "-color_range",
                                   "tv",
                                   "-pix_fmt",
                                   "yuv420p",
                                   "-map_metadata",
                                   "-1",
                                   "-fflags",
                                   "+bitexact",
                                   "-flags:v",
                                   "+bitexact",
                                   "-threads",
                                   "2",
                                   "-c:v",
                                   std::string(codec)};
  if (codec == "libx264") {
    command.insert(command.end(), {"-preset", "medium", "-crf", "18"});
  } else {
    command.insert(command.end(), {"-q:v", "3"});
  }
  // "file:": a folder named like one of ffmpeg's protocols ("md5:x") is a folder all the same.
  command.insert(command.end(), {"-movflags", "+faststart", "-f", "mp4", "file:" + file.string()});
  return command;
}

/// @return the error text, empty when the file was written.
std::string encode(const fs::path& file, const std::vector<NumberedImage>& images, double fps,
                   std::string_view codec, const std::function<bool()>& keep_going,
                   const render::ViewTransform& view) {
  const std::optional<fs::path> ffmpeg = find_ffmpeg();
  if (!ffmpeg) throw Error("ffmpeg: not found on PATH; install the package ffmpeg");
  render::Film film = render::read_exr(images.front().file);
  const int width = film.width, height = film.height;
  if (width < 2 || height < 2) {
    throw Error(fmt::format("{}: {} x {} pixels cannot be a movie; render at least 2 x 2",
                            images.front().file.string(), width, height));
  }
  ChildProcess child(encode_command(*ffmpeg, file, width, height, fps, codec));
  for (size_t k = 0; k < images.size(); ++k) {
    if (keep_going && !keep_going()) throw Stopped("stopped while making the movie");
    if (k > 0) film = render::read_exr(images[k].file);
    if (film.width != width || film.height != height) {
      throw Error(
          fmt::format("{}: has {} x {} pixels, the frames before have {} x {}; render all "
                      "frames at one size",
                      images[k].file.string(), film.width, film.height, width, height));
    }
    const std::vector<uint8_t> rgb = view(film);
    if (!child.send(rgb.data(), rgb.size())) break;
  }
  const int status = child.finish();
  if (status != 0)
    return fmt::format("ffmpeg ended with status {}: {}", status, last_line(child.errors()));
  const std::string fault = why_not_whole_mp4(file, images.size());
  if (fault.empty()) return {};
  return fmt::format("what ffmpeg wrote is not whole: {}; is the disk full? {}", fault,
                     last_line(child.errors()));
}

}  // namespace

std::optional<fs::path> find_ffmpeg() { return find_program("ffmpeg"); }

WrittenFile write_movie(const fs::path& path, const std::vector<NumberedImage>& images, double fps,
                        const std::function<bool()>& keep_going,
                        const render::ViewTransform& view) {
  return write_file_whole(path, [&](const fs::path& temporary) {
    const std::string first = encode(temporary, images, fps, "libx264", keep_going, view);
    if (first.empty()) return;
    // Whatever else failed would fail again, or make another movie of the same frames.
    if (first.find("ncoder") == std::string::npos)
      throw Error(fmt::format("{}: the movie was not made: {}", path.string(), first));
    const std::string second = encode(temporary, images, fps, "mpeg4", keep_going, view);
    if (second.empty()) return;
    throw Error(fmt::format("{}: the movie was not made: {}; with mpeg4: {}", path.string(), first,
                            second));
  });
}

}  // namespace drench
