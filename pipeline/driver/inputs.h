#pragma once
// Files of an output folder are read only after their digest was checked; one that is damaged, or
// that cannot be read although it is what was recorded, is forgotten and made again.

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "pipeline/driver/plan.h"

namespace drench {

/// A file that should have been there is missing or damaged. Its record is dropped already: plan
/// again.
class DamagedInput : public std::runtime_error {
 public:
  /// @param file  whose record was dropped; empty if none was.
  DamagedInput(const std::string& text, std::string dropped)
      : std::runtime_error(text), file(std::move(dropped)) {}
  std::string file;
};

/// @throws DamagedInput if the file has another digest than recorded, or no record; Error if that
/// cannot be found out (state_by_digest).
void check_input(const std::filesystem::path& folder, Manifest& manifest, const std::string& file);

/// The bytes of a file whose digest is that of its record. @throws as check_input.
std::string checked_bytes(const std::filesystem::path& folder, Manifest& manifest,
                          const std::string& file);

/// For a stage that failed: drops the first of its inputs that cannot be read. Returns if all can.
/// @param why_unreadable  the reason for a path, empty if the file can be read.
/// @throws DamagedInput
void drop_unreadable(
    const std::filesystem::path& folder, Manifest& manifest, const std::vector<InputFile>& files,
    const std::function<std::string(const std::filesystem::path&)>& why_unreadable);

/// Ends what keeps planning again without getting further, which files would do that are damaged
/// whenever they were made, and finds further damage at once instead of file by file.
class Retries {
 public:
  Retries(std::filesystem::path folder, Manifest& manifest)
      : folder_(std::move(folder)), manifest_(manifest) {}

  /// Takes note of what was found. @throws Error when the same was found too often.
  void count(const DamagedInput& found);
  /// After the first find: hashes what the plan reads and was not hashed yet, and drops the records
  /// of what is damaged. @return whether there was any, so that the plan no longer holds.
  bool drop_damaged_inputs(const Targets& targets, const Plan& plan);

 private:
  const std::filesystem::path folder_;
  Manifest& manifest_;
  std::map<std::string, int> found_;  // times, by file
  std::set<std::string> hashed_;
};

/// Hashes every recorded file and drops the records of those that are missing or damaged, with a
/// warning each. A damaged checkpoint is removed: nothing makes it again or needs it.
/// @return how many were dropped. @throws Error for a file that may not be read.
int drop_all_damaged(const std::filesystem::path& folder, Manifest& manifest);

}  // namespace drench
