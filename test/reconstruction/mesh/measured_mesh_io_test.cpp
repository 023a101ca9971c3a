#include "reconstruction/mesh/measured_mesh_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "core/error.h"
#include "test/support/scans/solid.h"
#include "test/support/temporary_folder.h"

namespace groundray::measured_mesh_io_test {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

// A ball far from D's origin, so that its floats are coarse.
MeasuredMesh measured_ball(const glm::dvec3& at_m) {
  MeasuredMesh mesh;
  mesh.shape = testing::icosphere(10, 2).mesh;
  for (std::size_t i = 0; i < mesh.shape.vertices_m.size(); ++i) {
    mesh.shape.vertices_m[i] += at_m;
    mesh.sd_m.push_back(0.001f * static_cast<float>(i));
    mesh.labels.push_back(static_cast<std::uint16_t>(400 * i));
    mesh.confidence.push_back(1 / (1 + static_cast<float>(i)));
  }
  return mesh;
}

std::vector<std::array<glm::dvec3, 3>> triangles_of(const MeasuredMeshFile& file) {
  std::vector<std::array<glm::dvec3, 3>> triangles;
  const TriangleMesh& mesh = file.mesh.shape;
  const glm::dvec3& origin_m = file.georeference.origin_w_m;
  for (const glm::uvec3& t : mesh.triangles) {
    triangles.push_back({origin_m + mesh.vertices_m[t.x], origin_m + mesh.vertices_m[t.y],
                         origin_m + mesh.vertices_m[t.z]});
  }
  return triangles;
}

class MeasuredMeshIo : public ::testing::Test {
 protected:
  std::filesystem::path in(const std::string& name) const { return folder_ / name; }
  std::string refusal(const MeasuredMesh& mesh, const std::string& name = "a.ply") const {
    try {
      write_measured_mesh(in(name), mesh, {});
    } catch (const Error& error) {
      return error.what();
    }
    return "no Error was thrown";
  }
  // Reads a triangle with one additional column.
  std::string reading(const std::string& property, const std::string& third) const {
    std::ofstream(in("b.ply")) << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                  "property float y\nproperty float z\nproperty "
                               << property
                               << "\nelement face 1\nproperty list uchar int vertex_index\n"
                                  "end_header\n0 0 0 1\n1 0 0 1\n0 1 0 "
                               << third << "\n3 0 1 2\n";
    try {
      const MeasuredMesh mesh = read_measured_mesh(in("b.ply")).mesh;
      return mesh.labels.empty() ? "no label" : std::to_string(mesh.labels[2]);
    } catch (const Error& error) {
      return error.what();
    }
  }
  TemporaryFolder folder_;
};

TEST_F(MeasuredMeshIo, PlyRestoresAllAttributes) {
  const MeasuredMesh mesh = measured_ball({-3e5, 7, 1e-5});
  const Georeference where{{435000.25, 5150500, -12.5}, "a CRS", "its WKT"};
  write_measured_mesh(in("a.ply"), mesh, where);
  const MeasuredMeshFile file = read_measured_mesh(in("a.ply"));
  EXPECT_EQ(file.mesh.shape.vertices_m, mesh.shape.vertices_m);
  EXPECT_EQ(file.mesh.sd_m, mesh.sd_m);
  EXPECT_EQ(file.mesh.labels, mesh.labels);
  EXPECT_EQ(file.mesh.confidence, mesh.confidence);
  EXPECT_EQ(file.georeference.origin_w_m, where.origin_w_m);
  EXPECT_EQ(file.georeference.crs_name, "a CRS");
  EXPECT_EQ(file.georeference.crs_wkt, "its WKT");
  EXPECT_EQ(triangles_of(file), triangles_of({.mesh = mesh, .georeference = where}));
}

// Coordinates in W, whatever the format: with D's origin near, and with the mesh itself in UTM.
TEST_F(MeasuredMeshIo, EveryFormatKeepsMillimetresOfLargeCoordinates) {
  struct Place {
    glm::dvec3 in_D, of_D;
  };
  for (const Place& place :
       {Place{{1, 2, 3}, {435000.125, 5150500, 300}}, Place{{435000.1, 5150500.7, 300}, {0, 0, 0}},
        Place{{-5e4, 30, 0}, {435000, 5150500, 300}}}) {
    MeasuredMesh mesh = measured_ball(place.in_D);
    const Georeference where{.origin_w_m = place.of_D};
    const auto expected = triangles_of({.mesh = mesh, .georeference = where});
    for (const char* name : {"a.ply", "a.obj", "a.stl", "a.glb"}) {
      SCOPED_TRACE(name);
      write_measured_mesh(in(name), mesh, where);
      const MeasuredMeshFile file = read_measured_mesh(in(name));
      const auto found = triangles_of(file);
      ASSERT_EQ(found.size(), expected.size());
      for (std::size_t i = 0; i < found.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k)
          ASSERT_LT(glm::length(found[i][k] - expected[i][k]), 3e-5);  // floats below 512 m
      }
      // A closed mesh stays closed: 162 vertices for 320 triangles, by Euler's formula.
      EXPECT_EQ(file.mesh.shape.vertices_m.size(), 162u);
      EXPECT_EQ(file.mesh.sd_m.empty(), std::string(name) != "a.ply");
    }
  }
}

TEST_F(MeasuredMeshIo, UnknownAttributesHaveNoColumn) {
  MeasuredMesh mesh = measured_ball({0, 0, 0});
  mesh.sd_m.clear();
  mesh.confidence.clear();
  write_measured_mesh(in("a.ply"), mesh, {});
  const MeasuredMeshFile file = read_measured_mesh(in("a.ply"));
  EXPECT_TRUE(file.mesh.sd_m.empty());
  EXPECT_TRUE(file.mesh.confidence.empty());
  EXPECT_EQ(file.mesh.labels, mesh.labels);
}

TEST_F(MeasuredMeshIo, ReadsColumnsOfAnyNumericType) {
  EXPECT_EQ(reading("uchar label", "9"), "9");
  EXPECT_EQ(reading("int label", "65535"), "65535");
  EXPECT_EQ(reading("double label", "7"), "7");
  EXPECT_EQ(reading("double sd_m", "7"), "no label");
  EXPECT_EQ(reading("double colour", "-7"), "no label");
}

TEST_F(MeasuredMeshIo, ReportsInvalidValues) {
  EXPECT_THAT(reading("int label", "-1"),
              HasSubstr("b.ply: vertex 2: label = -1 must be a whole number"));
  EXPECT_THAT(reading("int label", "65536"),
              HasSubstr("label = 65536 must be a whole number from 0 to 65535"));
  EXPECT_THAT(reading("float label", "0.5"), HasSubstr("label = 0.5 must be a whole number"));
  EXPECT_THAT(reading("float sd_m", "nan"), HasSubstr("sd_m = nan must be 0 or more, and finite"));
  EXPECT_THAT(reading("float sd_m", "-1"), HasSubstr("sd_m = -1 must be"));
  EXPECT_THAT(reading("double sd_m", "1e300"), HasSubstr("sd_m = 1e+300 must be"));
  EXPECT_THAT(reading("float confidence", "1.5"),
              HasSubstr("confidence = 1.5 must be from 0 to 1"));
  EXPECT_THAT(refusal(measured_ball({0, 0, 0}), "a.dae"),
              HasSubstr("must end in .ply, .obj, .stl"));
  for (const char* name : {"a.ply", "a.obj", "a.stl", "a.glb"}) {
    MeasuredMesh mesh = measured_ball({0, 0, 0});
    mesh.sd_m.pop_back();
    EXPECT_THAT(refusal(mesh, name), HasSubstr("161 values of sd_m for 162 vertices"));
    mesh = measured_ball({0, 0, 0});
    mesh.confidence[4] = std::nanf("");
    EXPECT_THAT(refusal(mesh, name), HasSubstr("vertex 4: confidence = nan must be from 0 to 1"));
    mesh = measured_ball({0, 0, 0});
    mesh.shape.triangles[1].y = 162;
    EXPECT_THAT(refusal(mesh, name), HasSubstr("triangle 1 refers to a vertex beyond the last"));
    mesh.shape.vertices_m[5].z = std::nan("");
    EXPECT_THAT(refusal(mesh, name), HasSubstr("vertex 5 must have a finite position"));
  }
  EXPECT_THAT(refusal({}, "a.glb"), HasSubstr("glTF does not support a mesh without triangles"));
  for (const char* name : {"a.ply", "a.obj", "a.stl", "a.glb"})
    EXPECT_FALSE(std::filesystem::exists(in(name)));
}

}  // namespace
}  // namespace groundray::measured_mesh_io_test
