#include "pipeline/driver/loopback_server.h"

#include <fmt/format.h>
#include <httplib.h>

#include <charconv>
#include <chrono>
#include <random>
#include <thread>

#include "pipeline/contract/error.h"
#include "pipeline/driver/process.h"
#include "pipeline/driver/standard_output.h"

namespace drench {

namespace {

constexpr const char* loopback = "127.0.0.1";

/// 128 bits that nobody guesses.
std::string make_token() {
  std::random_device random;
  std::string token;
  for (int k = 0; k < 4; ++k) token += fmt::format("{:08x}", random());
  return token;
}

/// Takes as long for any wrong text of a length.
bool is_equal(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned char different = 0;
  for (size_t k = 0; k < a.size(); ++k) different |= static_cast<unsigned char>(a[k] ^ b[k]);
  return different == 0;
}

/// Whether the request is one of the page: names no other host, as a page of another would have a
/// browser ask, and knows the token.
bool is_ours(const httplib::Request& request, int port, const std::string& token) {
  const std::string host = request.get_header_value("Host");
  const bool here =
      host == fmt::format("{}:{}", loopback, port) || host == fmt::format("localhost:{}", port);
  return here && request.path.size() > token.size() && request.path[0] == '/' &&
         is_equal(request.path.substr(1, token.size()), token);
}

PageAnswer answer_to(const httplib::Request& request, int port, const std::string& token,
                     const std::function<PageAnswer(const PageRequest&)>& answer) {
  if (!is_ours(request, port, token))
    return {.body = "give the address that drench printed", .type = "text/plain", .status = 403};
  try {
    return answer({request.path.substr(1 + token.size()), request.params});
  } catch (const Error& error) {  // not there yet, or not any more
    return nothing_there(error.what());
  }
}

int bind(httplib::Server& server, int port) {
  // As the library has it two programs would share a port, and each get half of the other's
  // requests.
  server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  const int bound = port == 0                             ? server.bind_to_any_port(loopback)
                    : server.bind_to_port(loopback, port) ? port
                                                          : 0;
  if (bound <= 0)
    throw Error(
        fmt::format("port {} of {} is taken; give another --port, or none", port, loopback));
  return bound;
}

}  // namespace

std::optional<long> PageRequest::number(const std::string& name) const {
  const auto found = parameters.find(name);
  if (found == parameters.end()) return {};
  const std::string& text = found->second;
  long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

PageAnswer nothing_there(const std::string& why) {
  return {.body = why, .type = "text/plain", .status = 404};
}

void serve_page(int port, const std::function<PageAnswer(const PageRequest&)>& answer) {
  httplib::Server server;
  const int bound = bind(server, port);
  const std::string token = make_token();
  // Headers of every answer: nobody else may frame the page or learn the token from it.
  server.set_default_headers(
      {{"Referrer-Policy", "no-referrer"},
       {"X-Content-Type-Options", "nosniff"},
       {"X-Frame-Options", "DENY"},
       {"Cross-Origin-Resource-Policy", "same-origin"},
       {"Content-Security-Policy",
        "default-src 'none'; connect-src 'self'; img-src 'self' data:; media-src "
        "'self'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"}});
  server.Get(".*", [&](const httplib::Request& request, httplib::Response& response) {
    PageAnswer given = answer_to(request, bound, token, answer);
    response.status = given.status;
    response.set_header("Cache-Control",
                        given.changes ? "no-store" : "private, max-age=31536000, immutable");
    response.set_content(std::move(given.body), given.type);
  });
  server.set_exception_handler(
      [](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
        response.status = 500;
        response.set_content("a fault of drench", "text/plain");
      });
  print(fmt::format("http://{}:{}/{}/\n", loopback, bound, token));
  const GracefulStop graceful;
  std::thread listener([&server] { server.listen_after_bind(); });
  while (!stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  server.stop();
  listener.join();
}

}  // namespace drench
