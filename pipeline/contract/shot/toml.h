#pragma once
// toml++ with one set of options; only .cpp files of the shot reader include this.

#define TOML_ENABLE_FORMATTERS 0
// A stray character where a key should start trips an assertion of toml++ 3.3 just before the code
// that reports it as an error; without assertions the report is reached, in every kind of build.
#define TOML_ASSERT(expression) static_cast<void>(0)
#include <toml++/toml.h>
