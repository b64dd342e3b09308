#pragma once
// Answers the viewer's page, on loopback alone.

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace drench {

/// Nothing is served but the page, the scene and the frames of one output folder, and nothing to
/// whoever does not know the token. Files are named by frame and sheet, never by a path.
class ViewServer {
 public:
  /// @param port  0: any that is free. @throws Error if it is taken, or the folder holds no run
  ViewServer(const std::filesystem::path& folder, int port);
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  /// "http://127.0.0.1:8123/3f.../"
  std::string address() const;
  /// Answers until keep_going says otherwise, which is asked ten times a second.
  void run(const std::function<bool()>& keep_going);

 private:
  struct Implementation;
  const std::unique_ptr<Implementation> implementation_;
};

}  // namespace drench
