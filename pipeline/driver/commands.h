#pragma once
// The subcommands: read the shot, call the library, report. They throw; main alone catches.

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/driver/step.h"
#include "sim/simulator.h"

namespace drench {

enum class OutputFormat { text, json };

/// Options of every command that takes a shot.
struct ShotArguments {
  std::filesystem::path shot;
  std::filesystem::path out;  // empty: out/<shot>/<quality>
  std::string frames;         // empty: all of the shot
  Device device = Device::automatic;
  int threads = 0;        // 0: all cores
  double memory_gib = 0;  // 0: no limit
  std::vector<std::string> set;
  std::vector<std::string> command;  // as it was typed
  std::string quality = "final";
  OutputFormat format = OutputFormat::text;
  bool quiet = false;
  bool verify = false;       // hash every file first instead of trusting sizes and times
  int retry = 0;             // times that a frame is tried again which failed
  bool shared = false;       // other drivers may work in the output folder
  bool openjd = false;       // progress in a farm's lines on standard output
  bool progressive = false;  // pictures of frames as they refine
};

/// run, simulate, mesh, render: brings the output folder up to date as far as `steps` go.
/// @throws Error, Stopped.
void make_command(const ShotArguments& arguments, const std::vector<Step>& steps);
/// Prints what make_command would do. Never writes.
void plan_command(const ShotArguments& arguments);
/// Removes frames outside the shot's range and files of sheets it no longer has.
void clean_command(const ShotArguments& arguments);
/// Hashes every file; never writes and takes no lock. @throws Error if one is missing or damaged: a
/// run that verifies makes those again; or if one may not be read.
void verify_command(const std::filesystem::path& folder, OutputFormat format);
/// Prints the constants of common fabrics, in SI: a line a fabric, tabs between, names and units
/// first.
void fabrics_command(OutputFormat format);
/// Writes OUT/report.html, a page of what was made and what it took. @param compared  another
/// output folder whose frames are shown beside; empty: none.
void report_command(const std::filesystem::path& folder, const std::filesystem::path& compared);
/// The same page on loopback, which follows a run, until the program is asked to stop.
/// @param port  0: any that is free
void watch_command(const std::filesystem::path& folder, const std::filesystem::path& compared,
                   int port);
/// Prints an address on loopback and plays the folder's caches there until it is stopped.
/// @param port  0: any
void view_command(const std::filesystem::path& folder, int port);
enum class InitialShot { commented, reference };
/// Writes NAME.toml, a commented starting shot or one of every key. @throws Error if it exists.
void init_command(const std::filesystem::path& name, InitialShot kind);

}  // namespace drench
