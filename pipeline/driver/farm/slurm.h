#pragma once
// The commands of Slurm, run and read. Nothing is scheduled here.

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace drench::slurm {

/// One array of tasks: elements 0 ... count - 1, held.
struct Array {
  std::string name;
  int count = 0;
  std::vector<std::string> options;  // of sbatch, further ones
  std::string script;
};
/// Elements that one array may have where the site has not changed MaxArraySize.
inline constexpr int most_elements = 1000;

/// @return the job number. @throws Error with sbatch's words if it refuses
std::string submit_held(const Array& array);

/// What an element is called and waits for: "12_3", "pour.mesh.1001-1004", {"11_3"}.
struct Element {
  std::string job, name;
  std::vector<std::string> after;  // jobs that must end well before
};
/// Names the elements, ties them to what they wait for and lets their arrays go.
/// @throws Error with scontrol's words if it refuses one
void release(const std::vector<Element>& elements, const std::vector<std::string>& arrays);

/// Ends tasks, in whatever state; those that are gone already are no error.
void cancel(const std::vector<std::string>& jobs);

/// The reason of one that waits for what has failed.
inline constexpr std::string_view never = "DependencyNeverSatisfied";

struct State {
  std::string name, state, reason, node;
  bool is_active() const;   // will run, runs, or is about to run again
  bool is_waiting() const;  // active, and not on a node
  bool is_held() const;     // by its user: it does not run before somebody lets it go
};
/// Every element of this user that Slurm knows, by job ("12_3"). @throws Error
std::map<std::string, State> queue();

/// A word that Slurm's lists and scontrol take as it stands: odd characters become '_'.
std::string plain_name(std::string text);

}  // namespace drench::slurm
