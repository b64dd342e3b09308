#include "pipeline/contract/files/mesh_file.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "pipeline/contract/files/files.h"
#include "pipeline/contract/files/ply_file.h"
#include "tests/same_bits.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

namespace fs = std::filesystem;
using test::error_of;
using test::expect_same_bits;
using test::TemporaryFolder;

/// A grid of 4 x 3 vertices with every column filled with values that no other place has.
TriangleMesh full_sheet() {
  TriangleMesh mesh;
  for (uint32_t j = 0; j < 3; ++j) {
    for (uint32_t i = 0; i < 4; ++i) {
      const float a = float(i) + 0.1f, b = float(j) + 0.01f;
      mesh.position.emplace_back(a, b, 1e-20f);
      mesh.velocity.emplace_back(-a, 3e7f * b, a * b);
      mesh.normal.emplace_back(0.f, 0.6f, 0.8f);
      mesh.uv.emplace_back(a / 4, b / 3);
      mesh.rest_position.emplace_back(b, a, -0.f);
      mesh.source.push_back(float(i)), mesh.age.push_back(a * b), mesh.wetness.push_back(b / 3);
      mesh.strain_max.push_back(a), mesh.strain_min.push_back(-b);
      mesh.stress_max.push_back(1e3f * a), mesh.stress_min.push_back(-1e-3f * b);
      if (i == 3 || j == 2) continue;
      const uint32_t k = j * 4 + i;
      mesh.triangle.emplace_back(k, k + 1, k + 5);
      mesh.triangle.emplace_back(k, k + 5, k + 4);
      mesh.contact.push_back(0), mesh.contact.push_back(1);
    }
  }
  return mesh;
}

TEST(MeshFile, ReturnsEveryColumnBitForBit) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = full_sheet();
  write_mesh(folder / "sheet.ply", mesh);
  expect_same_bits(read_mesh(folder / "sheet.ply"), mesh);
}

TEST(MeshFile, ReturnsOnlyTheColumnsThatWereThere) {
  const TemporaryFolder folder;
  TriangleMesh mesh = full_sheet();
  mesh.normal.clear();
  mesh.uv.clear();
  mesh.rest_position.clear();
  mesh.source.clear(), mesh.wetness.clear();
  mesh.contact.clear();
  write_mesh(folder / "sheet.ply", mesh);
  expect_same_bits(read_mesh(folder / "sheet.ply"), mesh);
  mesh.age[3] = std::numeric_limits<float>::infinity();
  EXPECT_NE(error_of([&] { write_mesh(folder / "sheet.ply", mesh); }).find("age of vertex 3"),
            std::string::npos);
}

// Blender's reader takes s and t for texture coordinates, and numbers of vertices are whole.
TEST(MeshFile, NamesColumnsAsOtherProgramsKnowThem) {
  const TemporaryFolder folder;
  TriangleMesh mesh = full_sheet();
  for (uint32_t v = 0; v < mesh.position.size(); ++v) mesh.id.push_back(100 + v);
  write_mesh(folder / "sheet.ply", mesh);
  const std::string text = read_text(folder / "sheet.ply");
  for (const char* property : {"float s", "float t", "float rest_x", "float strain_max", "int id"})
    EXPECT_NE(text.find(std::string("property ") + property + "\n"), std::string::npos) << property;
  mesh.id.clear();
  expect_same_bits(read_mesh(folder / "sheet.ply"), mesh);
}

TEST(MeshFile, HoldsAnEmptyMesh) {
  const TemporaryFolder folder;
  write_mesh(folder / "empty.ply", {});
  expect_same_bits(read_mesh(folder / "empty.ply"), {});
}

TEST(MeshFile, GivesEqualBytesForEqualMeshes) {
  const TemporaryFolder folder;
  const WrittenFile one = write_mesh(folder / "one.ply", full_sheet());
  const WrittenFile two = write_mesh(folder / "two.ply", full_sheet());
  EXPECT_EQ(one.digest, two.digest);
}

TEST(MeshFile, IsNotWrittenWithAValueThatIsNotFinite) {
  const TemporaryFolder folder;
  TriangleMesh mesh = full_sheet();
  mesh.velocity[7].y = std::numeric_limits<float>::quiet_NaN();
  const std::string text = error_of([&] { write_mesh(folder / "sheet.ply", mesh); });
  EXPECT_NE(text.find("vertex 7"), std::string::npos) << text;
  mesh.position[5].z = std::numeric_limits<float>::infinity();
  const std::string obj = error_of([&] { write_obj(folder / "sheet.obj", mesh); });
  EXPECT_NE(obj.find("vertex 5"), std::string::npos) << obj;
  EXPECT_TRUE(folder.names().empty());
}

/// Finite floats of any sign and exponent: bits drawn evenly.
Imath::V3f any_floats(std::mt19937& random) {
  Imath::V3f value;
  for (int k = 0; k < 3; ++k) {
    do value[k] = std::bit_cast<float>(uint32_t(random()));
    while (!std::isfinite(value[k]));
  }
  return value;
}

TEST(ObjFile, ReturnsPositionsAndTrianglesBitForBit) {
  const TemporaryFolder folder;
  std::mt19937 random(1);
  for (const uint32_t n :
       {3u, 9u, 10u, 99u, 100000u}) {  // indices of as many digits as there is room
    TriangleMesh mesh;
    for (uint32_t i = 0; i < n; ++i) {
      mesh.position.push_back(any_floats(random));
      mesh.triangle.emplace_back(i, n - 1 - i, n - 1);
    }
    mesh.position[1] = {-0.f, -1.17549435e-38f, -1.40129846e-45f};
    mesh.velocity.resize(n, Imath::V3f(0));
    write_obj(folder / "mesh.obj", mesh);
    expect_same_bits(read_mesh(folder / "mesh.obj"), mesh);
  }
}

// Normals are not read by read_mesh: as text, the index of a vertex is that of its normal.
TEST(ObjFile, HoldsANormalForEveryVertex) {
  const TemporaryFolder folder;
  TriangleMesh mesh = full_sheet();
  mesh.position.resize(3);
  mesh.velocity.resize(3);
  mesh.uv.clear();
  mesh.rest_position.clear();
  for (const auto& [name, values] : mesh_columns) (mesh.*values).clear();
  mesh.normal = {{0, 0.6f, 0.8f}, {1, 0, 0}, {0, -1, 1e-9f}};
  mesh.triangle = {{0, 1, 2}, {2, 1, 0}};
  mesh.contact = {0, 1};
  write_obj(folder / "mesh.obj", mesh);
  EXPECT_EQ(read_text(folder / "mesh.obj"),
            "# Drench: metres\nv 0.1 0.01 1e-20\nv 1.1 0.01 1e-20\nv 2.1 0.01 1e-20\n"
            "vn 0 0.6 0.8\nvn 1 0 0\nvn 0 -1 1e-09\nf 1//1 2//2 3//3\nf 3//3 2//2 1//1\n");
  EXPECT_EQ(read_mesh(folder / "mesh.obj").triangle, mesh.triangle);
}

TEST(ObjFile, IsACommentWithoutAMesh) {
  const TemporaryFolder folder;
  write_obj(folder / "empty.obj", {});
  EXPECT_EQ(read_text(folder / "empty.obj"), "# Drench: metres\n");
}

TEST(ObjFile, SaysThatItsFolderCannotBeWritten) {
  const TemporaryFolder folder;
  test::write_quickly(folder / "taken", "a file");
  const std::string text = error_of([&] { write_obj(folder / "taken/mesh.obj", full_sheet()); });
  EXPECT_NE(text.find("taken"), std::string::npos) << text;
  EXPECT_NE(text.find("a file stands where a folder is needed"), std::string::npos) << text;
}

constexpr const char* ascii_quad =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty double x\n"
    "property float y\nproperty float z\nproperty uchar red\nelement face 1\n"
    "property list uchar int vertex_index\nend_header\n"
    "0 0 0 255\n1 0 0 255\n+1 1e0 0 255\n0 1 0 255\n4 0 1 2 3\n";

// A square cut into two triangles keeps its area of 1 and its orientation along +z.
TEST(MeshFile, CutsPolygonsOfAsciiPlyIntoTriangles) {
  const TemporaryFolder folder;
  write_file_whole(folder / "quad.ply", ascii_quad);
  const TriangleMesh mesh = read_mesh(folder / "quad.ply");
  ASSERT_EQ(mesh.triangle.size(), 2u);
  Imath::V3f area(0);
  for (const auto& t : mesh.triangle) {
    const auto& x = mesh.position;
    area += 0.5f * (x[t.y] - x[t.x]).cross(x[t.z] - x[t.x]);
  }
  EXPECT_EQ(area, Imath::V3f(0, 0, 1));
  EXPECT_EQ(mesh.velocity, std::vector<Imath::V3f>(4, Imath::V3f(0)));
}

TEST(MeshFile, ReadsObjWithNegativeIndicesJoinedLinesAndTexture) {
  const TemporaryFolder folder;
  write_file_whole(folder / "quad.obj",
                   "# a square\no thing\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\r\n"
                   "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/2/1 \\\n 3/3/1\n"
                   "f -4/1 -2/3 -1/4\n");
  const TriangleMesh mesh = read_mesh(folder / "quad.obj", CornerData::uv);
  ASSERT_EQ(mesh.triangle.size(), 2u);
  EXPECT_EQ(mesh.triangle[0], Imath::Vec3<uint32_t>(0, 1, 2));
  EXPECT_EQ(mesh.triangle[1], Imath::Vec3<uint32_t>(0, 2, 3));
  ASSERT_EQ(mesh.uv.size(), 4u);
  EXPECT_EQ(mesh.uv[3], Imath::V2f(0, 1));
}

TEST(MeshFile, SaysWhatIsWrongWithABadFile) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  const std::string corners = "0 0 0\n1 0 0\n0 1 0\n";
  const std::vector<std::array<std::string, 3>> cases{
      {"a.ply", "solid thing", "STL"},
      {"a.ply", "plain thing", "header"},
      {"b.ply", "plx\nend_header\n", "not a PLY"},
      {"c.ply", head + corners + "3 0 1 3\n", "index 3"},
      {"d.ply", head + corners + "3 0 1 -1\n", "index"},
      {"e.ply", head + "0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n", "not finite"},
      {"f.ply", head + "0 0 1e39\n1 0 0\n0 1 0\n3 0 1 2\n", "not finite"},
      {"g.ply", head + corners, "cut off"},
      {"h.ply", head + corners + "2 0 1\n", "2 vertices"},
      {"i.ply", head + corners + "3 0 1 2\n7\n", "more data"},
      {"j.ply", "ply\nformat binary_middle_endian 1.0\nend_header\n", "binary_middle_endian"},
      {"k.ply",
       "ply\nformat ascii 1.0\nelement vertex 4000000000000\nproperty float x\nend_header\n0\n",
       "too short"},
      {"l.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n", "without its vertex"},
      {"m.obj", "v 0 0 inf\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 0 that is not finite"},
      {"n.obj", "v 0 0 0\nf 0 1 2\n", "n.obj:2"},
      {"o.obj", "v 0 0\n", "a number is expected"},
      {"p.obj", "", "no faces"},
      {"q.obj", "v 0 0 0\nf 1 1\n", "2 vertices"},
      {"r.stl", "solid", ".stl"},
  };
  const TemporaryFolder folder;
  for (const auto& [name, content, reason] : cases) {
    test::write_quickly(folder / name, content);
    const std::string text = error_of([&, &name = name] { read_mesh(folder / name); });
    EXPECT_NE(text.find(reason), std::string::npos) << name << ": " << text;
    EXPECT_NE(text.find(name), std::string::npos) << text;
  }
  EXPECT_NE(error_of([&] { read_mesh(folder / "none.ply"); }).find("does not exist"),
            std::string::npos);
}

TEST(MeshFile, NoticesEveryTruncation) {
  const TemporaryFolder folder;
  write_mesh(folder / "sheet.ply", full_sheet());
  const std::string whole = read_text(folder / "sheet.ply");
  for (size_t size = 0; size < whole.size(); ++size) {
    error_of([&] { read_ply("cut.ply", std::string_view(whole).substr(0, size)); });
  }
}

}  // namespace
}  // namespace drench
