#pragma once
// A Slurm cluster of its own: munged, a controller and two nodes of one core, on loopback, with
// everything in a temporary folder.

#include <string>
#include <vector>

#include "tests/temporary_folder.h"

namespace drench::test {

class SlurmCluster {
 public:
  /// Why there can be none here; empty if there can.
  static std::string why_not();

  /// Starts it and waits until both nodes are idle. @throws std::runtime_error
  SlurmCluster();
  ~SlurmCluster();
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

  /// What a program needs to find it, "NAME=value".
  std::vector<std::string> environment() const { return {"SLURM_CONF=" + configuration()}; }

  /// kill -9 of the controller, and its start.
  void kill_controller();
  void start_controller();
  /// kill -9 of all that runs on a node, "n0" or "n1", and its start.
  void kill_node(const std::string& node);
  void start_node(const std::string& node);

  /// What an administrator does after a loss: brings nodes back, releases what is held and ends the
  /// two minutes that a job waits after it was requeued.
  void heal();
  /// One of Slurm's commands; what it printed.
  std::string run(const std::string& command, const std::vector<std::string>& arguments) const;
  /// Tasks that wait or run, but for those that their user holds.
  int tasks_left() const;
  bool runs_on(const std::string& node) const;

 private:
  std::string configuration() const { return folder_ / "slurm.conf"; }
  void start(const std::string& program, const std::vector<std::string>& arguments) const;

  const TemporaryFolder folder_;
};

}  // namespace drench::test
