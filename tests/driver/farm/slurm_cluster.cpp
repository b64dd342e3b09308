#include "tests/driver/farm/slurm_cluster.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <pwd.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <random>
#include <sstream>
#include <thread>

#include "tests/driver/child.h"
#include "tests/driver/folder.h"

namespace drench::test {

namespace fs = std::filesystem;

namespace {

constexpr const char *munged = "/usr/sbin/munged", *slurmctld = "/usr/sbin/slurmctld",
                     *slurmd = "/usr/sbin/slurmd";

/// Ports that nobody has now.
std::vector<int> free_ports(size_t count) {
  std::vector<int> ports, sockets;
  for (size_t k = 0; k < count; ++k) {
    const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const plain = reinterpret_cast<sockaddr*>(&address);
    if (::bind(descriptor, plain, size) != 0 || ::getsockname(descriptor, plain, &size) != 0)
      throw std::runtime_error("no free port");
    ports.push_back(ntohs(address.sin_port));
    sockets.push_back(descriptor);
  }
  for (const int descriptor : sockets) ::close(descriptor);
  return ports;
}

std::string user() {
  const passwd* const entry = ::getpwuid(::geteuid());
  return entry ? entry->pw_name : "root";
}

/// Processes whose environment holds a text.
std::vector<pid_t> processes_with(const std::string& text) {
  std::vector<pid_t> found;
  for (const fs::directory_entry& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != name.npos) continue;
    if (std::stoi(name) == ::getpid()) continue;
    if (text_of(entry.path() / "environ").find(text) != std::string::npos)
      found.push_back(std::stoi(name));
  }
  return found;
}

pid_t parent_of(pid_t process) {
  const std::string stat = text_of(fmt::format("/proc/{}/stat", process));
  std::istringstream rest(stat.substr(std::min(stat.size(), stat.rfind(')') + 2)));
  std::string state;
  pid_t parent = 0;
  rest >> state >> parent;
  return parent;
}

void kill_process_of(const fs::path& pid_file) {
  const std::string text = text_of(pid_file);
  if (!text.empty()) ::kill(std::stoi(text), SIGKILL);
}

bool wait_until(double seconds, const auto& holds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (!holds()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return true;
}

constexpr std::string_view configuration_text = R"(ClusterName=drench
SlurmctldHost=localhost
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
SlurmctldPort={controller}
SlurmctldPidFile={folder}/controller.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/controller.log
SlurmdLogFile={folder}/%n.log
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
MpiDefault=none
MailProg=/bin/true
ReturnToService=2
SlurmdTimeout=5
KillWait=2
SchedulerParameters=sched_interval=1,sched_min_interval=10000,bf_interval=1
NodeName=n0 NodeHostname=localhost NodeAddr=127.0.0.1 Port={n0} CPUs=1 RealMemory=4000
NodeName=n1 NodeHostname=localhost NodeAddr=127.0.0.1 Port={n1} CPUs=1 RealMemory=4000
PartitionName=film Nodes=n[0-1] Default=YES MaxTime=INFINITE State=UP
)";

}  // namespace

std::string SlurmCluster::why_not() {
  for (const char* program : {munged, slurmctld, slurmd, "/usr/bin/sbatch"})
    if (::access(program, X_OK) != 0)
      return std::string(program) + " is not there; install slurm-wlm and munge";
  return {};
}

SlurmCluster::SlurmCluster() {
  for (const char* name : {"state", "munge"}) fs::create_directory(folder_ / name);
  ::chmod((folder_ / "munge").c_str(), 0700);
  std::random_device random;
  std::string key(128, '\0');
  for (char& c : key) c = char(random());
  put_text(folder_ / "munge/key", key);
  ::chmod((folder_ / "munge/key").c_str(), 0400);
  const std::vector<int> ports = free_ports(3);
  put_text(configuration(), fmt::format(configuration_text, fmt::arg("user", user()),
                                        fmt::arg("folder", folder_.path().string()),
                                        fmt::arg("controller", ports[0]), fmt::arg("n0", ports[1]),
                                        fmt::arg("n1", ports[2])));
  const std::string munge = folder_ / "munge/";
  start(munged, {"--force", "--socket=" + munge + "socket", "--key-file=" + munge + "key",
                 "--pid-file=" + munge + "pid", "--log-file=" + munge + "log",
                 "--seed-file=" + munge + "seed"});
  start_controller();
  start_node("n0");
  start_node("n1");
  const bool up = wait_until(30, [&] {
    return run("sinfo", {"--noheader", "--states=idle", "--format=%D"}).find('2') == 0;
  });
  if (!up) throw std::runtime_error("no cluster: " + text_of(folder_ / "controller.log"));
}

SlurmCluster::~SlurmCluster() {
  kill_node("n0");
  kill_node("n1");
  kill_controller();
  kill_process_of(folder_ / "munge/pid");
}

void SlurmCluster::start(const std::string& program,
                         const std::vector<std::string>& arguments) const {
  const Ended ended = run_program(program, arguments, folder_.path(), environment());
  if (ended.code != 0) throw std::runtime_error(program + ": " + ended.err);
}

void SlurmCluster::start_controller() { start(slurmctld, {"-f", configuration()}); }
void SlurmCluster::start_node(const std::string& node) {
  start(slurmd, {"-f", configuration(), "-N", node});
}

void SlurmCluster::kill_controller() { kill_process_of(folder_ / "controller.pid"); }

void SlurmCluster::kill_node(const std::string& node) {
  kill_process_of(folder_ / (node + ".pid"));
  for (const pid_t process : processes_with("SLURM_CONF=" + configuration())) {
    const std::string variables = text_of(fmt::format("/proc/{}/environ", process));
    if (variables.find("SLURMD_NODENAME=" + node) == std::string::npos) continue;
    const pid_t parent = parent_of(process);
    if (text_of(fmt::format("/proc/{}/cmdline", parent)).find("slurmstepd") != std::string::npos)
      ::kill(parent, SIGKILL);
    ::kill(process, SIGKILL);
  }
}

std::string SlurmCluster::run(const std::string& command,
                              const std::vector<std::string>& arguments) const {
  return run_program("/usr/bin/" + command, arguments, folder_.path(), environment()).out;
}

void SlurmCluster::heal() {
  run("scontrol", {"update", "NodeName=n0,n1", "State=resume"});
  std::istringstream lines(run("squeue", {"--noheader", "--array", "--format=%i|%r"}));
  for (std::string line; std::getline(lines, line);) {
    const std::string job = line.substr(0, line.find('|')),
                      reason = line.substr(line.find('|') + 1);
    if (reason == "BeginTime") run("scontrol", {"update", "JobId=" + job, "StartTime=now"});
    if (reason.find("requeued held") != std::string::npos) run("scontrol", {"release", job});
  }
}

int SlurmCluster::tasks_left() const {
  std::istringstream lines(run("squeue", {"--noheader", "--array", "--format=%r"}));
  int left = 0;
  for (std::string reason; std::getline(lines, reason);) left += reason != "JobHeldUser";
  return left;
}

bool SlurmCluster::runs_on(const std::string& node) const {
  return !run("squeue", {"--noheader", "--states=running", "--nodelist=" + node, "--format=%i"})
              .empty();
}

}  // namespace drench::test
