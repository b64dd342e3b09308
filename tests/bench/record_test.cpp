// The bench harness itself, on two cases of no cost: what --record keeps, what --quick and
// --missing leave out.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/bench/bench.h"
#include "tests/temporary_folder.h"

namespace drench::bench {
namespace {

using nlohmann::json;

int runs = 0;  // of the case "sizes"

const Registration sizes_case{"sizes", "a row a size",
                              [](const Emit& emit) {
                                ++runs;
                                for (const int size : sizes({10, 20, 40}, 2)) {
                                  Line line;
                                  line.method = "none";
                                  line.resolution = std::to_string(size) + " layers";
                                  line.cost = measure([] {});
                                  line.error = 1.0 / size, line.gate = 0.07;
                                  line.error_of = "one over the size";
                                  line.more["size"] = size;
                                  emit(line);
                                }
                              },
                              InQuick::yes};
const Registration broken_case{"broken", "throws behind its first row", [](const Emit& emit) {
                                 emit(Line{});
                                 throw std::runtime_error("broken");
                               }};

int run(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "bench");
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  return run_bench(int(argv.size()), argv.data());
}

std::vector<json> rows_of(const std::string& file) {
  std::vector<json> rows;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) rows.push_back(json::parse(line));
  return rows;
}

class BenchRecord : public ::testing::Test {
 protected:
  const test::TemporaryFolder folder;
  const std::string file = (folder.path() / "results.jsonl").string();
};

TEST_F(BenchRecord, HasOriginAndResultOfEachRow) {
  EXPECT_EQ(run({"--record", file, "--commit", "1234567", "sizes"}), 1);  // 0.1 is above 0.07
  const std::vector<json> rows = rows_of(file);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0]["commit"], "1234567");
  EXPECT_EQ(rows[0]["command"], "./bench sizes");
  EXPECT_EQ(rows[0]["time"].get<std::string>().size(), std::string("2026-01-01T00:00:00Z").size());
  EXPECT_NE(rows[0]["machine"].get<std::string>().find(" cores"), std::string::npos);
  EXPECT_EQ(rows[0]["case"], "sizes");
  EXPECT_EQ(rows[0]["pass"], false);
  EXPECT_EQ(rows[2]["error"], 0.025);
  EXPECT_EQ(rows[2]["pass"], true);
  EXPECT_EQ(rows[2]["size"], 40);
  EXPECT_GE(rows[2]["cpu_s"], 0);
}

// By the script that makes the pages.
TEST_F(BenchRecord, IsValid) {
  const std::string python = "/usr/bin/python3", script = DRENCH_SOURCE_DIR "/tests/bench/pages.py";
  if (!std::filesystem::exists(python)) GTEST_SKIP() << "there is no " << python;
  (void)run({"--record", file, "--commit", "1234567", "sizes"});
  const std::string validate = python + " -B " + script + " --validate " + file;
  EXPECT_EQ(std::system(validate.c_str()), 0);
  std::ofstream(file, std::ios::app) << R"({"case": "sizes", "error": NaN})" << std::endl;
  EXPECT_NE(std::system((validate + " 2> /dev/null").c_str()), 0);
}

TEST_F(BenchRecord, OfAQuickRunHasItsSmallSizesAndSaysSo) {
  (void)run({"--quick", "--record", file, "--commit", "1234567"});
  const std::vector<json> rows = rows_of(file);
  ASSERT_EQ(rows.size(), 2u);  // of "sizes" alone: the other is in no quick run
  EXPECT_EQ(rows[1]["command"], "./bench --quick sizes");
  EXPECT_EQ(rows[1]["resolution"], "20 layers");
}

TEST_F(BenchRecord, IsAddedToByMissingForAnotherCommitAlone) {
  (void)run({"--record", file, "--commit", "1234567", "sizes"});
  const int before = runs;
  EXPECT_EQ(run({"--missing", "--record", file, "--commit", "1234567", "sizes"}), 0);
  EXPECT_EQ(runs, before);
  (void)run({"--missing", "--record", file, "--commit", "89abcde", "sizes"});
  EXPECT_EQ(runs, before + 1);
  EXPECT_EQ(rows_of(file).size(), 6u);
}

TEST_F(BenchRecord, HasNothingOfACaseThatFails) {
  EXPECT_EQ(run({"--record", file, "--commit", "1234567", "broken"}), 1);
  EXPECT_TRUE(rows_of(file).empty());
}

TEST_F(BenchRecord, NeedsTheStateOfTheCode) { EXPECT_EQ(run({"--record", file, "sizes"}), 1); }

}  // namespace
}  // namespace drench::bench
