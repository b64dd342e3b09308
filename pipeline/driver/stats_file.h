#pragma once
// OUT/stats.jsonl: one JSON object for each step that ran, with times, and for each warning of a
// run; nothing is decided by it.

#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>

namespace drench {

class StatsFile {
 public:
  explicit StatsFile(std::filesystem::path file) : file_(std::move(file)) {}
  /// @param json  an object whose members are added to the line.
  /// @throws Error if the line cannot be written.
  void add(std::string_view step, const std::string& json);
  void add(std::string_view step, int frame, double wall_s, const std::string& json);

 private:
  const std::filesystem::path file_;
  std::mutex mutex_;
};

}  // namespace drench
