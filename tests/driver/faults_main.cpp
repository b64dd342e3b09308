// drench with the faults of faults.cpp.

#include "pipeline/driver/command_line.h"

int main(int argc, char** argv) { return drench::drench_program(argc, argv); }
