#include "tests/bench/record.h"

#include <ctime>
#include <fstream>
#include <stdexcept>

#include "tests/bench/bench.h"

namespace drench::bench {
namespace {

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&now));
  return text;
}

std::string machine() {
  std::string processor = "unknown processor";
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) {
      processor = line.substr(line.find(':') + 2);
      break;
    }
  return processor + ", " + std::to_string(hardware_threads()) + " cores";
}

}  // namespace

Origin origin_now(const Record& record, const std::string& command) {
  return {utc_now(), record.commit, machine(), command};
}

void append_rows(const Record& record, const Origin& origin,
                 const std::vector<nlohmann::ordered_json>& results) {
  std::string text;
  for (const nlohmann::ordered_json& result : results) {
    nlohmann::ordered_json row;
    row["time"] = origin.time;
    row["commit"] = origin.commit;
    row["machine"] = origin.machine;
    row["command"] = origin.command;
    row.update(result);
    text += row.dump() + '\n';
  }
  std::ofstream file(record.file, std::ios::app);
  file << text << std::flush;
  if (!file) throw std::runtime_error(record.file + " cannot be written");
}

bool has_rows(const Record& record, const std::string& command) {
  std::ifstream file(record.file);
  for (std::string line; std::getline(file, line);) {
    const auto row = nlohmann::json::parse(line);
    if (row.at("commit") == record.commit && row.at("command") == command) return true;
  }
  return false;
}

}  // namespace drench::bench
