#include "tests/driver/tiny_shot.h"

#include <fmt/format.h>

#include "pipeline/driver/layout.h"
#include "pipeline/driver/manifest.h"

namespace drench::test {

TinyShot::TinyShot(int frames) {
  put_text(file(), fmt::format(R"(
[shot]
frames = [1001, {}]
[domain]
min = [-0.2, 0, -0.2]
max = [0.2, 0.4, 0.2]
[fluid]
spacing = 0.03
[[fluid.sphere]]
center = [0, 0.3, 0]
radius = 0.08
[[cloth]]
name = "flag"
corner = [-0.15, 0.15, -0.15]
u = [0.3, 0, 0]
v = [0, 0, 0.3]
cells = [6, 6]
pins = "corners"
[[probe]]
type = "force"
name = "flag"
target = "flag"
[[probe]]
type = "height"
name = "gauge"
[surface]
smoothing = 2
[camera]
position = [0, 0.4, 0.9]
target = [0, 0.15, 0]
[[light]]
type = "environment"
radiance = [1, 1, 1]
[ground]
present = true
[render]
width = 32
height = 18
samples = 1
depth = 2
)",
                               1000 + frames));
}

std::vector<std::string> TinyShot::words(const std::string& command,
                                         const std::vector<std::string>& more) const {
  std::vector<std::string> words{command, file().string(), "--out", out().string()};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

Ended TinyShot::run(const std::string& command, const std::vector<std::string>& more) const {
  return run_program(DRENCH_PROGRAM, words(command, more), folder());
}

Ended TinyShot::run_with_fault(const std::string& fault) const {
  return run_program(DRENCH_FAULT_PROGRAM, words("run"), folder(), {"DRENCH_FAULT=" + fault});
}

std::map<std::string, std::string> TinyShot::digests() const {
  std::map<std::string, std::string> digests;
  for (const auto& [file, record] : Manifest(out() / layout::manifest).records()) {
    const bool there = std::filesystem::exists(out() / file);
    digests[file] = there ? hash_file(out() / file).hex() : "missing";
  }
  return digests;
}

std::string with_every_kind_of_file(std::string shot) {
  const std::string samples = "samples = 1\n";
  shot.replace(shot.find(samples), samples.size(), "samples = 16\n");  // the denoiser's least
  return shot + "denoise = true\ndenoise_frames = 1\n[foam]\n";
}

const std::map<std::string, std::string>& undisturbed_digests(int frames) {
  static std::map<int, std::map<std::string, std::string>> made;
  if (!made.contains(frames)) {
    const TinyShot shot(frames);
    const Ended ended = shot.run("run");
    EXPECT_EQ(ended.code, 0) << ended.err;
    made[frames] = shot.digests();
  }
  return made[frames];
}

}  // namespace drench::test
