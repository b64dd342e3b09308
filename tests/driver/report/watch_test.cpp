// The report of a run that goes on.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "pipeline/driver/layout.h"
#include "tests/driver/served_page.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace test;

/// A shot of four frames of which two are made, and its report.
struct HalfRun {
  HalfRun() { EXPECT_EQ(shot.run("run", {"--frames", "1001-1002"}).code, 0); }
  TinyShot shot{4};
};
struct Watched : HalfRun, ServedPage {
  explicit Watched(std::vector<std::string> more = {})
      : ServedPage(words(shot.out(), std::move(more)), shot.folder()) {}

  static std::vector<std::string> words(const std::filesystem::path& out,
                                        std::vector<std::string> more) {
    more.insert(more.begin(), {"report", out.string(), "--watch"});
    return more;
  }
  /// What the page's script reads.
  nlohmann::json data() const {
    const std::string page = body(root), mark = "id=\"data\">";
    const size_t begin = page.find(mark) + mark.size();
    return nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
  }
  /// The address of a frame as the page has it.
  std::string address(const std::string& element) const {
    const std::string page = body(root), mark = "id=\"" + element + "\">";
    const size_t begin = page.find(mark) + mark.size();
    return root + page.substr(begin, page.find("</script>", begin) - begin);
  }
};

bool is_jpeg(const std::string& bytes) { return bytes.starts_with("\xff\xd8\xff"); }

TEST(Watch, FollowsARun) {
  const Watched watched;
  const std::string state = watched.body(watched.root + "state");
  EXPECT_EQ(watched.data()["state"], state);
  EXPECT_EQ(watched.data()["images"].size(), 2u);
  EXPECT_NE(watched.body(watched.root).find("<progress value=\"2\" max=\"4\">"), std::string::npos);
  EXPECT_TRUE(is_jpeg(watched.body(watched.address("a1002"))));
  EXPECT_EQ(watched.body(watched.root + "state"), state) << "nothing has happened";
  const std::string first = watched.address("a1001");
  ASSERT_EQ(watched.shot.run("run").code, 0);
  EXPECT_NE(watched.body(watched.root + "state"), state);
  EXPECT_EQ(watched.data()["images"].size(), 4u);
  EXPECT_NE(watched.body(watched.root).find("<progress value=\"4\" max=\"4\">"), std::string::npos);
  EXPECT_EQ(watched.body(watched.root).find("<progress value=\"2\""), std::string::npos);
  EXPECT_EQ(watched.address("a1001"), first) << "a frame that stays is not sent again";
  watched.program->send(SIGTERM);
  EXPECT_EQ(watched.program->wait().code, 0);
}

TEST(Watch, ShowsAFrameInWork) {
  const Watched watched;
  const std::string state = watched.body(watched.root + "state"), picture = "\x89PNG...";
  put_text(watched.shot.out() / layout::refining("tiny", 1003), picture);
  EXPECT_NE(watched.body(watched.root + "state"), state);
  EXPECT_EQ(watched.data()["images"].size(), 3u);
  EXPECT_EQ(watched.body(watched.address("a1003")), picture);
  EXPECT_NE(watched.body(watched.root).find("1003, in work"), std::string::npos);
}

TEST(Watch, ComparesWithAnotherRun) {
  const TinyShot other(1);
  ASSERT_EQ(other.run("run", {"--set", "camera.fov_deg=30"}).code, 0);
  const Watched watched({"--with", other.out().string()});
  const std::string mine = watched.body(watched.address("a1001")),
                    others = watched.body(watched.address("b1001"));
  EXPECT_TRUE(is_jpeg(others));
  EXPECT_NE(mine, others);
  EXPECT_FALSE(watched.data()["images"][1].contains("b"));
}

TEST(Watch, TellsNothingToStrangersAndNothingElseToAnybody) {
  const Watched watched;
  EXPECT_EQ(watched.status("/"), 403);
  EXPECT_EQ(watched.status("/state"), 403);
  EXPECT_EQ(watched.status(watched.root + "state", {{"Host", "elsewhere.example"}}), 403);
  for (const std::string path :
       {"../manifest.jsonl", "%2e%2e/%2e%2e/etc/passwd", "stats.jsonl", "render/tiny.1001.exr",
        "frame", "frame?frame=", "frame?frame=1", "frame?frame=../x", "frame?frame=1003&size=small",
        "refining?frame=1001", "refining?frame=1%00", "compared?frame=1001", "//etc/passwd"})
    EXPECT_EQ(watched.status(watched.root + path), 404) << path;
}

TEST(Watch, ShowsFramesInABrowserAsTheyAreMade) {
  if (::access("/usr/bin/chromium", X_OK) != 0) GTEST_SKIP() << "needs chromium";
  const Watched watched;
  // The rest is made once the browser has the page open, which takes it without being asked to.
  std::vector<std::string> words{"-c", "sleep 3; exec \"$0\" \"$@\"", DRENCH_PROGRAM};
  for (const std::string& word : watched.shot.words("run")) words.push_back(word);
  Child run("/bin/sh", words, watched.shot.folder());
  Ended ended;
  for (int k = 0; k < 4 && ended.out.find("rendered <b>4 of 4</b>") == std::string::npos; ++k) {
    ended = run_program("/usr/bin/chromium",
                        {"--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
                         "--user-data-dir=" + (watched.shot.folder() / "profile").string(),
                         "--virtual-time-budget=150000", "--dump-dom", watched.url},
                        watched.shot.folder());
  }
  EXPECT_EQ(run.wait().code, 0);
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_NE(ended.out.find("rendered <b>4 of 4</b>"), std::string::npos)
      << ended.out.substr(0, 400);
}

TEST(Watch, RefusesAFolderThatHoldsNoRun) {
  const TemporaryFolder folder;
  const Ended ended =
      run_program(DRENCH_PROGRAM, {"report", folder.path().string(), "--watch"}, folder.path());
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("shot.lock.toml"), std::string::npos) << ended.err;
}

TEST(Watch, RefusesAPortThatIsTaken) {
  const Watched watched;
  const size_t colon = watched.url.rfind(':') + 1;
  const std::string port = watched.url.substr(colon, watched.url.find('/', colon) - colon);
  const Ended ended = run_program(
      DRENCH_PROGRAM, {"report", watched.shot.out().string(), "--watch", "--port", port},
      watched.shot.folder());
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("port " + port), std::string::npos) << ended.err;
  const Ended alone =
      run_program(DRENCH_PROGRAM, {"report", watched.shot.out().string(), "--port", port},
                  watched.shot.folder());
  EXPECT_EQ(alone.code, 1);
  EXPECT_NE(alone.err.find("--watch"), std::string::npos) << alone.err;
}

}  // namespace
}  // namespace drench
