#pragma once
// Instructions of a piece of work, counted by callgrind in a process of its own: figures that
// repeat whatever else the machine does.

#include <functional>
#include <string>

namespace drench::bench {

/// The variant that this process was started to count; null in the process that a person started.
const char* variant_to_count();

/// The work whose instructions count, on one thread. In a process for a variant only.
void count_instructions(const std::function<void()>& work);

/// Starts this program for a variant of a case, whose run must hand that to count_instructions().
/// @throws std::runtime_error without valgrind, or where the process counted nothing
double instructions(const std::string& case_name, const std::string& variant);

}  // namespace drench::bench
