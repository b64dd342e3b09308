#include "pipeline/driver/viewer/view_server.h"

#include <fmt/format.h>
#include <httplib.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <list>
#include <mutex>
#include <optional>
#include <random>
#include <thread>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/files/particles_file.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/viewer/view_data.h"
#include "pipeline/driver/viewer/view_page.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

constexpr size_t most_particles = 4'000'000;  // sent at once
constexpr const char* binary = "application/octet-stream";

/// 128 bits that nobody guesses.
std::string make_token() {
  std::random_device random;
  std::string token;
  for (int k = 0; k < 4; ++k) token += fmt::format("{:08x}", random());
  return token;
}

std::optional<long> whole_number(const std::string& text) {
  long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

/// Takes as long for any wrong text of a length.
bool is_equal(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned char different = 0;
  for (size_t k = 0; k < a.size(); ++k) different |= static_cast<unsigned char>(a[k] ^ b[k]);
  return different == 0;
}

}  // namespace

struct ViewServer::Implementation {
  using Request = httplib::Request;
  using Response = httplib::Response;

  explicit Implementation(const fs::path& folder) : job(job_in(folder)) {}

  /// Whether the request is one of the page: names no other host, as a page of another would have
  /// a browser ask, and knows the token.
  bool is_ours(const Request& request) const {
    const std::string host = request.get_header_value("Host");
    const bool here =
        host == fmt::format("127.0.0.1:{}", port) || host == fmt::format("localhost:{}", port);
    return here && request.path.size() > token.size() && request.path[0] == '/' &&
           is_equal(request.path.substr(1, token.size()), token);
  }

  /// What is sent of a frame; the last few are kept.
  template <class Make>
  void send(Response& response, const std::string& key, const Make& make) {
    {
      const std::scoped_lock lock(mutex);
      for (const auto& [name, bytes] : kept)
        if (name == key) return response.set_content(*bytes, binary);
    }
    std::shared_ptr<const std::string> bytes;
    try {
      bytes = std::make_shared<const std::string>(make());
    } catch (const Error& error) {  // not there yet, or not any more
      response.status = 404;
      return response.set_content(error.what(), "text/plain");
    }
    response.set_content(*bytes, binary);
    const std::scoped_lock lock(mutex);
    kept.emplace_back(key, std::move(bytes));
    constexpr size_t most_kept = 12;
    if (kept.size() > most_kept) kept.pop_front();
  }

  bool has(long frame) const {
    return std::binary_search(job.targets.frames.begin(), job.targets.frames.end(), int(frame));
  }

  void answer(const Request& request, Response& response) {
    const std::string path = request.path.substr(1 + token.size());
    if (path == "/") return response.set_content(view_page(), "text/html; charset=utf-8");
    if (path == "/scene.json")
      return response.set_content(view_scene(job, Manifest(job.folder / layout::manifest)),
                                  "application/json");
    const std::optional<long> frame = whole_number(request.get_param_value("frame"));
    if (!frame || !has(*frame)) {
      response.status = 404;
      return response.set_content("no such frame", "text/plain");
    }
    if (path == "/particles") return send_particles(request, response, int(*frame));
    if (path == "/fluid")
      return send(response, fmt::format("fluid {}", *frame), [&] {
        return view_mesh(read_mesh(job.folder / layout::fluid_mesh(int(*frame))), ViewMesh::fluid);
      });
    if (path == "/cloth") return send_cloth(request, response, int(*frame));
    response.status = 404;
    response.set_content("no such thing", "text/plain");
  }

  void send_particles(const Request& request, Response& response, int frame) {
    const long asked = whole_number(request.get_param_value("most")).value_or(0);
    const size_t most = size_t(std::clamp<long>(asked, 1, long(most_particles)));
    send(response, fmt::format("particles {} {}", frame, most), [&] {
      return view_particles(read_particles(job.folder / layout::particles(frame)), most);
    });
  }

  void send_cloth(const Request& request, Response& response, int frame) {
    const std::optional<long> sheet = whole_number(request.get_param_value("sheet"));
    if (!sheet || *sheet < 0 || size_t(*sheet) >= job.targets.cloth.size()) {
      response.status = 404;
      return response.set_content("no such sheet", "text/plain");
    }
    send(response, fmt::format("cloth {} {}", *sheet, frame), [&] {
      const std::string& name = job.targets.cloth[size_t(*sheet)];
      return view_mesh(read_mesh(job.folder / layout::cloth(name, frame)), ViewMesh::sheet);
    });
  }

  void set_up() {
    // Headers of every answer: nobody else may frame the page or learn the token from it.
    server.set_default_headers(
        {{"Cache-Control", "no-store"},
         {"Referrer-Policy", "no-referrer"},
         {"X-Content-Type-Options", "nosniff"},
         {"X-Frame-Options", "DENY"},
         {"Cross-Origin-Resource-Policy", "same-origin"},
         {"Content-Security-Policy",
          "default-src 'none'; connect-src 'self'; style-src 'unsafe-inline'; "
          "script-src 'unsafe-inline'"}});
    server.Get(".*", [this](const Request& request, Response& response) {
      if (is_ours(request)) return answer(request, response);
      response.status = 403;
      response.set_content("give the address that drench printed", "text/plain");
    });
    server.set_exception_handler([](const Request&, Response& response, std::exception_ptr) {
      response.status = 500;
      response.set_content("a fault of drench", "text/plain");
    });
  }

  const Job job;
  const std::string token = make_token();
  httplib::Server server;
  int port = 0;
  std::mutex mutex;
  std::list<std::pair<std::string, std::shared_ptr<const std::string>>> kept;
};

ViewServer::ViewServer(const fs::path& folder, int port)
    : implementation_(std::make_unique<Implementation>(folder)) {
  Implementation& it = *implementation_;
  it.set_up();
  constexpr const char* here = "127.0.0.1";
  if (port == 0) {
    it.port = it.server.bind_to_any_port(here);
  } else if (it.server.bind_to_port(here, port)) {
    it.port = port;
  }
  if (it.port <= 0)
    throw Error(fmt::format("port {} of {} is taken; give another --port, or none", port, here));
}

ViewServer::~ViewServer() = default;

std::string ViewServer::address() const {
  return fmt::format("http://127.0.0.1:{}/{}/", implementation_->port, implementation_->token);
}

void ViewServer::run(const std::function<bool()>& keep_going) {
  httplib::Server& server = implementation_->server;
  std::thread listener([&server] { server.listen_after_bind(); });
  while (keep_going()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  server.stop();
  listener.join();
}

}  // namespace drench
