// `drench view`: plays what an output folder holds, in a browser.
#include <fmt/format.h>

#include <algorithm>
#include <list>
#include <memory>
#include <mutex>

#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/files/particles_file.h"
#include "pipeline/driver/commands.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/loopback_server.h"
#include "pipeline/driver/viewer/view_data.h"
#include "pipeline/driver/viewer/view_page.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

constexpr size_t most_particles = 4'000'000;  // sent at once

/// Answers the page, the scene and the frames of an output folder. Files are named by frame and
/// sheet, never by a path.
class ViewedFolder {
 public:
  explicit ViewedFolder(const fs::path& folder) : job_(job_in(folder)) {}

  PageAnswer answer(const PageRequest& request) {
    if (request.path == "/") return {.body = view_page(), .type = "text/html; charset=utf-8"};
    if (request.path == "/scene.json")
      return {.body = view_scene(job_, Manifest(job_.folder / layout::manifest)),
              .type = "application/json"};
    const std::optional<long> frame = request.number("frame");
    if (!frame || !has(*frame)) return nothing_there("no such frame");
    if (request.path == "/particles") return particles(request, int(*frame));
    if (request.path == "/fluid")
      return kept(fmt::format("fluid {}", *frame), [&] {
        return view_mesh(read_mesh(job_.folder / layout::fluid_mesh(int(*frame))), ViewMesh::fluid);
      });
    if (request.path == "/cloth") return cloth(request, int(*frame));
    return nothing_there("no such thing");
  }

 private:
  bool has(long frame) const {
    return std::binary_search(job_.targets.frames.begin(), job_.targets.frames.end(), int(frame));
  }

  PageAnswer particles(const PageRequest& request, int frame) {
    const long asked = request.number("most").value_or(0);
    const size_t most = size_t(std::clamp<long>(asked, 1, long(most_particles)));
    return kept(fmt::format("particles {} {}", frame, most), [&] {
      return view_particles(read_particles(job_.folder / layout::particles(frame)), most);
    });
  }

  PageAnswer cloth(const PageRequest& request, int frame) {
    const std::optional<long> sheet = request.number("sheet");
    if (!sheet || *sheet < 0 || size_t(*sheet) >= job_.targets.cloth.size())
      return nothing_there("no such sheet");
    return kept(fmt::format("cloth {} {}", *sheet, frame), [&] {
      const std::string& name = job_.targets.cloth[size_t(*sheet)];
      return view_mesh(read_mesh(job_.folder / layout::cloth(name, frame)), ViewMesh::sheet);
    });
  }

  /// What is sent of a frame; the last few are kept.
  template <class Make>
  PageAnswer kept(const std::string& key, const Make& make) {
    constexpr const char* type = "application/octet-stream";
    {
      const std::scoped_lock lock(mutex_);
      for (const auto& [name, bytes] : kept_)
        if (name == key) return {.body = *bytes, .type = type};
    }
    const auto bytes = std::make_shared<const std::string>(make());
    const std::scoped_lock lock(mutex_);
    kept_.emplace_back(key, bytes);
    constexpr size_t most_kept = 12;
    if (kept_.size() > most_kept) kept_.pop_front();
    return {.body = *bytes, .type = type};
  }

  const Job job_;
  std::mutex mutex_;
  std::list<std::pair<std::string, std::shared_ptr<const std::string>>> kept_;
};

}  // namespace

void view_command(const fs::path& folder, int port) {
  ViewedFolder viewed(folder);
  serve_page(port, [&](const PageRequest& request) { return viewed.answer(request); });
}

}  // namespace drench
