// OpenColorIO in the dailies: what is shown, and what is made again when a config changes.

#include <gtest/gtest.h>

#include <fstream>

#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/driver/contact_sheet.h"
#include "pipeline/driver/targets.h"
#include "tests/driver/folder.h"

namespace drench {
namespace {

using test::TemporaryFolder;

/// A display that shows `gain` times a value as its code.
void write_config(const std::filesystem::path& file, const std::string& gain) {
  std::ofstream(file) << "ocio_profile_version: 2\nroles: {default: ACEScg, scene_linear: ACEScg}\n"
                         "displays:\n  Monitor:\n    - !<View> {name: Plain, colorspace: out}\n"
                         "colorspaces:\n  - !<ColorSpace> {name: ACEScg}\n"
                         "  - !<ColorSpace>\n    name: out\n"
                         "    from_reference: !<MatrixTransform> {matrix: ["
                      << gain << ", 0, 0, 0, 0, " << gain << ", 0, 0, 0, 0, " << gain
                      << ", 0, 0, 0, 0, 1]}\n";
}

class View : public testing::Test {
 protected:
  Shot shot(const std::string& view) const {
    std::ofstream(folder_.path() / "ball.toml")
        << "[[fluid.sphere]]\ncenter = [0, 1, 0]\nradius = 0.1\n"
        << view;
    return read_shot(folder_.path() / "ball.toml", {});
  }
  Targets targets(const std::string& view) const {
    return targets_of(shot(view), {1001}, {Step::render, Step::contact_sheet}, "cpu");
  }
  const TemporaryFolder folder_;
};

TEST_F(View, AChangedConfigMakesDailiesAgainAndRendersNothing) {
  const std::string section = "[view]\nocio_config = \"a.ocio\"\ndisplay = \"Monitor\"\n";
  write_config(folder_.path() / "a.ocio", "0.5");
  const Targets before = targets(section);
  EXPECT_EQ(targets(section + "view = \"Plain\"\n").dailies.digest, before.dailies.digest);
  const Targets built_in = targets("");
  EXPECT_NE(built_in.dailies.digest, before.dailies.digest);
  write_config(folder_.path() / "a.ocio", "0.25");
  const Targets after = targets(section);
  EXPECT_NE(after.dailies.digest, before.dailies.digest);
  EXPECT_NE(after.dailies.parts.at("view"), before.dailies.parts.at("view"));
  EXPECT_EQ(after.render.digest, before.render.digest);
  EXPECT_EQ(built_in.render.digest, before.render.digest);
}

TEST_F(View, IsThatOfTheContactSheet) {
  write_config(folder_.path() / "a.ocio", "0.5");
  render::Film film{64, 36, std::vector<float>(4 * 64 * 36, 0.6f)};
  render::write_exr(folder_.path() / "a.exr", film, {});
  const render::ViewTransform view(shot("[view]\nocio_config = \"a.ocio\"\n").view);
  const Picture sheet = contact_sheet({{1001, folder_.path() / "a.exr"}}, view);
  const size_t middle = size_t(sheet.height / 2) * size_t(sheet.width) + size_t(sheet.width / 2);
  EXPECT_NEAR(sheet.rgb[3 * middle], 0.3 * 255, 1);
}

}  // namespace
}  // namespace drench
