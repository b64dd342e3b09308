#pragma once
// The one error type of the project: a problem the user can fix. Anything else is our bug.

#include <stdexcept>
#include <string>

namespace drench {

/// A problem the user can fix: exit code 1. The text says what, where, why and what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Stopped on request (SIGINT, SIGTERM) after a checkpoint was written: exit code 75.
class Stopped : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace drench
