#include "core/io/mesh_io.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <random>
#include <sstream>
#include <string_view>

#include "core/error.h"
#include "core/io/ply_io.h"
#include "test/support/file_size_limit.h"
#include "test/support/temporary_folder.h"

namespace groundray::mesh_io_test {
namespace {

using ::testing::ElementsAre;
using testing::FileSizeLimit;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using testing::TemporaryFolder;

const Georeference prairie{{435000, 5150500, 0},
                           "NAD83 / UTM zone 15N (EPSG:26915)",
                           R"(PROJCRS["NAD83 / UTM zone 15N",ID["EPSG",26915]])"};

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <typename F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "no Error was thrown";
}

template <typename T>
T take(std::string_view& bytes) {
  T value;
  if (bytes.size() < sizeof value) throw std::runtime_error("the file is truncated");
  bytes.copy(reinterpret_cast<char*>(&value), sizeof value);
  bytes.remove_prefix(sizeof value);
  return value;
}

TriangleMesh two_triangles() {
  return {
      {{0, 0, 1}, {2.5, 0, 1.125}, {0, -3, 400}, {2.5, -3, 0.1}}, {{0, 2, 1}, {3, 1, 2}}, {0, 9}};
}

// Larger than a block of the writer, at positions that need a double's full precision.
TriangleMesh random_mesh() {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-50000, 50000);
  TriangleMesh mesh;
  for (int i = 0; i < 20011; ++i) {
    mesh.vertices_m.emplace_back(place(random), place(random), place(random) / 30);
  }
  std::uniform_int_distribution<std::uint32_t> vertex(0, 20010);
  for (int i = 0; i < 30011; ++i) {
    mesh.triangles.emplace_back(vertex(random), vertex(random), vertex(random));
    mesh.levels.push_back(static_cast<std::uint8_t>(random() % 12));
  }
  return mesh;
}

class MeshIo : public ::testing::Test {
 protected:
  std::filesystem::path in(const std::string& name) const { return folder_ / name; }
  TemporaryFolder folder_;
};

TEST_F(MeshIo, PlyHeaderNamesOriginCrsAndColumns) {
  write_ply(in("a.ply"), two_triangles(), prairie);
  EXPECT_THAT(bytes_of(in("a.ply")),
              StartsWith("ply\n"
                         "format binary_little_endian 1.0\n"
                         "comment origin_w 435000 5150500 0\n"
                         "comment crs NAD83 / UTM zone 15N (EPSG:26915)\n"
                         "comment crs_wkt PROJCRS[\"NAD83 / UTM zone 15N\",ID[\"EPSG\",26915]]\n"
                         "element vertex 4\n"
                         "property double x\n"
                         "property double y\n"
                         "property double z\n"
                         "element face 2\n"
                         "property list uchar uint vertex_indices\n"
                         "property uchar level\n"
                         "property uchar red\n"
                         "property uchar green\n"
                         "property uchar blue\n"
                         "end_header\n"));
}

TEST_F(MeshIo, PlyContainsEveryVertexTriangleAndLevel) {
  const TriangleMesh mesh = random_mesh();
  write_ply(in("a.ply"), mesh, prairie);
  const std::string file = bytes_of(in("a.ply"));
  const std::string_view end = "end_header\n";
  std::string_view body = std::string_view(file).substr(file.find(end) + end.size());
  for (const glm::dvec3& p : mesh.vertices_m) ASSERT_EQ(take<glm::dvec3>(body), p);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    ASSERT_EQ(take<std::uint8_t>(body), 3);
    ASSERT_EQ(take<glm::uvec3>(body), mesh.triangles[i]);
    ASSERT_EQ(take<std::uint8_t>(body), mesh.levels[i]);
    body.remove_prefix(3);
  }
  EXPECT_TRUE(body.empty());
}

TEST_F(MeshIo, PlyWithoutLevelsHasNeitherLevelsNorColours) {
  TriangleMesh mesh = two_triangles();
  mesh.levels.clear();
  write_ply(in("a.ply"), mesh, {});
  EXPECT_THAT(bytes_of(in("a.ply")), HasSubstr("vertex_indices\nend_header\n"));
  EXPECT_EQ(read_ply(in("a.ply")).comments, std::vector<std::string>{"origin_w 0 0 0"});
  const auto z = read_ply(in("a.ply")).cloud;
  EXPECT_THAT(z.column<double>("z"), ElementsAre(1, 1.125, 400, 0.1));
}

TEST_F(MeshIo, LinesOfALongCrsCanBeJoined) {
  Georeference far = prairie;
  far.crs_wkt.clear();
  for (int i = 0; i < 300; ++i) far.crs_wkt += fmt::format("A{} [\"b   {}\"], ", i, i * i);
  const std::string ascii = far.crs_wkt;
  far.crs_wkt += "96\u00b0W\nend";
  write_ply(in("a.ply"), two_triangles(), far);
  std::string joined;
  for (const std::string& comment : read_ply(in("a.ply")).comments) {
    EXPECT_LT(comment.size(), 240u);
    if (!comment.starts_with("crs_wkt ")) continue;
    EXPECT_NE(comment[8], ' ');
    EXPECT_NE(comment.back(), ' ');
    joined += comment.substr(8);
  }
  EXPECT_EQ(joined, ascii + R"(96\xc2\xb0W\x0aend)");
}

TEST_F(MeshIo, ObjRoundTripsDoubles) {
  const TriangleMesh mesh = random_mesh();
  write_obj(in("a.obj"), mesh, prairie);
  std::ifstream file(in("a.obj"));
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "# origin_w 435000 5150500 0");
  std::size_t vertices = 0, triangles = 0;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string key, x, y, z;
    words >> key >> x >> y >> z;
    if (key == "v") {
      ASSERT_EQ(glm::dvec3(std::stod(x), std::stod(y), std::stod(z)), mesh.vertices_m[vertices++]);
    } else if (key == "f") {
      ASSERT_EQ(glm::uvec3(std::stoul(x), std::stoul(y), std::stoul(z)),
                mesh.triangles[triangles++] + 1u);
    } else {
      ASSERT_EQ(key, "#");
      ASSERT_EQ(vertices, 0u);
    }
  }
  EXPECT_EQ(vertices, mesh.vertices_m.size());
  EXPECT_EQ(triangles, mesh.triangles.size());
}

struct Glb {
  std::string json;
  std::string binary;
};

Glb glb_of(const std::string& file) {
  std::string_view bytes = file;
  EXPECT_EQ(take<std::uint32_t>(bytes), 0x46546C67u);  // "glTF"
  EXPECT_EQ(take<std::uint32_t>(bytes), 2u);
  EXPECT_EQ(take<std::uint32_t>(bytes), file.size());
  Glb glb;
  for (auto* chunk : {&glb.json, &glb.binary}) {
    const auto size = take<std::uint32_t>(bytes);
    EXPECT_EQ(take<std::uint32_t>(bytes), chunk == &glb.json ? 0x4E4F534Au : 0x004E4942u);
    EXPECT_EQ(size % 4, 0u);
    *chunk = bytes.substr(0, size);
    bytes.remove_prefix(size);
  }
  EXPECT_TRUE(bytes.empty());
  return glb;
}

// The layout of 3D Systems: 80 bytes of text, a count, and 50 bytes per facet.
TEST_F(MeshIo, StlContainsTheCornersOfEachTriangle) {
  const TriangleMesh mesh = random_mesh();
  write_stl(in("a.stl"), mesh, {{435000.125, 5150500, -0.001}, "x", "y"});
  const std::string file = bytes_of(in("a.stl"));
  ASSERT_EQ(file.size(), 84 + 50 * mesh.triangles.size());
  EXPECT_THAT(file, StartsWith("origin_w 435000.125 5150500 -0.001    "));
  std::string_view bytes = std::string_view(file).substr(80);
  ASSERT_EQ(take<std::uint32_t>(bytes), mesh.triangles.size());
  for (const glm::uvec3& t : mesh.triangles) {
    const auto normal = take<glm::vec3>(bytes);
    std::array<glm::dvec3, 3> p;
    for (int k = 0; k < 3; ++k) {
      p[static_cast<std::size_t>(k)] = mesh.vertices_m[t[k]];
      ASSERT_EQ(take<glm::vec3>(bytes), glm::vec3(mesh.vertices_m[t[k]]));
    }
    EXPECT_EQ(take<std::uint16_t>(bytes), 0);
    const glm::dvec3 area = glm::cross(p[1] - p[0], p[2] - p[0]);
    if (area == glm::dvec3(0)) {
      EXPECT_EQ(normal, glm::vec3(0));
    } else {
      ASSERT_LT(glm::length(glm::dvec3(normal) - glm::normalize(area)), 1e-7);
    }
  }
  EXPECT_TRUE(bytes.empty());
  const glm::dvec3 long_m(-1.2345678901234567e-100);
  EXPECT_THAT(message_of([&] {
                write_stl(in("b.stl"), mesh, {long_m, "", ""});
              }),
              HasSubstr("is longer than the 80 characters of an STL's header; round the origin"));
}

TEST_F(MeshIo, PlyContainsColumnsOfVerticesAndTriangles) {
  const TriangleMesh mesh = random_mesh();
  MeshColumns columns{PointCloud(mesh.vertices_m.size()), PointCloud(mesh.triangles.size())};
  const auto sd = columns.vertices.add<float>("sd_m");
  const auto label = columns.vertices.add<std::uint16_t>("label");
  const auto filled = columns.triangles.add<std::uint8_t>("filled");
  for (std::size_t i = 0; i < sd.size(); ++i) {
    sd[i] = static_cast<float>(i) / 7;
    label[i] = static_cast<std::uint16_t>(3 * i);
  }
  for (std::size_t i = 0; i < filled.size(); ++i) filled[i] = i % 3 == 0;
  write_ply(in("a.ply"), mesh, prairie, columns);
  const std::string file = bytes_of(in("a.ply"));
  std::string_view bytes = file;
  bytes.remove_prefix(bytes.find("end_header\n") + 11);
  EXPECT_THAT(file.substr(0, file.size() - bytes.size()),
              HasSubstr("property double z\nproperty float sd_m\nproperty ushort label\n"));
  for (std::size_t i = 0; i < sd.size(); ++i) {
    ASSERT_EQ(take<glm::dvec3>(bytes), mesh.vertices_m[i]);
    ASSERT_EQ(take<float>(bytes), sd[i]);
    ASSERT_EQ(take<std::uint16_t>(bytes), label[i]);
  }
  for (std::size_t i = 0; i < filled.size(); ++i) {
    ASSERT_EQ(take<std::uint8_t>(bytes), 3);
    ASSERT_EQ(take<glm::uvec3>(bytes), mesh.triangles[i]);
    ASSERT_EQ(take<std::uint8_t>(bytes), mesh.levels[i]);
    bytes.remove_prefix(3);
    ASSERT_EQ(take<std::uint8_t>(bytes), filled[i]);
  }
  EXPECT_TRUE(bytes.empty());
}

TEST_F(MeshIo, ReportsInvalidColumns) {
  const TriangleMesh mesh = two_triangles();
  const auto error_of = [&](std::size_t rows, const std::string& name) {
    MeshColumns columns;
    columns.triangles = PointCloud(rows);
    columns.triangles.add<float>(name);
    return message_of([&] { write_ply(in("a.ply"), mesh, prairie, columns); });
  };
  EXPECT_THAT(error_of(3, "a"),
              HasSubstr("a.ply: columns of 3 rows do not match the element face, which has 2"));
  EXPECT_THAT(error_of(2, "level"),
              HasSubstr("face cannot have a column \"level\": the name is taken"));
  EXPECT_THAT(error_of(2, "a b"), HasSubstr("names must consist of visible ASCII characters"));
  EXPECT_THAT(error_of(2, ""), HasSubstr("names must consist of visible ASCII characters"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(MeshIo, GlbContainsFloatsThenIndices) {
  const TriangleMesh mesh = random_mesh();
  write_glb(in("a.glb"), mesh, prairie);
  const Glb glb = glb_of(bytes_of(in("a.glb")));
  std::string_view binary = glb.binary;
  for (const glm::dvec3& p : mesh.vertices_m) ASSERT_EQ(take<glm::vec3>(binary), glm::vec3(p));
  for (const glm::uvec3& t : mesh.triangles) ASSERT_EQ(take<glm::uvec3>(binary), t);
  EXPECT_TRUE(binary.empty());
}

TEST_F(MeshIo, GlbContainsItsGeoreference) {
  write_glb(in("a.glb"), two_triangles(), prairie);
  const std::string json = glb_of(bytes_of(in("a.glb"))).json;
  EXPECT_THAT(json, HasSubstr(R"("origin_w_m":[435000,5150500,0])"));
  EXPECT_THAT(json, HasSubstr(R"("crs_wkt":"PROJCRS[\"NAD83 / UTM zone 15N\",)"));
  // The bounds are those of the stored floats: 0.1 is not a float, so its rounded value is written.
  EXPECT_THAT(json, HasSubstr(R"("min":[0,-3,0.10000000149011612],"max":[2.5,0,400])"));
}

TEST_F(MeshIo, TheFileNameSelectsTheFormat) {
  for (const char* name : {"a.ply", "a.obj", "a.stl", "a.glb"}) {
    write_mesh(in(name), two_triangles(), prairie);
  }
  EXPECT_THAT(bytes_of(in("a.ply")), StartsWith("ply\n"));
  EXPECT_THAT(bytes_of(in("a.obj")), HasSubstr("\nv 0 0 1\nv 2.5 0 1.125\nv 0 -3 400\n"));
  EXPECT_THAT(bytes_of(in("a.glb")), StartsWith("glTF"));
  EXPECT_THAT(bytes_of(in("a.stl")), StartsWith("origin_w 435000 5150500 0 "));
  EXPECT_THAT(message_of([&] { write_mesh(in("a.dae"), two_triangles(), prairie); }),
              HasSubstr("a.dae: the name of a mesh must end in .ply, .obj, .stl or .glb"));
}

TEST_F(MeshIo, EmptyMeshesAreValidExceptInGlb) {
  write_stl(in("a.stl"), {}, prairie);
  EXPECT_EQ(bytes_of(in("a.stl")).size(), 84u);
  write_ply(in("a.ply"), {}, prairie);
  EXPECT_EQ(read_ply(in("a.ply")).cloud.rows(), 0u);
  write_obj(in("a.obj"), {}, prairie);
  EXPECT_THAT(message_of([&] { write_glb(in("a.glb"), {}, prairie); }),
              HasSubstr("a.glb: glTF does not support a mesh without triangles"));
  EXPECT_FALSE(std::filesystem::exists(in("a.glb")));
}

TEST_F(MeshIo, ReportsEveryFaultOfAMesh) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const glm::dvec3 bad :
       {glm::dvec3(1, nan, 1), glm::dvec3(nan, 0, 0), glm::dvec3(0, 0, 2e15)}) {
    TriangleMesh mesh = two_triangles();
    mesh.vertices_m[2] = bad;
    mesh.triangles[1].y = 4;
    mesh.levels.push_back(1);
    for (const char* name : {"a.ply", "a.obj", "a.stl", "a.glb"}) {
      const std::string message = message_of([&] { write_mesh(in(name), mesh, prairie); });
      EXPECT_THAT(message, HasSubstr("there are 3 levels for 2 triangles"));
      EXPECT_THAT(message, HasSubstr("vertex 2 must have a finite position within 1e+15 m"));
      EXPECT_THAT(message, HasSubstr("triangle 1 refers to a vertex beyond the last of 4"));
      EXPECT_FALSE(std::filesystem::exists(in(name)));
    }
  }
}

TEST_F(MeshIo, LeavesNoFileWhenAWriteFails) {
  const FileSizeLimit limit(1 << 16);
  for (const char* name : {"a.ply", "a.obj", "a.stl", "a.glb"}) {
    EXPECT_THAT(message_of([&] { write_mesh(in(name), random_mesh(), prairie); }),
                HasSubstr("cannot be written"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace
}  // namespace groundray::mesh_io_test
