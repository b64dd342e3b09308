#include "pipeline/driver/movie.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>

#include "pipeline/contract/error.h"
#include "pipeline/driver/mp4_check.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

/// A child process: what it reads comes from us, what it says goes to a temporary file.
class Child {
 public:
  explicit Child(const std::vector<std::string>& command);
  ~Child() {
    close_input();
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    (void)::waitpid(pid_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// @return false if the child no longer reads.
  bool send(const uint8_t* data, size_t size);
  /// Closes its input and waits. @return its exit status, or 128 + signal.
  int finish();
  /// The end of what it printed.
  std::string last_words();

 private:
  void close_input() {
    if (input_ >= 0) ::close(input_);
    input_ = -1;
  }

  pid_t pid_ = -1;
  int input_ = -1;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> output_;
};

/// In the new process: only calls that are safe between fork and exec of a threaded program.
[[noreturn]] void become(char* const* arguments, int input, int output, pid_t parent) {
  // It must not outlive us: after a kill it would go on writing where the next run works.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);
  ::setpgid(0, 0);  // Ctrl-C is for us; we end it when we stop
  ::dup2(input, STDIN_FILENO);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(output, STDERR_FILENO);
  ::execv(arguments[0], arguments);
  ::_exit(127);
}

Child::Child(const std::vector<std::string>& command) : output_(std::tmpfile(), std::fclose) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const pid_t parent = ::getpid();
  std::array<int, 2> pipe{-1, -1};
  if (output_ && ::pipe2(pipe.data(), O_CLOEXEC) == 0) pid_ = ::fork();
  if (pid_ == 0) become(arguments.data(), pipe[0], ::fileno(output_.get()), parent);
  const int reason = errno;
  if (pipe[0] >= 0) ::close(pipe[0]);
  input_ = pipe[1];
  if (pid_ > 0) return;
  close_input();
  throw Error(fmt::format("{}: cannot be started: {}", command.front(), system_reason(reason)));
}

bool Child::send(const uint8_t* data, size_t size) {
  while (size > 0) {
    const ssize_t done = ::write(input_, data, size);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;  // EPIPE: it has ended; finish() says how
    data += done;
    size -= size_t(done);
  }
  return true;
}

int Child::finish() {
  close_input();
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0) {
    if (errno != EINTR) return 127;
  }
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string Child::last_words() {
  std::fseek(output_.get(), 0, SEEK_END);
  const long size = std::ftell(output_.get());
  std::fseek(output_.get(), std::max(0L, size - 400), SEEK_SET);
  std::string text(400, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), output_.get()));
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const size_t line = text.rfind('\n');
  return line == std::string::npos ? text : text.substr(line + 1);
}

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
  Child child(encode_command(*ffmpeg, file, width, height, fps, codec));
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
    return fmt::format("ffmpeg ended with status {}: {}", status, child.last_words());
  const std::string fault = why_not_whole_mp4(file, images.size());
  if (fault.empty()) return {};
  return fmt::format("what ffmpeg wrote is not whole: {}; is the disk full? {}", fault,
                     child.last_words());
}

}  // namespace

std::optional<fs::path> find_ffmpeg() {
  const char* path = std::getenv("PATH");
  std::string_view rest = path ? path : "";
  while (!rest.empty()) {
    const size_t colon = rest.find(':');
    const std::string_view folder = rest.substr(0, colon);
    rest = colon == std::string_view::npos ? "" : rest.substr(colon + 1);
    if (folder.empty()) continue;
    const fs::path file = fs::path(folder) / "ffmpeg";
    if (::access(file.c_str(), X_OK) == 0 && fs::is_regular_file(file)) return file;
  }
  return {};
}

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
