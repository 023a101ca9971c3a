#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/mesh_io.h"
#include "test/support/solid.h"
#include "test/support/temporary_folder.h"

namespace groundray {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

const Georeference prairie{{435000, 5150500, -12.5}, "NAD83 / UTM zone 15N", "PROJCRS[\"x\"]"};

// Triangles as three positions each, in order: however vertices are numbered.
std::vector<std::array<glm::dvec3, 3>> triangles_of(const TriangleMesh& mesh) {
  std::vector<std::array<glm::dvec3, 3>> triangles;
  for (const glm::uvec3& t : mesh.triangles)
    triangles.push_back({mesh.vertices_m[t.x], mesh.vertices_m[t.y], mesh.vertices_m[t.z]});
  return triangles;
}

// Coordinates that floats cannot hold.
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
  std::string refusal(const std::filesystem::path& path) const {
    try {
      read_mesh(path);
    } catch (const Error& error) {
      return error.what();
    }
    return "no Error was thrown";
  }
  TemporaryFolder folder_;
};

TEST_F(MeshReader, GivesBackWhatWasWritten) {
  const TriangleMesh mesh = uneven_ball();
  for (const char* name : {"a.ply", "a.obj", "a.glb"}) {
    SCOPED_TRACE(name);
    write_mesh(in(name), mesh, prairie);
    const MeshFile file = read_mesh(in(name));
    const auto read = triangles_of(file.mesh), written = triangles_of(mesh);
    ASSERT_EQ(read.size(), written.size());
    // glTF's floats are off by half an ulp: 2^-25 of a coordinate below 16.
    const double tolerance_m = std::string(name) == "a.glb" ? 16 * 0x1p-24 : 0;
    for (std::size_t i = 0; i < read.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_LE(glm::length(read[i][k] - written[i][k]), tolerance_m);
    }
    EXPECT_EQ(file.mesh.vertices_m.size(), mesh.vertices_m.size());
    EXPECT_EQ(file.georeference.origin_w_m, prairie.origin_w_m);
    EXPECT_EQ(file.georeference.crs_name, prairie.crs_name);
    EXPECT_EQ(file.georeference.crs_wkt, prairie.crs_wkt);
    EXPECT_EQ(file.dropped, 0u);
    EXPECT_EQ(file.skipped, 0u);
  }
}

TEST_F(MeshReader, NeedsNothingButTheShape) {
  const auto obj = put("a.obj",
                       "mtllib nowhere.mtl\nv 0 0 0\nv 1 0 0.1234567890123\nv 1 1 0\nv 0 1 0\n"
                       "usemtl bark\nf 1 2 3 4\nf 1 1 2\nl 1 2\n# origin_w 9 9 9\n");
  const MeshFile file = read_mesh(obj);
  EXPECT_EQ(file.mesh.triangles.size(), 2u);
  EXPECT_EQ(file.mesh.vertices_m.size(), 4u);
  EXPECT_EQ(file.dropped, 1u);
  EXPECT_EQ(file.skipped, 1u);
  EXPECT_EQ(file.georeference.origin_w_m, glm::dvec3(0));  // said at the head alone
  const auto ply =
      put("a.ply",
          "ply\nformat ascii 1.0\ncomment TextureFile nowhere.png\n"
          "comment made by hand\nelement vertex 3\nproperty float x\nproperty float y\n"
          "property float z\nelement face 1\nproperty list uchar int vertex_index\n"
          "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_EQ(read_mesh(ply).mesh.vertices_m[1], glm::dvec3(1, 0, 0));
}

TEST_F(MeshReader, EveryFaultIsNamed) {
  EXPECT_THAT(refusal(in("a.dae")), HasSubstr("must end in .ply, .obj, .stl, .gltf or .glb"));
  EXPECT_THAT(refusal(in("a.ply")), HasSubstr("a.ply"));
  EXPECT_THAT(
      refusal(put("b.obj", "v 0 0 0\np 1\nv 1 0 0\nf 1 2 1\n")),
      HasSubstr("b.obj: there is no triangle; 1 broken polygons were dropped, and 1 points"));
  for (const char* origin : {"1 2", "1 2 x", "1 2 nan", "1 2 3 4"}) {
    EXPECT_THAT(refusal(put("c.obj", std::string("#\n# origin_w ") + origin +
                                         "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")),
                HasSubstr("c.obj:2: origin_w = "));
  }
  write_mesh(in("d.glb"), uneven_ball(), prairie);
  std::ifstream file(in("d.glb"), std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  bytes.replace(bytes.find("435000,"), 7, "\"eas\" ,");
  EXPECT_THAT(refusal(put("e.glb", bytes)), HasSubstr("e.glb"));
}

}  // namespace
}  // namespace groundray
