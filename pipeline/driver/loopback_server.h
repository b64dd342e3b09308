#pragma once
// A page that a browser on this machine opens, and nobody else.

#include <functional>
#include <map>
#include <optional>
#include <string>

namespace drench {

struct PageRequest {
  std::string path;  // "/", "/scene.json"
  std::multimap<std::string, std::string> parameters;

  /// A whole number; none if it is not there or is no number.
  std::optional<long> number(const std::string& name) const;
};

struct PageAnswer {
  std::string body, type;  // MIME
  int status = 200;
  bool changes = true;  // false: the same address gives the same bytes for ever
};

/// 404, with the reason as text.
PageAnswer nothing_there(const std::string& why);

/// Prints the page's address and answers on loopback until the program is asked to stop. Whoever
/// does not know the address's token gets nothing, nor does another's page in the browser. What
/// throws Error is answered by its message.
/// @param port    0: any that is free. @throws Error if it is taken
/// @param answer  called from several threads at once
void serve_page(int port, const std::function<PageAnswer(const PageRequest&)>& answer);

}  // namespace drench
