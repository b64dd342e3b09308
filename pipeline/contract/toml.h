#pragma once
// toml++ with one set of options; only .cpp files of the shot reader include this.

#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>
