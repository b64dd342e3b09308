#pragma once
// The `drench` program without its process: arguments in, exit code out.

namespace drench {

/// Parses, runs one subcommand and turns exceptions into messages on stderr.
/// @return 0 done, 1 the user can fix it, 2 our bug, 75 stopped on request.
int drench_program(int argc, char** argv);

}  // namespace drench
