// Meshes as other programs write them: what they mean is taken, what is dropped is said.

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/files/named_file.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/geometry/weld.h"
#include "pipeline/contract/log.h"
#include "tests/contract/box_mesh.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using test::error_of;
using test::TemporaryFolder;

/// What reading a file warned of.
class ForeignMesh : public ::testing::Test {
 protected:
  ForeignMesh() { forget_warnings(); }
  ~ForeignMesh() override { forget_warnings(); }

  TriangleMesh read(const std::string& name, const std::string& content,
                    CornerData corners = CornerData::uv_and_normal) {
    test::write_quickly(folder_ / name, content);
    return read_mesh(folder_ / name, corners);
  }

  static std::string warnings() {
    std::string all;
    for (const LoggedWarning& warning : logged_warnings()) all += warning.text + "\n";
    return all;
  }

  TemporaryFolder folder_;
};

constexpr const char* triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

TEST_F(ForeignMesh, AByteOrderMarkIsNoVertex) {
  EXPECT_EQ(read("bom.obj", std::string("\xef\xbb\xbf") + triangle).position.size(), 3u);
}

TEST_F(ForeignMesh, Utf16IsReadInEitherByteOrder) {
  for (const bool big : {false, true}) {
    std::string wide = big ? "\xfe\xff" : "\xff\xfe";
    for (const char* c = triangle; *c; ++c) {
      if (big) wide += '\0';
      wide += *c;
      if (!big) wide += '\0';
    }
    EXPECT_EQ(read("wide.obj", wide).triangle.size(), 1u);
    const std::string error = error_of([&] { read("cut.obj", wide + "x"); });
    EXPECT_NE(error.find("UTF-16"), std::string::npos) << error;
    const std::string unmarked = error_of([&] { read("unmarked.obj", wide.substr(2)); });
    EXPECT_NE(unmarked.find("UTF-16"), std::string::npos) << unmarked;
  }
}

std::string with_line_ends(const std::string& text, const std::string& end) {
  std::string with;
  for (const char c : text) with += c == '\n' ? end : std::string(1, c);
  return with;
}

TEST_F(ForeignMesh, LinesMayEndWithACarriageReturn) {
  for (const std::string end : {"\r", "\r\n"}) {
    const std::string text = with_line_ends(triangle, end);
    EXPECT_EQ(read("lines.obj", text).triangle.size(), 1u);
    EXPECT_EQ(read("mixed.obj", text + "\n" + triangle).triangle.size(), 2u);
    EXPECT_NE(error_of([&] { read("bad.obj", text + "v 1 x 2" + end); }).find("bad.obj:5:"),
              std::string::npos);
  }
}

TEST_F(ForeignMesh, ABackslashJoinsLinesThatAreRead) {
  const TriangleMesh mesh =
      read("joined.obj",
           "# by C:\\tools\\\nv 0 0 0 # origin \\\nv 1 0 0\ng C:\\\nv 0 \\ \t\n1 0\n"
           "f 1 \\\r\n2 \\\n3\nf 1 3 \\\n2\\");
  ASSERT_EQ(mesh.position.size(), 3u);
  EXPECT_EQ(mesh.position[2], Imath::V3f(0, 1, 0));
  ASSERT_EQ(mesh.triangle.size(), 2u);
  EXPECT_EQ(mesh.triangle[1], Imath::Vec3<uint32_t>(0, 2, 1));
}

TEST_F(ForeignMesh, DecimalCommasAreTakenAndSaid) {
  const TriangleMesh mesh = read("comma.obj", "v 0 0 0\nv 1,5 0 0\nv 0 2,25e0 0\nf 1 2 3\n");
  EXPECT_EQ(mesh.position[1], Imath::V3f(1.5f, 0, 0));
  EXPECT_EQ(mesh.position[2], Imath::V3f(0, 2.25f, 0));
  EXPECT_NE(warnings().find("2 numbers have a decimal comma"), std::string::npos) << warnings();
}

TEST_F(ForeignMesh, CommasBesidePointsAreRefused) {
  for (const char* text : {"v 0 0 0\nv 1.5 0 0\nv 0 1,5 0\nf 1 2 3\n",
                           "v 0 0 0\nv 1,5 0 0\nv 0 1.5 0\nf 1 2 3\n", "v 0,0,0\n"}) {
    const std::string error = error_of([&] { read("both.obj", text); });
    EXPECT_NE(error.find("decimal comma"), std::string::npos) << error;
  }
}

/// A PLY of a right triangle, of one byte order.
std::string binary_ply(bool big, const std::string& more = "") {
  std::string text = fmt::format(
      "ply\nformat binary_{}_endian 1.0\n{}element vertex 3\nproperty double x\n"
      "property float y\nproperty short z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n",
      big ? "big" : "little", more);
  const auto put = [&](auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    if (big) std::reverse(bytes.begin(), bytes.end());
    text += bytes;
  };
  for (int k = 0; k < 3; ++k) put(double(k == 1) * 1.5), put(float(k == 2) * 0.1f), put(short(-3));
  put(uint8_t(3));
  for (const int32_t index : {0, 1, 2}) put(index);
  return text;
}

TEST_F(ForeignMesh, BothByteOrdersOfPlyAreOneMesh) {
  const TriangleMesh little = read("little.ply", binary_ply(false)),
                     big = read("big.ply", binary_ply(true));
  EXPECT_EQ(little.position[1], Imath::V3f(1.5f, 0, -3));
  EXPECT_EQ(big.position, little.position);
  EXPECT_EQ(big.triangle, little.triangle);
}

// The first byte of the data is a line feed.
TEST_F(ForeignMesh, HeadersOfPlyMayEndLinesWithACarriageReturn) {
  const std::string head =
      "ply\nformat binary_little_endian 1.0\ncomment x\nelement vertex 3\nproperty char x\n"
      "property char y\nproperty char z\nelement face 1\n"
      "property list uchar uchar vertex_indices\nend_header\n";
  const std::string body("\n\0\0\1\0\0\0\r\0\3\0\1\2", 13);
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    const TriangleMesh mesh = read("lines.ply", with_line_ends(head, end) + body);
    EXPECT_EQ(mesh.position[0], Imath::V3f(10, 0, 0));
    EXPECT_EQ(mesh.position[2], Imath::V3f(0, 13, 0));
    EXPECT_EQ(mesh.triangle.size(), 1u);
  }
}

TEST_F(ForeignMesh, CommentsOfPlyMayBeLong) {
  std::string many = "comment " + std::string(100'000, 'x') + "\n";
  for (int k = 0; k < 20'000; ++k) many += "obj_info 1 2 3\n";
  EXPECT_EQ(read("long.ply", binary_ply(false, many)).triangle.size(), 1u);
}

TEST_F(ForeignMesh, AnAsciiPlyThatIsCutOffIsSaidToBe) {
  const std::string whole =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n";
  for (const std::string rest : {"", "3", "3 ", "3 0", "3 0 1 "}) {
    const std::string error = error_of([&] { read("cut.ply", whole + rest); });
    EXPECT_NE(error.find("cut off"), std::string::npos) << rest << ": " << error;
  }
}

TEST_F(ForeignMesh, TextureCoordinatesOfVerticesHaveThreeNames) {
  for (const auto& [u, v] : {std::pair{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}}) {
    const TriangleMesh mesh =
        read("named.ply", fmt::format("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                      "property float y\nproperty float z\nproperty float {}\n"
                                      "property float {}\nelement face 1\n"
                                      "property list uchar int vertex_indices\nend_header\n"
                                      "0 0 0 0.1 0.2\n1 0 0 0.3 0.4\n0 1 0 0.5 0.6\n3 0 1 2\n",
                                      u, v));
    ASSERT_EQ(mesh.uv.size(), 3u);
    EXPECT_EQ(mesh.uv[1], Imath::V2f(0.3f, 0.4f));
  }
}

// The ends of the line between two triangles have a texture coordinate in each of them.
constexpr const char* seam =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.5\nvn 0 0 1\n"
    "f 1/1/1 2/2/1 3/3/1\nf 1/4/1 3/3/1 4/2/1\n";

TEST_F(ForeignMesh, VerticesAreSplitAtASeamAndKeepTheirNumbers) {
  const TriangleMesh mesh = read("seam.obj", seam, CornerData::uv);
  ASSERT_EQ(mesh.position.size(), 5u);
  EXPECT_EQ(mesh.triangle[0], Imath::Vec3<uint32_t>(0, 1, 2));
  EXPECT_EQ(mesh.triangle[1], Imath::Vec3<uint32_t>(4, 2, 3));
  EXPECT_EQ(mesh.uv[0], Imath::V2f(0, 0));
  EXPECT_EQ(mesh.uv[4], Imath::V2f(0.5f, 0.5f));
  EXPECT_EQ(mesh.point, (std::vector<uint32_t>{0, 1, 2, 3, 0}));
  EXPECT_TRUE(mesh.normal.empty());
  // Whole for those who do not ask.
  const TriangleMesh whole = read("seam.obj", seam, CornerData::none);
  EXPECT_EQ(whole.position.size(), 4u);
  EXPECT_TRUE(whole.uv.empty() && whole.point.empty());
}

TEST_F(ForeignMesh, NormalsOfCornersAreKept) {
  const TriangleMesh mesh = read("normals.obj",
                                 "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 5\nvn 0 1 0\n"
                                 "f 1//1 2//1 3//1\nf 1//2 4//2 2//2\n");
  ASSERT_EQ(mesh.normal.size(), 6u);
  for (const uint32_t v : {mesh.triangle[0].x, mesh.triangle[0].y, mesh.triangle[0].z})
    EXPECT_EQ(mesh.normal[v], Imath::V3f(0, 0, 1));
  for (const uint32_t v : {mesh.triangle[1].x, mesh.triangle[1].y, mesh.triangle[1].z})
    EXPECT_EQ(mesh.normal[v], Imath::V3f(0, 1, 0));
}

TEST_F(ForeignMesh, TexturePlyOfFacesIsThatOfObj) {
  const TriangleMesh mesh =
      read("face.ply",
           "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
           "property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
           "property list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
           "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0.5 0.5 1 1 1 0\n",
           CornerData::uv);
  const TriangleMesh obj = read("seam.obj", seam, CornerData::uv);
  EXPECT_EQ(mesh.triangle, obj.triangle);
  EXPECT_EQ(mesh.uv, obj.uv);
  EXPECT_EQ(mesh.point, obj.point);
}

TEST_F(ForeignMesh, WhatNobodyNeedsRefusesNothing) {
  // A stray vertex that is no number, a line, a face of two corners, a texture coordinate of nan.
  const TriangleMesh mesh = read("odd.obj",
                                 "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan inf 0\nvt nan 0\nvt 1 0\n"
                                 "vt 0 1\nl 1 2\nf 1 2\nf 1/1 2/2 3/3\nf 3\n");
  EXPECT_EQ(mesh.triangle.size(), 1u);
  EXPECT_EQ(mesh.uv[0], Imath::V2f(0, 0));
  EXPECT_NE(warnings().find("2 faces of fewer than three corners"), std::string::npos);
  EXPECT_NE(warnings().find("odd.obj:9"), std::string::npos) << warnings();
  EXPECT_NE(warnings().find("1 texture coordinates are not finite"), std::string::npos);
  const std::string error =
      error_of([&] { read("used.obj", "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n"); });
  EXPECT_NE(error.find("vertex 2 that is not finite"), std::string::npos) << error;
}

TEST_F(ForeignMesh, ATextureCoordinateThatIsNotThereIsNone) {
  for (const std::string face : {"f 1/9 2/1 3/-7", "f 1//9 2//9 3//9", "f 1/9/9 2/1/1 3/1/1"}) {
    forget_warnings();
    const TriangleMesh mesh =
        read("lost.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5 0.5\nvn 0 1 0\n" + face + "\n");
    EXPECT_EQ(mesh.triangle.size(), 1u);
    EXPECT_NE(warnings().find("of 3 corners name a texture coordinate or normal that is not there"),
              std::string::npos)
        << warnings();
    for (const Imath::V2f& uv : mesh.uv) EXPECT_TRUE(uv == Imath::V2f(0) || uv == Imath::V2f(0.5f));
  }
  forget_warnings();
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
      "property list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 4 1 1 1 1\n";
  EXPECT_TRUE(read("lost.ply", ply).uv.empty());
  EXPECT_NE(warnings().find("3 of 3 corners"), std::string::npos) << warnings();
}

TEST_F(ForeignMesh, AFaceThatCrossesItselfIsNamed) {
  const std::string bow = "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3 4\n";
  const std::string error = error_of([&] { read("bow.obj", bow); });
  EXPECT_NE(error.find("bow.obj:6"), std::string::npos) << error;
  EXPECT_NE(error.find("crosses itself"), std::string::npos) << error;
}

/// A box of which every face has corners of its own, each off by up to `gap`.
std::string loose_box(float gap) {
  const TriangleMesh box = test::box_mesh(Imath::V3f(0), Imath::V3f(0.6f));
  std::string text;
  int n = 0;
  for (const auto& t : box.triangle) {
    for (const uint32_t v : {t.x, t.y, t.z}) {
      const Imath::V3f p = box.position[v] + Imath::V3f(gap) * float(n % 3 - 1) * 0.5f;
      text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", p.x, p.y, p.z);
      ++n;
    }
    text += "f -3 -2 -1\n";
  }
  return text;
}

TEST_F(ForeignMesh, HairlineGapsOfASolidAreClosedAndSaid) {
  test::write_quickly(folder_ / "split.obj", loose_box(0));
  EXPECT_EQ(read_closed_mesh(folder_ / "split.obj", 1).triangle.size(), 12u);
  EXPECT_EQ(warnings(), "");
  test::write_quickly(folder_ / "loose.obj", loose_box(2e-6f));
  const TriangleMesh mesh = read_closed_mesh(folder_ / "loose.obj", 1);
  std::set<std::array<float, 3>> places;
  for (const Imath::V3f& p : mesh.position) places.insert({p.x, p.y, p.z});
  EXPECT_EQ(places.size(), 8u);
  EXPECT_NE(warnings().find("hairline gaps were closed"), std::string::npos) << warnings();
}

TEST_F(ForeignMesh, AWiderGapIsRefusedWithItsWidth) {
  test::write_quickly(folder_ / "wide.obj", loose_box(1e-3f));
  const std::string error = error_of([&] { read_closed_mesh(folder_ / "wide.obj", 1); });
  EXPECT_NE(error.find("not closed"), std::string::npos) << error;
  EXPECT_NE(error.find("corners are 0.000866 apart"), std::string::npos) << error;
}

TEST_F(ForeignMesh, ADoubledOrTurnedFaceOfASolidIsNoGap) {
  test::write_box(folder_ / "box.obj", Imath::V3f(1));
  const std::string box = read_text(folder_ / "box.obj"), face = "f 1 5 7\n";
  std::string turned = box;
  turned.replace(turned.find(face), face.size(), "f 1 7 5\n");
  for (const auto& [text, reason] :
       {std::pair<std::string, std::string>{box + face, "more than once"},
        {turned, "one of them is turned"},
        {box + "v 0.5 0.5 0.5\nf 1 5 9\n", "3 triangles meet there"}}) {
    test::write_quickly(folder_ / "fault.obj", text);
    const std::string error = error_of([&] { read_closed_mesh(folder_ / "fault.obj", 1); });
    EXPECT_NE(error.find(reason), std::string::npos) << error;
    EXPECT_EQ(error.find("gaps"), std::string::npos) << error;
  }
}

TEST_F(ForeignMesh, NormalsAreTurnedWithTheirFaces) {
  TriangleMesh inward = test::box_mesh(Imath::V3f(-1), Imath::V3f(1));
  for (auto& t : inward.triangle) std::swap(t.y, t.z);
  for (const Imath::V3f& p : inward.position) inward.normal.push_back(-p.normalized());
  write_mesh(folder_ / "inward.ply", inward);
  const TriangleMesh mesh = read_closed_mesh(folder_ / "inward.ply", 1, CornerData::uv_and_normal);
  for (size_t v = 0; v < 8; ++v) EXPECT_GT(mesh.normal[v].dot(mesh.position[v]), 0);
}

TEST_F(ForeignMesh, NamesOfWindowsAndPercentSignsAreFound) {
  const std::filesystem::path folder = folder_.path();
  std::filesystem::create_directories(folder / "meshes");
  test::write_box(folder / "meshes/box.obj", Imath::V3f(1));
  test::write_box(folder / "100%done.obj", Imath::V3f(1));
  test::write_box(folder / "box.1001.obj", Imath::V3f(1));
  EXPECT_EQ(named_file(folder, "meshes/box.obj"), folder / "meshes/box.obj");
  EXPECT_EQ(warnings(), "");
  EXPECT_EQ(named_file(folder, "meshes\\box.obj"), folder / "meshes/box.obj");
  EXPECT_NE(warnings().find("write paths with slashes"), std::string::npos);
  EXPECT_EQ(named_file(folder, "none\\box.obj"), folder / "none\\box.obj");
  EXPECT_EQ(named_file("", "box.obj"), std::filesystem::current_path() / "box.obj");
  EXPECT_NO_THROW(named_file("", ""));
  EXPECT_FALSE(is_sequence(folder / "100%done.obj"));
  EXPECT_TRUE(is_sequence(folder / "box.%04d.obj"));
  EXPECT_NE(hint_on_name("box.####.obj").find("%04d"), std::string::npos);
}

TEST_F(ForeignMesh, StlUnderTheNameOfPlyIsNamed) {
  const std::string binary =
      std::string(80, 'x') + std::string("\1\0\0\0", 4) + std::string(50, '\0');
  for (const std::string& text : {std::string("solid box\nfacet normal 0 0 1\n"), binary})
    EXPECT_NE(error_of([&] { read("box.ply", text); }).find("looks like STL"), std::string::npos);
}

TEST_F(ForeignMesh, IndicesFromZeroAreSaidToCountFromOne) {
  const std::string text =
      error_of([&] { read("box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"); });
  EXPECT_NE(text.find("box.obj:4"), std::string::npos) << text;
  EXPECT_NE(text.find("count from 1"), std::string::npos) << text;
}

TEST_F(ForeignMesh, VerticesOnFreeEdgesAreWelded) {
  // Two squares that share the line x = 1, each with vertices of its own there.
  const TriangleMesh mesh = read("two.obj",
                                 "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                 "v 1 0 1e-6\nv 2 0 0\nv 2 1 0\nv 1 1 0\n"
                                 "f 1 2 3 4\nf 5 6 7 8\n");
  EXPECT_EQ(weld(mesh, 0).count, 0u);
  EXPECT_EQ(weld(mesh, 1e-7).count, 1u);  // one pair is at one place
  const Welded welded = weld(mesh, 1e-5);
  EXPECT_EQ(welded.count, 2u);
  EXPECT_NEAR(welded.widest, 1e-6, 1e-12);
  EXPECT_EQ(welded.first, (std::vector<uint32_t>{0, 1, 2, 3, 1, 5, 6, 2}));
  EXPECT_EQ(free_edges(mesh, welded.first).size(), 6u);
  EXPECT_EQ(free_edges(mesh, points_of(mesh)).size(), 8u);
}

}  // namespace
}  // namespace drench
