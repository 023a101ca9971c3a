#include "core/model/mesh_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/io/mesh_io.h"
#include "test/support/scans/solid.h"
#include "test/support/temporary_folder.h"

namespace groundray::mesh_reader_test {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

const Georeference prairie{{435000, 5150500, -12.5}, "NAD83 / UTM zone 15N", "PROJCRS[\"x\"]"};

// Triangles as three positions each, in order: independent of the numbering of vertices.
std::vector<std::array<glm::dvec3, 3>> triangles_of(const TriangleMesh& mesh) {
  std::vector<std::array<glm::dvec3, 3>> triangles;
  for (const glm::uvec3& t : mesh.triangles)
    triangles.push_back({mesh.vertices_m[t.x], mesh.vertices_m[t.y], mesh.vertices_m[t.z]});
  return triangles;
}

// A ball with coordinates that floats cannot represent.
TriangleMesh uneven_ball() {
  TriangleMesh mesh = testing::icosphere(7, 2).mesh;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> shift(-0.1, 0.1);
  for (glm::dvec3& p : mesh.vertices_m) p += glm::dvec3(shift(random), 0, 4 + shift(random));
  return mesh;
}

class MeshReader : public ::testing::Test {
 protected:
  std::filesystem::path in(const std::string& name) const { return folder_ / name; }
  std::filesystem::path put(const std::string& name, const std::string& text) const {
    std::ofstream(in(name), std::ios::binary) << text;
    return in(name);
  }
  std::string error_of(const std::filesystem::path& path) const {
    try {
      read_mesh(path);
    } catch (const Error& error) {
      return error.what();
    }
    return "no Error was thrown";
  }
  TemporaryFolder folder_;
};

TEST_F(MeshReader, ReadsBackWrittenMeshes) {
  const TriangleMesh mesh = uneven_ball();
  for (const std::string name : {"a.ply", "a.obj", "a.stl", "a.glb"}) {
    SCOPED_TRACE(name);
    write_mesh(in(name), mesh, prairie);
    const MeshFile file = read_mesh(in(name));
    const auto read = triangles_of(file.mesh), written = triangles_of(mesh);
    ASSERT_EQ(read.size(), written.size());
    // Rounding to floats errs by half an ulp: 2^-25 of a coordinate below 16.
    const double tolerance_m = name == "a.glb" || name == "a.stl" ? 16 * 0x1p-24 : 0;
    for (std::size_t i = 0; i < read.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_LE(glm::length(read[i][k] - written[i][k]), tolerance_m);
    }
    EXPECT_EQ(file.mesh.vertices_m.size(), mesh.vertices_m.size());
    EXPECT_EQ(file.georeference.origin_w_m, prairie.origin_w_m);
    EXPECT_EQ(file.georeference.crs_name, name == "a.stl" ? "" : prairie.crs_name);
    EXPECT_EQ(file.georeference.crs_wkt, name == "a.stl" ? "" : prairie.crs_wkt);
    EXPECT_EQ(file.dropped, 0u);
    EXPECT_EQ(file.skipped, 0u);
  }
}

TEST_F(MeshReader, ReadsOnlyTheShape) {
  const auto obj = put("a.obj",
                       "mtllib nowhere.mtl\nv 0 0 0\nv 1 0 0.1234567890123\nv 1 1 0\nv 0 1 0\n"
                       "usemtl bark\nf 1 2 3 4\nf 1 1 2\nl 1 2\n# origin_w 9 9 9\n");
  const MeshFile file = read_mesh(obj);
  EXPECT_EQ(file.mesh.triangles.size(), 2u);
  EXPECT_EQ(file.mesh.vertices_m.size(), 4u);
  EXPECT_EQ(file.dropped, 1u);
  EXPECT_EQ(file.skipped, 1u);
  EXPECT_EQ(file.georeference.origin_w_m, glm::dvec3(0));  // stated in the header alone
  const auto ply =
      put("a.ply",
          "ply\nformat ascii 1.0\ncomment TextureFile nowhere.png\n"
          "comment made by hand\nelement vertex 3\nproperty float x\nproperty float y\n"
          "property float z\nelement face 1\nproperty list uchar int vertex_index\n"
          "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_EQ(read_mesh(ply).mesh.vertices_m[1], glm::dvec3(1, 0, 0));
}

// Normals and uv differ between the copies of a vertex, although the surface is continuous.
TEST_F(MeshReader, JoinsVerticesAtEqualPositions) {
  const auto obj = put("a.obj",
                       "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 0 1 -0\nv 1 1 5\nvn 0 0 1\nvn 1 0 0\n"
                       "vt 0 0\nvt 1 1\nf 1/1/1 2/1/1 3/1/1\nf 4/2/2 6/2/2 5/2/99\n");
  const MeshFile file = read_mesh(obj);
  EXPECT_EQ(file.mesh.vertices_m.size(), 4u);
  EXPECT_EQ(file.mesh.triangles[1], glm::uvec3(1, 3, 2));
  EXPECT_EQ(file.dropped, 0u);  // appearance is not read
  const auto stl = put("a.stl",
                       "solid origin_w 1 2 3\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"
                       "vertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nfacet normal 0 0 1\n"
                       "outer loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\n"
                       "endsolid\n");
  EXPECT_EQ(read_mesh(stl).mesh.vertices_m.size(), 4u);
  EXPECT_EQ(read_mesh(stl).georeference.origin_w_m,
            glm::dvec3(0));  // only a name; not written by groundray
}

// As Open3D writes them: the file has no second chunk, and the buffer is embedded in the JSON.
TEST_F(MeshReader, ReadsAJsonOnlyGlb) {
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":3,)"
      R"("min":[0,0,0],"max":[1,2,0]}],"bufferViews":[{"buffer":0,"byteLength":36}],)"
      R"("buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)"
      R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAEAAAAAA"}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string glb = "glTF";
  for (const std::size_t word : {std::size_t{2}, 20 + json.size(), json.size()}) {
    const auto bits = static_cast<std::uint32_t>(word);
    glb.append(reinterpret_cast<const char*>(&bits), 4);
  }
  const MeshFile file = read_mesh(put("a.glb", glb + "JSON" + json));
  ASSERT_EQ(file.mesh.triangles.size(), 1u);
  EXPECT_EQ(file.mesh.vertices_m[2], glm::dvec3(0, 0, 2));  // y is up
  EXPECT_EQ(read_mesh(put("a.gltf", json)).mesh.vertices_m, file.mesh.vertices_m);
}

TEST_F(MeshReader, ReadsBackStoredVerticesAndTheirColumns) {
  TriangleMesh mesh = uneven_ball();
  mesh.vertices_m.insert(mesh.vertices_m.begin() + 3, {1, 2, 3});  // unused by any triangle
  for (glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) t[k] += t[k] >= 3 ? 1 : 0;
  }
  mesh.vertices_m.push_back(mesh.vertices_m[0]);  // a duplicate that must not be joined
  mesh.triangles[0].x = static_cast<unsigned>(mesh.vertices_m.size()) - 1;
  MeshColumns columns{PointCloud(mesh.vertices_m.size()), PointCloud()};
  const auto number = columns.vertices.add<std::int32_t>("number");
  for (std::size_t i = 0; i < number.size(); ++i) number[i] = -static_cast<std::int32_t>(i);
  write_ply(in("a.ply"), mesh, prairie, columns);
  const StoredMesh stored = read_stored_mesh(in("a.ply"));
  EXPECT_EQ(stored.mesh.vertices_m, mesh.vertices_m);
  ASSERT_EQ(stored.mesh.triangles.size(), mesh.triangles.size());
  EXPECT_EQ(triangles_of(stored.mesh), triangles_of(mesh));
  const auto read = stored.vertices.column<std::int32_t>("number");
  EXPECT_TRUE(std::ranges::equal(read, number));
  EXPECT_EQ(stored.vertices.column<double>("y")[7], mesh.vertices_m[7].y);
  EXPECT_EQ(stored.georeference.origin_w_m, prairie.origin_w_m);
  EXPECT_EQ(stored.dropped, 0u);
}

TEST_F(MeshReader, RejectsInvalidStoredMeshes) {
  const auto message = [](const std::string& vertices, const std::string& faces) -> std::string {
    const std::string head =
        "ply\nformat ascii 1.0\ncomment origin_w 1 2 3\nelement vertex 3\nproperty float x\n"
        "property float y\nproperty float z\nelement face 1\nproperty list uchar int "
        "vertex_index\nend_header\n";
    try {
      const StoredMesh stored = parse_stored_mesh(head + vertices + faces, "it.ply");
      return stored.mesh.triangles.size() == 1 ? "" : "other";
    } catch (const Error& error) {
      return error.what();
    }
  };
  const std::string good = "0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(message(good, "3 0 1 2\n"), "");
  EXPECT_THAT(message(good, "3 0 1 3\n"), HasSubstr("it.ply: there is no triangle; 1 broken"));
  EXPECT_THAT(message(good, "3 0 1 -1\n"), HasSubstr("1 broken"));
  EXPECT_THAT(message(good, "2 0 1\n"), HasSubstr("and 1 points, lines"));
  EXPECT_THAT(message(good, "3 0 1"), HasSubstr("truncated"));
  EXPECT_THAT(message("0 0 0\n1 0 nan\n0 1 0\n", "3 0 1 2\n"), HasSubstr("1 broken"));
}

TEST_F(MeshReader, ReportsEveryFault) {
  EXPECT_THAT(error_of(in("a.dae")), HasSubstr("must end in .ply, .obj, .stl, .gltf or .glb"));
  EXPECT_THAT(error_of(in("a.ply")), HasSubstr("a.ply"));
  EXPECT_THAT(
      error_of(put("b.obj", "v 0 0 0\np 1\nv 1 0 0\nf 1 2 1\n")),
      HasSubstr("b.obj: there is no triangle; 1 broken polygons were dropped, and 1 points"));
  for (const char* origin : {"1 2", "1 2 x", "1 2 nan", "1 2 3 4"}) {
    EXPECT_THAT(error_of(put("c.obj", std::string("#\n# origin_w ") + origin +
                                          "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")),
                HasSubstr("c.obj:2: origin_w = "));
  }
  write_mesh(in("f.stl"), uneven_ball(), prairie);
  std::ifstream stl(in("f.stl"), std::ios::binary);
  std::string facets{std::istreambuf_iterator<char>(stl), {}};
  EXPECT_THAT(error_of(put("cut.stl", facets.substr(0, facets.size() - 10))), HasSubstr("cut.stl"));
  EXPECT_THAT(error_of(put("g.stl", facets.replace(9, 6, "x     "))),
              HasSubstr("g.stl: the header: origin_w = "));
  write_mesh(in("d.glb"), uneven_ball(), prairie);
  std::ifstream file(in("d.glb"), std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  bytes.replace(bytes.find("435000,"), 7, "\"eas\" ,");
  EXPECT_THAT(error_of(put("e.glb", bytes)), HasSubstr("e.glb"));
}

}  // namespace
}  // namespace groundray::mesh_reader_test
