// The report: its figures are those of stats.jsonl, it shows every frame, and it loads nothing.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "pipeline/driver/json_lines.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/report/jpeg.h"
#include "pipeline/driver/report/report_data.h"
#include "pipeline/driver/report/svg_plot.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace test;
using nlohmann::json;

// ---- plots ----

TEST(RoundTicks, AreRoundFewAndWithinTheRange) {
  EXPECT_EQ(round_ticks(0, 10, 6), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(round_ticks(1001, 1048, 7), (std::vector<double>{1010, 1020, 1030, 1040}));
  EXPECT_EQ(round_ticks(3, 3, 5), (std::vector<double>{3}));
  for (double low = -1e-3; low > -1e6; low *= 7)
    for (double length = 1e-4; length < 1e7; length *= 3) {
      const std::vector<double> ticks = round_ticks(low, low + length, 5);
      ASSERT_GE(ticks.size(), 1u) << low << " " << length;
      EXPECT_LE(ticks.size(), 5u) << low << " " << length;
      EXPECT_GE(ticks.front(), low - 1e-6 * length);
      EXPECT_LE(ticks.back(), low + length * (1 + 1e-6));
    }
}

TEST(SvgPlot, HasEveryValueAndEscapesNames) {
  const double none = std::nan("");
  const Plot plot{.title = "a <b> & \"c\"",
                  .x_name = "frame",
                  .unit = "m/s",
                  .series = {{"one", {1, 2, 3}, {0.5, none, 2.25}}, {"two", {1, 2, 3}, {1, 2, 3}}}};
  const std::string svg = svg_plot(plot);
  EXPECT_NE(svg.find("a &lt;b&gt; &amp; &quot;c&quot;"), std::string::npos);
  EXPECT_EQ(svg.find("<b>"), std::string::npos);
  EXPECT_NE(svg.find("<title>frame 3: 2.25 m/s, one</title>"), std::string::npos) << svg;
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg_plot({.title = "", .x_name = "", .unit = "", .series = {{"x", {1}, {none}}}}), "");
}

TEST(SvgPlot, TakesAnyValues) {
  constexpr double most = std::numeric_limits<double>::max();
  for (const bool logarithmic : {false, true})
    for (const Plot::Kind kind : {Plot::Kind::lines, Plot::Kind::stacked_bars})
      for (const double value : {0.0, -1.0, 1e-300, 1e300, most, -most}) {
        const std::string svg = svg_plot({.title = "t",
                                          .x_name = "x",
                                          .unit = "",
                                          .series = {{"s", {1, 1, 2}, {value, value, 1}}},
                                          .kind = kind,
                                          .logarithmic = logarithmic});
        EXPECT_LT(svg.size(), 20000u);
      }
}

// ---- pictures ----

TEST(Jpeg, ComesBackAsItWas) {
  Picture picture{64, 48, std::vector<uint8_t>(3 * 64 * 48)};
  for (size_t k = 0; k < picture.rgb.size(); ++k)
    picture.rgb[k] = uint8_t(128 + 100 * std::sin(0.002 * double(k)));
  const std::vector<uint8_t> bytes = jpeg_bytes(picture, 95);
  const TemporaryFolder folder;
  write_quickly(folder / "a.jpg", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const Ended ended = run_program(
      "/bin/sh",
      {"-c", "exec ffmpeg -v error -i \"$0\" -f rawvideo -pix_fmt rgb24 -", folder / "a.jpg"},
      folder.path());
  if (ended.code == 127) GTEST_SKIP() << "needs ffmpeg";
  ASSERT_EQ(ended.out.size(), picture.rgb.size()) << ended.err;
  for (size_t k = 0; k < picture.rgb.size(); ++k)
    ASSERT_NEAR(uint8_t(ended.out[k]), picture.rgb[k], 8) << k;
}

TEST(DataUrl, IsBase64) {
  const auto url = [](const std::string& text) {
    return data_url("t", {text.begin(), text.end()}).substr(14);
  };
  EXPECT_EQ(data_url("t", {}), "data:t;base64,");
  EXPECT_EQ(url("M"), "TQ==");
  EXPECT_EQ(url("Ma"), "TWE=");
  EXPECT_EQ(url("Man"), "TWFu");
  EXPECT_EQ(url("\xff\xfe\xfd\xfc"), "//79/A==");
}

TEST(ProbeTable, LeavesOutWhatIsNoRow) {
  const ProbeTable table = parse_probe("p", "# a\n# b\ntime [s],h [m]\n0,1.5\n1,\nx\n2,3\n");
  EXPECT_EQ(table.comments, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(table.columns, (std::vector<std::string>{"time [s]", "h [m]"}));
  ASSERT_EQ(table.values[1].size(), 3u);
  EXPECT_EQ(table.values[1][0], 1.5);
  EXPECT_TRUE(std::isnan(table.values[1][1]));
  EXPECT_EQ(table.values[0][2], 2);
}

// ---- the page ----

/// A shot that was run, and the report of it.
class Reported {
 public:
  explicit Reported(const std::vector<std::string>& more = {}) : shot(4) {
    EXPECT_EQ(shot.run("run", more).code, 0);
    write();
  }
  void write(const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"report", shot.out().string()};
    words.insert(words.end(), more.begin(), more.end());
    const Ended ended = run_program(DRENCH_PROGRAM, words, shot.folder());
    EXPECT_EQ(ended.code, 0) << ended.err;
    page = text_of(file());
  }
  std::filesystem::path file() const { return shot.out() / layout::report; }
  json data() const {
    const std::string mark = "id=\"data\">";
    const size_t begin = page.find(mark) + mark.size();
    return json::parse(page.substr(begin, page.find("</script>", begin) - begin));
  }

  TinyShot shot;
  std::string page;
};

size_t count_of(const std::string& text, const std::string& what) {
  size_t count = 0;
  for (size_t at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(Report, HasTheFiguresOfTheStatistics) {
  const Reported reported;
  const json rows = reported.data()["rows"];
  std::map<std::string, int> counts;
  for (const json& line : read_json_lines(reported.shot.out() / layout::stats)) {
    if (line["step"] == "run" || line["step"] == "warning") continue;
    ++counts[line["step"]];
    const json& of_step = rows[line["step"].get<std::string>()];
    EXPECT_NE(std::find(of_step.begin(), of_step.end(), line), of_step.end()) << line;
    if (line["step"] != "simulate") continue;
    EXPECT_NE(reported.page.find(fmt::format("frame {}: {:.4g} m/s", line["frame"].get<int>(),
                                             line["max_speed"].get<double>())),
              std::string::npos)
        << line;
  }
  EXPECT_EQ(counts.at("simulate"), 3);
  for (const auto& [step, count] : counts) EXPECT_EQ(rows[step].size(), size_t(count)) << step;
  EXPECT_EQ(count_of(reported.page, "<button aria-label=\"frame "), 4u);
  EXPECT_EQ(reported.data()["images"].size(), 4u);
  for (const char* id : {"frames", "stages", "simulation", "surface", "picture", "probes", "limits",
                         "plan", "files", "runs"})
    EXPECT_EQ(count_of(reported.page, fmt::format("<section id=\"{}\">", id)), 1u) << id;
  EXPECT_NE(reported.page.find("tiny.toml --out "), std::string::npos);
}

TEST(Report, ConservesMomentumAndVolumeInItsFigures) {
  const Reported reported;
  for (const json& row : reported.data()["rows"]["mesh"])
    EXPECT_NEAR(row["surface_l"].get<double>(), row["particles_l"].get<double>(),
                0.1 * row["particles_l"].get<double>());
  // A ball of water and a sheet fall freely: momentum is mass times g t, and the sheet's.
  const json first = reported.data()["rows"]["simulate"][0];
  const double water = reported.data()["rows"]["mesh"][0]["particles_l"];
  EXPECT_NEAR(first["momentum"][1].get<double>(), -water * 9.81 * first["time"].get<double>(),
              0.05 * water);
  EXPECT_NEAR(first["momentum"][0].get<double>(), 0, 0.01 * water);
}

TEST(Report, LoadsNothing) {
  const Reported reported;
  EXPECT_NE(reported.page.find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(reported.page.find("http:"), std::string::npos);
  EXPECT_EQ(reported.page.find("https:"), std::string::npos);
  EXPECT_EQ(count_of(reported.page, "src=\""), count_of(reported.page, "src=\"data:"));
  EXPECT_EQ(reported.page.find("url("), std::string::npos);
}

TEST(Report, ShowsNamesAsText) {
  const Reported reported({"--set", "shot.name=\"a<script><img src=x>\""});
  EXPECT_EQ(reported.page.find("<img src=x>"), std::string::npos);
  EXPECT_NE(reported.page.find("&lt;img src=x&gt;"), std::string::npos);
  EXPECT_EQ(reported.data()["shot"], "a<script><img src=x>");
}

TEST(Report, ComparesWithAnotherRun) {
  Reported reported;
  const TinyShot other(3);
  ASSERT_EQ(other.run("run", {"--set", "camera.fov_deg=30"}).code, 0);
  reported.write({"--with", other.out().string()});
  const json images = reported.data()["images"];
  ASSERT_EQ(images.size(), 4u);
  EXPECT_EQ(images[0]["b"], "b1001");
  EXPECT_FALSE(images[3].contains("b"));
}

TEST(Report, OfAnUnfinishedRunShowsWhatIsThere) {
  const TinyShot shot(4);
  ASSERT_EQ(shot.run("run", {"--frames", "1001-1002"}).code, 0);
  const Ended ended = run_program(DRENCH_PROGRAM, {"report", shot.out().string()}, shot.folder());
  ASSERT_EQ(ended.code, 0) << ended.err;
  const std::string page = text_of(shot.out() / layout::report);
  EXPECT_EQ(count_of(page, "<button aria-label=\"frame "), 2u);
  EXPECT_EQ(count_of(page, "<div class=\"missing\">"), 2u);
  EXPECT_NE(page.find("rendered <b>2 of 4</b>"), std::string::npos);
}

TEST(Report, RefusesAFolderThatHoldsNoRun) {
  const TemporaryFolder folder;
  const Ended ended =
      run_program(DRENCH_PROGRAM, {"report", folder.path().string()}, folder.path());
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("shot.lock.toml"), std::string::npos) << ended.err;
}

/// In a browser, with a script after the page's own that presses keys and says what came of it.
TEST(Report, IsUsedByKeysInABrowserAndAsksForNothing) {
  if (::access("/usr/bin/chromium", X_OK) != 0) GTEST_SKIP() << "needs chromium";
  const Reported reported;
  const std::filesystem::path page = reported.shot.folder() / "page.html",
                              requests = reported.shot.folder() / "requests.json";
  std::string text = reported.page;
  text.insert(text.find("</body>"), R"(<script>
    const said = [], say = () => said.push((viewer.open ? label.textContent.trim() : 'closed') + ' ' +
                                           (picture.naturalWidth > 0));
    const press = key => document.dispatchEvent(new KeyboardEvent('keydown', {key: key, cancelable: true}));
    const wait = () => picture.complete || new Promise(done => {
      for (const end of ['load', 'error']) picture.addEventListener(end, done, {once: true});
    });
    (async () => {
      document.querySelectorAll('.sheet button')[1].click(); await wait(); say();
      for (const key of ['ArrowRight', 'End', 'ArrowRight', 'Home', 'ArrowLeft']) { press(key); await wait(); say(); }
      const closed = new Promise(done => viewer.addEventListener('close', done));
      viewer.close(); await closed; say();
      const focused = document.activeElement.getAttribute('aria-label');
      document.title = said.join('|') + '|' + focused;
    })();
  </script>)");
  put_text(page, text);
  Ended ended;
  // The browser's virtual time waits for loads, and not for what is decoded. A browser at a loaded
  // machine may be asked for its page before the keys are pressed all the same.
  for (int k = 0; k < 4 && ended.out.find("|closed ") == std::string::npos; ++k) {
    ended = run_program(
        "/usr/bin/chromium",
        {"--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-extensions",
         "--user-data-dir=" + (reported.shot.folder() / "profile").string(),
         "--log-net-log=" + requests.string(), "--virtual-time-budget=20000", "--dump-dom",
         "file://" + page.string()},
        reported.shot.folder());
  }
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_NE(ended.out.find("<title>frame 1002 true|frame 1003 true|frame 1004 true|frame 1001 true|"
                           "frame 1001 true|frame 1004 true|closed true|frame 1004</title>"),
            std::string::npos)
      << ended.out.substr(0, 600);
  // What the browser itself asks its maker is no request of the page.
  EXPECT_EQ(text_of(requests).find("\"initiator\":\"file://"), std::string::npos);
}

}  // namespace
}  // namespace drench
