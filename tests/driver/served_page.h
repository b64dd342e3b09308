#pragma once
// A command that answers a page on loopback, and a client of it.

#include <httplib.h>

#include <chrono>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/driver/child.h"
#include "tests/driver/folder.h"

namespace drench::test {

class ServedPage {
 public:
  /// @param words   of drench; it prints the address first
  /// @param folder  where it may write
  ServedPage(std::vector<std::string> words, const std::filesystem::path& folder) {
    const std::string url_file = folder / "url";
    std::vector<std::string> all{"-c", "file=$1; shift; exec \"$0\" \"$@\" > \"$file\"",
                                 DRENCH_PROGRAM, url_file};
    all.insert(all.end(), words.begin(), words.end());
    program = std::make_unique<Child>("/bin/sh", all, folder);
    for (int k = 0; k < 300 && text_of(url_file).find('\n') == std::string::npos; ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    url = text_of(url_file);
    if (!url.empty()) url.pop_back();
    const size_t port = url.rfind(':') + 1, slash = url.find('/', port);
    if (slash == std::string::npos) throw std::runtime_error("no page: " + program->err_so_far());
    client = std::make_unique<httplib::Client>("127.0.0.1", std::stoi(url.substr(port)));
    root = url.substr(slash);
  }

  int status(const std::string& path, const httplib::Headers& headers = {}) const {
    const httplib::Result answer = client->Get(path, headers);
    return answer ? answer->status : 0;
  }
  std::string body(const std::string& path) const { return client->Get(path)->body; }

  std::unique_ptr<Child> program;
  std::unique_ptr<httplib::Client> client;
  std::string url, root;  // "/TOKEN/"
};

}  // namespace drench::test
