#include "tests/bench/bench.h"

int main(int argc, char** argv) { return drench::bench::run_bench(argc, argv); }
