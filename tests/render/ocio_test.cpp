// View transforms of OpenColorIO configs that the tests write, against the closed forms they say.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "render/color/color.h"
#include "render/display/view_transform.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::error_of;
using drench::test::TemporaryFolder;
namespace {

namespace fs = std::filesystem;

/// Greys and colours from black to beyond white.
Film chart() {
  Film film{6, 5, {}};
  for (int k = 0; k < film.width * film.height; ++k) {
    const float v = 0.04f * float(k);
    film.rgba.insert(film.rgba.end(), {v, k % 2 ? v : 0.5f * v, k % 3 ? v : 0.2f, 1});
  }
  return film;
}

std::string scale_row(double gain) {
  const std::string g = std::to_string(gain);
  return g + ", 0, 0, 0, 0, " + g + ", 0, 0, 0, 0, " + g + ", 0, 0, 0, 0, 1";
}

/// A config whose display takes x to (gain x)^(1/2.2), by name or by a swap of red and blue.
std::string config_text(double gain, const std::string& scene_space, const std::string& role) {
  return "ocio_profile_version: 2\nstrictparsing: true\nroles:\n  default: raw\n"
         "  scene_linear: " +
         scene_space + "\n" + role +
         "displays:\n  Monitor:\n    - !<View> {name: Film look, colorspace: out}\n"
         "    - !<View> {name: Swapped, colorspace: swapped}\n"
         "  Projector:\n    - !<View> {name: Plain, colorspace: raw}\n"
         "colorspaces:\n"
         "  - !<ColorSpace>\n    name: " +
         scene_space +
         "\n"
         "  - !<ColorSpace>\n    name: raw\n    isdata: true\n"
         "  - !<ColorSpace>\n    name: out\n    from_reference: !<GroupTransform>\n      "
         "children:\n"
         "        - !<MatrixTransform> {matrix: [" +
         scale_row(gain) +
         "]}\n"
         "        - !<ExponentTransform> {value: [2.2, 2.2, 2.2, 1], direction: inverse}\n"
         "  - !<ColorSpace>\n    name: swapped\n    from_reference: !<MatrixTransform> "
         "{matrix: [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1]}\n";
}

class OcioViewTest : public testing::Test {
 protected:
  fs::path config(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  fs::path plain(double gain = 0.5) const {
    return config("config.ocio", config_text(gain, "ACEScg", ""));
  }
  const TemporaryFolder folder_;
};

void expect_shown(const std::vector<uint8_t>& rgb, const Film& film, auto&& closed_form) {
  for (size_t p = 0; p < film.rgba.size() / 4; ++p) {
    const float* x = &film.rgba[4 * p];
    const V3f shown = closed_form(V3f(x[0], x[1], x[2]));
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(rgb[3 * p + size_t(c)], std::clamp(shown[c], 0.f, 1.f) * 255, 1) << p;
  }
}

V3f half_to_gamma(const V3f& x) {
  const auto encode = [](float v) { return std::pow(std::max(0.5f * v, 0.f), 1 / 2.2f); };
  return {encode(x.x), encode(x.y), encode(x.z)};
}

TEST_F(OcioViewTest, ShowsWhatTheConfigSays) {
  const Film film = chart();
  // The first display and view unless others are named.
  expect_shown(ViewTransform({plain(), "", ""})(film), film, half_to_gamma);
  expect_shown(ViewTransform({plain(), "Monitor", "Swapped"})(film), film,
               [](const V3f& x) { return V3f(x.z, x.y, x.x); });
  expect_shown(ViewTransform({plain(), "Projector", ""})(film), film,
               [](const V3f& x) { return x; });
}

TEST_F(OcioViewTest, TakesTheConfigFromTheEnvironment) {
  ASSERT_EQ(setenv("OCIO", plain().c_str(), 1), 0);
  const Film film = chart();
  expect_shown(ViewTransform({"", "Monitor", ""})(film), film, half_to_gamma);
  // Nothing asked for: the built-in transform, whatever the environment has.
  EXPECT_EQ(ViewTransform(ViewSettings{})(film), ViewTransform()(film));
  EXPECT_EQ(ViewTransform(ViewSettings{}).key(), "");
  unsetenv("OCIO");
  EXPECT_NE(error_of([] { ViewTransform({"", "Monitor", ""}); }).find("$OCIO"), std::string::npos);
}

// A config without the name ACEScg: by way of its role for ACES2065-1. AP1 to AP0 as published.
TEST_F(OcioViewTest, FindsItsWayByTheInterchangeRole) {
  const fs::path file = config("aces.ocio", config_text(0.5, "ACES - ACES2065-1",
                                                        "  aces_interchange: ACES - ACES2065-1\n"));
  const Film film = chart();
  expect_shown(ViewTransform({file, "", ""})(film), film, [](const V3f& x) {
    return half_to_gamma({0.695452f * x.x + 0.140679f * x.y + 0.163869f * x.z,
                          0.044795f * x.x + 0.859671f * x.y + 0.095534f * x.z,
                          -0.005526f * x.x + 0.004025f * x.y + 1.001501f * x.z});
  });
}

TEST_F(OcioViewTest, KeyTellsWhatIsDoneNotWhatItIsCalled) {
  const std::string key = ViewTransform({plain(), "", ""}).key();
  EXPECT_NE(key, "");
  EXPECT_EQ(
      ViewTransform({config("other.ocio", config_text(0.5, "ACEScg", "")), "Monitor", "Film look"})
          .key(),
      key);
  EXPECT_NE(ViewTransform({plain(0.6), "", ""}).key(), key);
  EXPECT_NE(ViewTransform({plain(), "", "Swapped"}).key(), key);
}

TEST_F(OcioViewTest, SaysWhatThereIsWhenANameIsWrong) {
  const auto error = [&](const ViewSettings& settings) {
    return error_of([&] { ViewTransform{settings}; });
  };
  const std::string display = error({plain(), "Television", ""});
  for (const char* part : {"Television", "Monitor", "Projector", "config.ocio", "view.display"})
    EXPECT_NE(display.find(part), std::string::npos) << display;
  const std::string view = error({plain(), "Monitor", "Noir"});
  for (const char* part : {"Noir", "Film look", "Swapped"})
    EXPECT_NE(view.find(part), std::string::npos) << view;
  EXPECT_NE(error({folder_ / "none.ocio", "", ""}).find("none.ocio"), std::string::npos);
  EXPECT_NE(error({config("bad.ocio", "hello"), "", ""}).find("bad.ocio"), std::string::npos);
  EXPECT_NE(error({config("lost.ocio", config_text(1, "linear", "")), "", ""}).find("ACEScg"),
            std::string::npos);
}

}  // namespace
}  // namespace drench::render::test
