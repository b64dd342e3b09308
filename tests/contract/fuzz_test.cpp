// Mutations of valid input: only Error may come out of a parser, and soon. Seeds are fixed.
#include <gtest/gtest.h>

#include <random>

#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/files/obj_file.h"
#include "pipeline/contract/files/ply_file.h"
#include "pipeline/contract/shot/shot_file.h"
#include "tests/contract/shot_samples.h"

namespace drench {
namespace {

using test::TemporaryFolder;

/// One to four random edits: flipped, inserted, removed, copied and cut bytes, and words that
/// matter.
class Mutator {
 public:
  Mutator(uint32_t seed, std::vector<std::string> words)
      : random_(seed), words_(std::move(words)) {}

  std::string mutate(std::string text) {
    const unsigned edits = 1 + random_() % 4;
    for (unsigned i = 0; i < edits; ++i) edit(text);
    return text;
  }

 private:
  size_t below(size_t n) { return n == 0 ? 0 : random_() % n; }

  void edit(std::string& text) {
    const size_t at = below(text.size());
    const size_t length = 1 + below(std::min<size_t>(40, text.size() - at + 1));
    switch (random_() % 7) {
      case 0:
        if (!text.empty()) text[at] = char(text[at] ^ (1 << random_() % 8));
        break;
      case 1:
        text.insert(at, 1, char(random_()));
        break;
      case 2:
        text.erase(at, length);
        break;
      case 3:
        text.insert(below(text.size()), text.substr(at, length));
        break;
      case 4:
        text.resize(at);
        break;
      case 5:
        text.insert(at, words_[below(words_.size())]);
        break;
      case 6:
        text.replace(at, length, words_[below(words_.size())]);
        break;
    }
  }

  std::mt19937 random_;
  std::vector<std::string> words_;
};

/// Runs f on `count` mutations. Anything but Error escapes and fails the test.
template <class F>
void expect_only_errors(const std::string& seed_text, Mutator mutator, int count, F&& f) {
  int refused = 0;
  for (int i = 0; i < count; ++i) {
    const std::string text = mutator.mutate(seed_text);
    try {
      f(text);
    } catch (const Error& error) {
      ++refused;
      EXPECT_GT(std::string(error.what()).size(), 10u);
    } catch (const std::exception& other) {
      ADD_FAILURE() << "mutation " << i << ": " << other.what() << "\n" << text;
    }
  }
  EXPECT_GT(refused, count / 10);  // the mutations do reach the checks
  EXPECT_LT(refused, count);       // and some stay valid
}

TEST(Fuzz, ShotParserThrowsErrorsOnly) {
  const TemporaryFolder folder;
  test::write_shot_files(folder);
  const Mutator mutator(1, {"nan",
                            "inf",
                            "-",
                            "1e309",
                            "99999999999999999999",
                            "[[",
                            "]]",
                            "[",
                            "]",
                            "{",
                            "}",
                            "\"",
                            "'''",
                            "\\u0000",
                            "=",
                            ".",
                            "\n",
                            "quality",
                            "[[cloth]]\n",
                            "[[light]]\ntype=\"sphere\"\n",
                            "name=\"water\"\n",
                            "#",
                            "\xff",
                            "0x",
                            "_"});
  expect_only_errors(test::full_shot(), mutator, 10000, [&](const std::string& text) {
    const Shot shot = parse_shot(text, folder / "scene.toml");
    // What was accepted can be locked and read again.
    const std::string lock = shot_lock(shot);
    EXPECT_EQ(shot_lock(parse_shot(lock, folder / "shot.lock.toml")), lock);
  });
}

TEST(Fuzz, OverrideParserThrowsErrorsOnly) {
  const TemporaryFolder folder;
  test::write_shot_files(folder);
  const std::string small = "[[cloth]]\nname = \"sheet\"\n[[light]]\ntype = \"sun\"\n";
  const Mutator mutator(
      2, {"=", ".", "[", "]", "\"", "cloth.0.", "light.light.", "nan", "{a=1}", "\n"});
  expect_only_errors("cloth.sheet.cells=[3, 4]", mutator, 10000, [&](const std::string& set) {
    parse_shot(small, folder / "scene.toml", {.quality = "final", .set = {set}});
  });
}

void check_mesh(const TriangleMesh& mesh) {
  for (const auto& t : mesh.triangle) {
    ASSERT_LT(std::max({t.x, t.y, t.z}), mesh.position.size());
  }
  ASSERT_EQ(mesh.velocity.size(), mesh.position.size());
}

TEST(Fuzz, ObjReaderThrowsErrorsOnly) {
  const std::string seed =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nf 1/1 2/2 3/1 4/2\n"
      "f -1 -2 -3\n# end\n";
  const Mutator mutator(3, {"-1", "0", "4294967296", "-9223372036854775808", "nan", "1e999", "/",
                            "//", "\\\n", "f", "v ", "\n"});
  expect_only_errors(seed, mutator, 20000,
                     [](const std::string& text) { check_mesh(read_obj("fuzz.obj", text)); });
}

TEST(Fuzz, PlyReadersThrowErrorsOnly) {
  const TemporaryFolder folder;
  const std::string ascii =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nproperty list uchar int extra\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n"
      "0 0 0 0\n1 0 0 1 5\n0 1 0 2 7 8\n3 0 1 2\n";
  TriangleMesh mesh;
  mesh.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.velocity = mesh.position;
  mesh.triangle = {{0, 1, 2}};
  write_mesh(folder / "seed.ply", mesh);
  const std::vector<std::string> words{"4294967295",
                                       "-1",
                                       "18446744073709551615",
                                       "1e30",
                                       "nan",
                                       "list",
                                       "double",
                                       "char",
                                       "\n",
                                       "property list int int vertex_indices\n",
                                       "element face 9\n",
                                       "ascii",
                                       std::string(4, '\xff'),
                                       std::string(4, '\0')};
  const auto read = [](const std::string& text) { check_mesh(read_ply("fuzz.ply", text)); };
  expect_only_errors(ascii, Mutator(4, words), 10000, read);
  expect_only_errors(read_text(folder / "seed.ply"), Mutator(5, words), 10000, read);
}

}  // namespace
}  // namespace drench
