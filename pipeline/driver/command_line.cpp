#include "pipeline/driver/command_line.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <map>
#include <new>
#include <sstream>

#include "build_id.h"
#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/printable.h"
#include "pipeline/contract/shot/shot_text.h"
#include "pipeline/driver/commands.h"
#include "pipeline/driver/farm/farm.h"
#include "pipeline/driver/process.h"
#include "pipeline/driver/progress.h"

namespace drench {

namespace {

enum ExitCode { done = 0, user_error = 1, our_bug = 2, stopped = 75 };

struct Arguments {
  ShotArguments shot;
  FarmArguments farm;
  std::filesystem::path folder, compared, name;
  std::vector<Step> steps;  // empty: all
  int port = 0;             // any
  bool verbose = false, json = false, reference = false, strict = false;
  bool status = false, cancel = false;  // of a farm
  bool watch = false;                   // of a report
  std::string job_template;
};

void add_common(CLI::App& command, Arguments& arguments) {
  command.add_flag("--json", arguments.json, "machine-readable to stdout");
  command.add_flag("-v,--verbose", arguments.verbose, "also say what is skipped");
  command.add_flag("-q,--quiet", arguments.shot.quiet, "warnings and errors only");
}

void add_shot_options(CLI::App& command, Arguments& arguments) {
  ShotArguments& shot = arguments.shot;
  static const std::map<std::string, Device> devices{
      {"auto", Device::automatic}, {"cpu", Device::cpu}, {"cuda", Device::cuda}};
  command.add_option("SHOT", shot.shot, "shot file (TOML)")->required();
  command.add_option("--out", shot.out, "output folder; default out/<shot>/<quality>");
  command.add_option("--frames", shot.frames,
                     "1001-1048, 1001-1048x2 (every second), or a list of these; default all");
  command
      .add_option_function<std::string>(
          "--device", [&shot](const std::string& name) { shot.device = devices.at(name); },
          "auto, cpu or cuda")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->option_text("NAME");
  command.add_option("--threads", shot.threads, "cores to use; default all")
      ->check(CLI::Range(1, 4096));
  command.add_option("--memory", shot.memory_gib, "GiB; a run that needs more stops")
      ->check([](const std::string& text) {
        char* end = nullptr;
        const double gib = std::strtod(text.c_str(), &end);
        return *end == '\0' && gib >= 0.01 && gib <= 1e6  // not if it is nan
                   ? ""
                   : "is no number of GiB from 0.01 on, as 8 or 0.5";
      })
      ->option_text("GIB");
  command.add_option("--set", shot.set, "section.key=value; may be given again")
      ->allow_extra_args(false);
  command.add_option("--quality", shot.quality, "a [quality.NAME] of the shot; default final");
  command.add_flag("--strict", arguments.strict, "take warnings for errors");
  add_common(command, arguments);
}

CLI::Option* add_port(CLI::App& command, Arguments& arguments) {
  return command.add_option("--port", arguments.port, "default any that is free")
      ->check(CLI::Range(1, 65535));
}

using Steps = std::vector<Step>;

/// Names of steps as they are typed: with an underscore for a space.
std::map<std::string, Step> steps_by_name() {
  std::map<std::string, Step> steps;
  for (const Step step : all_steps()) {
    std::string name(step_name(step));
    std::replace(name.begin(), name.end(), ' ', '_');
    steps[name] = step;
  }
  return steps;
}

CLI::App* add_make(CLI::App& app, Arguments& arguments, const std::string& name,
                   const std::string& what, const std::string& example, const Steps& steps) {
  CLI::App* command = app.add_subcommand(name, what);
  add_shot_options(*command, arguments);
  command->add_flag("--verify", arguments.shot.verify,
                    "hash every file first; damaged ones are made again");
  command
      ->add_option("--retry", arguments.shot.retry,
                   "how often a frame that fails is tried again; default 0")
      ->check(CLI::Range(0, 100));
  command->add_flag("--shared", arguments.shot.shared,
                    "others may work in the output folder, if all say so: on a farm");
  command->add_flag("--openjd", arguments.shot.openjd,
                    "progress as a farm's workers read it (Open Job Description), on stdout");
  if (std::find(steps.begin(), steps.end(), Step::render) != steps.end())
    command->add_flag("--progressive", arguments.shot.progressive,
                      "show frames in render/SHOT.FRAME.refining.png as they refine");
  command->footer(fmt::format("Example: drench {} {}", name, example));
  command->callback([&arguments, steps] { make_command(arguments.shot, steps); });
  return command;
}

void add_run(CLI::App& app, Arguments& arguments) {
  CLI::App* command = add_make(app, arguments, "run", "all stages, overlapped where they can be",
                               "shots/pour.toml --quality preview", all_steps());
  static const std::map<std::string, Step> steps = steps_by_name();
  std::vector<std::string> names;
  for (const auto& [name, step] : steps) names.push_back(name);
  command
      ->add_option_function<std::vector<std::string>>(
          "--steps",
          [&arguments](const std::vector<std::string>& given) {
            for (const std::string& name : given) arguments.steps.push_back(steps.at(name));
          },
          "only these, with commas: simulate, mesh, foam, render, denoise, contact_sheet, movie")
      ->check(CLI::IsMember(names))
      ->delimiter(',')
      ->option_text("NAMES");
  command->callback([&arguments] {
    make_command(arguments.shot, arguments.steps.empty() ? all_steps() : arguments.steps);
  });
}

void add_farm(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand("farm", "all stages on a Slurm cluster, frame by frame");
  FarmArguments& farm = arguments.farm;
  add_shot_options(*command, arguments);
  command->add_option("--chunk", farm.chunk, "frames a task; default by what a frame took")
      ->check(CLI::Range(1, 1'000'000));
  command->add_option("--cores", farm.cores, "of a task; default 1")->check(CLI::Range(1, 4096));
  command
      ->add_option("--sbatch", farm.sbatch,
                   "handed on to sbatch, as --sbatch=--partition=film; may be given again")
      ->allow_extra_args(false);
  command
      ->add_option("--retry", farm.retry, "how often a task that fails is tried again; default 0")
      ->check(CLI::Range(0, 100));
  CLI::Option* status = command->add_flag("--status", arguments.status, "how far it is");
  CLI::Option* cancel =
      command->add_flag("--cancel", arguments.cancel, "end its tasks")->excludes(status);
  command
      ->add_option("--template", arguments.job_template,
                   "openjd: print the job as an Open Job Description, for other farms")
      ->check(CLI::IsMember({"openjd"}))
      ->excludes(status)
      ->excludes(cancel);
  command->footer("Example: drench farm shots/pour.toml --cores 8 --sbatch=--partition=film");
  command->callback([&arguments] {
    arguments.farm.shot = arguments.shot;
    if (arguments.status) return farm_status(arguments.farm);
    if (arguments.cancel) return farm_cancel(arguments.farm);
    if (!arguments.job_template.empty()) return farm_template(arguments.farm);
    farm_submit(arguments.farm);
  });
}

void add_commands(CLI::App& app, Arguments& arguments) {
  add_run(app, arguments);
  add_make(app, arguments, "simulate", "a shot to cache", "shots/pour.toml --frames 1001-1024",
           {Step::simulate});
  add_make(app, arguments, "mesh", "caches to fluid surfaces and foam",
           "shots/pour.toml --frames 1010", {Step::mesh, Step::foam});
  add_make(app, arguments, "render", "meshes to EXR frames, a contact sheet and a movie",
           "shots/pour.toml --set render.samples=256",
           {Step::render, Step::denoise, Step::contact_sheet, Step::movie});

  add_farm(app, arguments);

  CLI::App* plan = app.add_subcommand("plan", "what would run and what is skipped, with reasons");
  add_shot_options(*plan, arguments);
  plan->footer("Example: drench plan shots/pour.toml --set camera.fov_deg=30");
  plan->callback([&arguments] { plan_command(arguments.shot); });

  CLI::App* clean = app.add_subcommand("clean", "remove frames beyond the shot's range");
  add_shot_options(*clean, arguments);
  clean->remove_option(clean->get_option("--frames"));  // that would be the ones to keep
  clean->footer("Example: drench clean shots/pour.toml --quality preview");
  clean->callback([&arguments] { clean_command(arguments.shot); });

  CLI::App* verify = app.add_subcommand("verify", "check every file against the manifest");
  verify->add_option("DIR", arguments.folder, "output folder")->required();
  add_common(*verify, arguments);
  verify->footer("Example: drench verify out/pour/preview");
  verify->callback([&arguments] { verify_command(arguments.folder, arguments.shot.format); });

  CLI::App* report = app.add_subcommand("report", "a page of frames, plots, warnings and commands");
  report->add_option("DIR", arguments.folder, "output folder")->required();
  report->add_option("--with", arguments.compared, "another output folder, to compare frames with");
  CLI::Option* watch =
      report->add_flag("--watch", arguments.watch, "follow a run, in a browser on this machine");
  add_port(*report, arguments)->needs(watch);
  add_common(*report, arguments);
  report->footer("Example: drench report out/pour/preview");
  report->callback([&arguments] {
    if (arguments.watch) return watch_command(arguments.folder, arguments.compared, arguments.port);
    report_command(arguments.folder, arguments.compared);
  });

  CLI::App* view = app.add_subcommand("view", "plays caches in a browser, on this machine alone");
  view->add_option("DIR", arguments.folder, "output folder")->required();
  add_port(*view, arguments);
  add_common(*view, arguments);
  view->footer("Example: drench view out/pour/preview");
  view->callback([&arguments] { view_command(arguments.folder, arguments.port); });

  CLI::App* fabrics = app.add_subcommand("fabrics", "constants of common fabrics, with sources");
  add_common(*fabrics, arguments);
  fabrics->footer("Example: drench fabrics");
  fabrics->callback([&arguments] { fabrics_command(arguments.shot.format); });

  CLI::App* init = app.add_subcommand("init", "write a commented starting shot");
  init->add_option("NAME", arguments.name, "shot to write, with or without .toml")->required();
  init->add_flag("--reference", arguments.reference, "every key there is, with form and limits");
  add_common(*init, arguments);
  init->footer("Example: drench init shots/rain");
  init->callback([&arguments] {
    init_command(arguments.name,
                 arguments.reference ? InitialShot::reference : InitialShot::commented);
  });
}

void say(const char* kind, const char* text) {
  std::fprintf(stderr, "drench: %s%s\n", kind, printable(text, Lines::many).c_str());
}

/// What is meant by a command or an option that there is not; empty: nothing is near.
std::string guess_of_word(CLI::App& app, const std::vector<std::string>& words) {
  if (words.size() < 2 || words[1].starts_with('-')) return {};
  std::vector<std::string> names;
  std::string unknown = words[1];
  const std::vector<CLI::App*> commands = app.get_subcommands({});
  const auto same = std::find_if(commands.begin(), commands.end(),
                                 [&](const CLI::App* one) { return one->get_name() == unknown; });
  CLI::App* const command = same == commands.end() ? nullptr : *same;
  if (command == nullptr) {
    for (const CLI::App* one : commands) names.push_back(one->get_name());
  } else {
    for (const CLI::Option* option : command->get_options())
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    const auto found = std::find_if(words.begin() + 2, words.end(), [&](const std::string& word) {
      return word.starts_with("--") &&
             command->get_option_no_throw(word.substr(0, word.find('='))) == nullptr;
    });
    if (found == words.end()) return {};
    unknown = found->substr(0, found->find('='));
  }
  const std::string_view near = shot_table::nearest_word(unknown, {names.begin(), names.end()});
  const std::string what = fmt::format("{} is no {}", unknown, command ? "option" : "command");
  return near.empty() ? what + "\n" : fmt::format("{}; did you mean {}?\n", what, near);
}

/// What is said of help, version and bad words. @return the exit code
int say_of_parsing(CLI::App& app, const CLI::ParseError& error,
                   const std::vector<std::string>& words) {
  std::ostringstream out, err;
  const bool asked = app.exit(error, out, err) == 0;  // --help and --version are no errors
  std::fputs(out.str().c_str(), stdout);
  const std::string guess = asked ? "" : guess_of_word(app, words);
  std::fputs(printable(guess + err.str(), Lines::many).c_str(), stderr);
  return asked ? done : user_error;
}

/// A farm's line is one line.
void tell_farm(const char* text) {
  std::printf("%s%s\n", std::string(openjd_fail).c_str(), printable(text, Lines::one).c_str());
  std::fflush(stdout);
}

int parse_and_run(int argc, char** argv) {
  Arguments arguments;
  arguments.shot.command.assign(argv, argv + argc);
  CLI::App app("Shots of fluid and cloth, from physics to film frames.", "drench");
  app.set_version_flag("--version", fmt::format("drench {}", build_id::version));
  app.require_subcommand(1);
  app.footer("Example: drench run shots/pour.toml --quality preview");
  app.parse_complete_callback([&arguments] {
    if (arguments.verbose) set_log_level(LogLevel::verbose);
    if (arguments.strict) set_on_warning(OnWarning::fail);
    if (arguments.json) arguments.shot.format = OutputFormat::json;
    if (arguments.shot.quiet) set_log_level(LogLevel::quiet);
  });
  add_commands(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return say_of_parsing(app, error, arguments.shot.command);
  } catch (const std::exception& error) {
    if (arguments.shot.openjd) tell_farm(error.what());
    throw;
  }
  return done;
}

}  // namespace

int drench_program(int argc, char** argv) {
  open_standard_streams();  // before anything opens a file
  install_signal_handlers();
  try {
    return parse_and_run(argc, argv);
  } catch (const Stopped& stop) {
    say("", stop.what());
    return stopped;
  } catch (const Error& error) {
    say("", error.what());
    return user_error;
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string reason = system_reason(error.code().value());
    say("", fmt::format("{}: {}", error.path1().string(), reason).c_str());
    return user_error;
  } catch (const std::system_error& error) {  // of starting a thread
    say("", fmt::format("the system gives no more threads or other resources: {}; raise the limits "
                        "(ulimit -a) or give --threads fewer",
                        error.code().message())
                .c_str());
    return user_error;
  } catch (const std::bad_alloc&) {
    say("",
        "not enough memory; close other programs, or make the scene smaller (fluid.spacing, "
        "surface.voxel, render size)");
    return user_error;
  } catch (const std::exception& bug) {
    say("this is a bug in drench, please report it: ", bug.what());
    return our_bug;
  }
}

}  // namespace drench
