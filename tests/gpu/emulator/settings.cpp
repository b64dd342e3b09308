#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "tests/gpu/emulator/runtime.h"

namespace gpu_emulator {

namespace {
std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}
Settings from_environment() {
  Settings s;
  const std::string check = variable("GPUEMU_CHECK"), order = variable("GPUEMU_ORDER"),
                    reports = variable("GPUEMU_REPORTS"), home = variable("HOME");
  s.init = check.find("init") != std::string::npos;
  s.race = check.find("race") != std::string::npos;
  s.strict = !variable("GPUEMU_STRICT_INIT").empty();
  s.profile = variable("GPUEMU_PROFILE");
  if (order == "reverse") s.order = Settings::Order::reverse;
  if (order == "shuffled") s.order = Settings::Order::shuffled;
  s.abort = variable("GPUEMU_FAULT") == "abort";
  if (!variable("GPUEMU_FUSE").empty()) s.fuse = "f";
  s.trace = !variable("GPUEMU_TRACE").empty();
  if (!reports.empty()) s.most_reports = std::atoi(reports.c_str());
  s.digest = !variable("GPUEMU_DIGEST").empty();
  s.cache = variable("GPUEMU_CACHE");
  if (s.cache.empty()) s.cache = (home.empty() ? "/tmp" : home + "/.cache") + "/gpu-emulator";
  return s;
}
}  // namespace

const Settings& settings() {
  static const Settings* const all = new Settings(from_environment());  // needed at exit
  return *all;
}

void say(const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  std::fputs("gpu-emulator: ", stderr);
  std::vfprintf(stderr, format, arguments);
  std::fputc('\n', stderr);
  va_end(arguments);
}

void give_up(const std::string& why) {
  say("%s", why.c_str());
  std::exit(1);
}

}  // namespace gpu_emulator
