#pragma once
// What ./bench --record keeps: rows of JSON, one a result, in a file that only grows
// (docs/benchmarks/results.jsonl), from which tests/bench/pages.py makes the pages.

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace drench::bench {

/// A file of rows, and the state of the code that the rows of this run are of.
struct Record {
  std::string file;    // appended to; empty: nothing is kept
  std::string commit;  // short hash of the last commit to the code, + behind it if that changed
};

/// What has run where and when: a row's keys besides those of its result. All rows of one run of a
/// case have the same.
struct Origin {
  std::string time;  // UTC, ISO 8601, at the start of the case
  std::string commit;
  std::string machine;  // processor and cores
  std::string command;  // that repeats it
};
Origin origin_now(const Record& record, const std::string& command);

/// Appends the rows of one run of a case, all at once: a run that is killed leaves none.
/// @throws std::runtime_error if the file cannot be written.
void append_rows(const Record& record, const Origin& origin,
                 const std::vector<nlohmann::ordered_json>& results);

/// Whether the file has rows of this commit by this command.
bool has_rows(const Record& record, const std::string& command);

}  // namespace drench::bench
