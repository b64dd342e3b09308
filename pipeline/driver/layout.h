#pragma once
// Names inside an output folder, relative to it.

#include <array>
#include <string>
#include <string_view>

namespace drench::layout {

inline constexpr std::string_view manifest = "manifest.jsonl";
inline constexpr std::string_view stats = "stats.jsonl";
inline constexpr std::string_view report = "report.html";
inline constexpr std::string_view lock = ".lock";
inline constexpr std::string_view simulation_lock = ".simulation.lock";
inline constexpr std::string_view shot_lock = "shot.lock.toml";
inline constexpr std::string_view contact_sheet = "contact_sheet.png";
inline constexpr std::string_view stop_checkpoint = "sim/checkpoint/stop.ckpt";

/// What no record names.
inline constexpr auto own =
    std::to_array<std::string_view>({manifest, stats, report, lock, simulation_lock});

/// What `drench farm` keeps: shots as they were submitted, numbers of jobs, logs.
inline constexpr std::string_view farm = "farm", farm_logs = "farm/log",
                                  farm_tasks = "farm/tasks.jsonl", farm_lock = "farm/.lock";

/// All that files are written into; "" is the output folder itself.
inline constexpr auto folders =
    std::to_array<std::string_view>({"", "sim", "sim/checkpoint", "mesh", "render", "noisy"});

std::string particles(int frame);                               // sim/particles.1001.vdb
std::string cloth(const std::string& name, int frame);          // sim/cloth.flag.1001.ply
std::string probe(const std::string& name);                     // sim/probe.gauge.csv
std::string checkpoint(int frame);                              // sim/checkpoint/frame.1011.ckpt
std::string fluid_mesh(int frame);                              // mesh/fluid.1001.ply
std::string fluid_obj(int frame);                               // mesh/fluid.1001.obj
std::string level_set(int frame);                               // mesh/fluid.1001.vdb
std::string foam(int frame);                                    // mesh/foam.1001.vdb
std::string image(const std::string& shot, int frame);          // render/pour.1001.exr
std::string noisy(const std::string& shot, int frame);          // noisy/pour.1001.exr
std::string frame_samples(const std::string& shot, int frame);  // render/pour.1001.samples
std::string refining(const std::string& shot, int frame);       // render/pour.1001.refining.png
bool is_in_work(std::string_view file);                         // a file of one of these
std::string movie(const std::string& shot);                     // pour.mp4

}  // namespace drench::layout
