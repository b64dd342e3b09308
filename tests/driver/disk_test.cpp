#include "pipeline/driver/disk.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/driver/tiny_shot.h"
#include "tests/driver/toy_shot.h"

namespace drench {
namespace {

using namespace test;

std::map<std::string, Record> records_of(const Targets& targets, int frames) {
  std::map<std::string, Record> records;
  const auto add = [&](const std::string& file, std::string_view step, int frame, uint64_t size) {
    Record record;
    record.file = file, record.step = step, record.frame = frame, record.size = size;
    records[file] = record;
  };
  for (int frame = 1; frame <= frames; ++frame) {
    add(simulated_files(targets, frame)[0], "simulate", frame, uint64_t(1000 * frame));
    add(rule_of(Step::mesh).outputs(targets, frame)[0], "mesh", frame, 500);
  }
  return records;
}

TEST(DiskEstimate, CountsNewFramesByThoseThatAreThere) {
  ToySettings settings;
  settings.last = 10;
  const Targets targets = toy_targets(settings);
  const std::map<std::string, Record> records = records_of(targets, 3);
  const Plan plan = make_plan(targets, {}, 10);  // all is to be made, three frames again
  const DiskEstimate estimate = disk_estimate(plan, targets, records);
  EXPECT_EQ(estimate.bytes, 7 * 2000 + 7 * 500);
  EXPECT_EQ(estimate.unknown, std::vector<Step>{Step::render});
  EXPECT_EQ(disk_text(estimate, 2e9),
            "about 0.0175 MB of disk are needed, 2 GB are free; not counted: render");
  EXPECT_EQ(disk_text({}, 2e9), "");
}

TEST(DiskReserve, IsTwiceTheLargestFramesOrFourMebibytes) {
  std::map<std::string, Record> records = records_of(toy_targets({}), 3);
  EXPECT_EQ(disk_reserve(records), 4 << 20);
  records.begin()->second.size = 10 << 20;
  EXPECT_GT(disk_reserve(records), 20 << 20);
  EXPECT_LT(disk_reserve(records), 21 << 20);
}

TEST(FreeDisk, IsToldOfAFolderThatIsNotThereYet) {
  const TemporaryFolder folder;
  const double there = free_disk(folder.path());
  EXPECT_GT(there, 1e6);
  EXPECT_NEAR(free_disk(folder / "a/b/c"), there, 0.2 * there);
}

TEST(Program, PlansTheDiskThatMissingFramesTake) {
  const TinyShot shot(6);
  ASSERT_EQ(shot.run("run", {"--frames", "1001-1003"}).code, 0);
  const Ended ended = shot.run("plan");
  EXPECT_NE(ended.out.find("MB of disk are needed"), std::string::npos) << ended.out;
}

}  // namespace
}  // namespace drench
