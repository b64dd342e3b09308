#include "pipeline/driver/command_line.h"
#include "pipeline/driver/process.h"

// Libraries that are loaded start threads before main; runs before any of them.
__attribute__((section(".preinit_array"),
               used)) static void (*before_libraries)() = drench::explain_missing_threads;

int main(int argc, char** argv) { return drench::drench_program(argc, argv); }
