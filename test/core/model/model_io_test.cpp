#include "core/model/model_io.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "core/error.h"
#include "core/image/png_io.h"
#include "core/io/mesh_io.h"
#include "test/support/scans/mesh_neighbours.h"
#include "test/support/temporary_folder.h"

namespace groundray::model_io_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::shared_data_folder;
using testing::TemporaryFolder;

constexpr ModelOptions drop{.broken = BrokenParts::Drop};

template <typename F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "no Error was thrown";
}

glm::dvec3 corner(const Model& model, std::size_t triangle, int k) {
  return model.mesh.vertices_m[model.mesh.triangles[triangle][k]];
}

/// Six times the volume of a closed mesh whose triangles are counter-clockwise from outside.
double six_volumes(const Model& model) {
  double sum = 0;
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    sum += glm::dot(corner(model, i, 0), glm::cross(corner(model, i, 1), corner(model, i, 2)));
  }
  return sum;
}

template <typename T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A corner of a box, 1 x 2 x 4: four vertices, four triangles, and no symmetry that could hide a
/// swapped axis.
const std::vector<glm::vec3> wedge_vertices{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 4}};
const std::vector<glm::uvec3> wedge_triangles{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

std::string wedge_binary() {
  std::string bytes;
  for (const glm::vec3& p : wedge_vertices) append(bytes, p);
  for (const glm::uvec3& t : wedge_triangles) append(bytes, t);
  return bytes;
}

/// The wedge as buffer 0 of a glTF.
/// @param nodes  the nodes; the first one is the scene's.
/// @param more   further members of the top-level object, each preceded by a comma.
std::string wedge_gltf(const std::string& nodes, const std::string& buffer,
                       const std::string& more = "", const std::string& primitive = "") {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" + nodes +
         R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1)" + primitive +
         R"(}]}],"accessors":[)"
         R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":4,"min":[0,0,0],"max":[1,2,4]},)"
         R"({"bufferView":1,"componentType":5125,"type":"SCALAR","count":12}],)"
         R"("bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":48})" +
         buffer + more + "}";
}
const std::string bin_file = R"(],"buffers":[{"uri":"wedge.bin","byteLength":96}])";

std::string glb(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4);
  std::string bytes = "glTF";
  append(bytes, std::uint32_t{2});
  append(bytes, static_cast<std::uint32_t>(28 + json.size() + binary.size()));
  append(bytes, static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  append(bytes, static_cast<std::uint32_t>(binary.size()));
  bytes += std::string("BIN\0", 4) + binary;
  return bytes;
}

std::string wedge_stl() {
  std::string bytes(80, ' ');
  append(bytes, std::uint32_t{4});
  for (const glm::uvec3& t : wedge_triangles) {
    append(bytes, glm::vec3(0));  // readers must compute the normal themselves
    for (int k = 0; k < 3; ++k) append(bytes, wedge_vertices[t[k]]);
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string ascii_ply(const std::string& properties, int vertices, const std::string& rows,
                      int faces, const std::string& face_rows, const std::string& comment = "") {
  return fmt::format(
      "ply\nformat ascii 1.0\n{}element vertex {}\n{}element face {}\n"
      "property list uchar int vertex_indices\nend_header\n{}{}",
      comment, vertices, properties, faces, rows, face_rows);
}
const std::string xyz = "property double x\nproperty double y\nproperty double z\n";

class ModelIo : public ::testing::Test {
 protected:
  std::filesystem::path in(const std::string& name) const { return folder_ / name; }
  std::filesystem::path put(const std::string& name, const std::string& bytes) const {
    std::filesystem::create_directories(in(name).parent_path());
    std::ofstream(in(name), std::ios::binary) << bytes;
    return in(name);
  }
  Model read(const std::string& name, const std::string& bytes,
             const ModelOptions& options = {}) const {
    return read_model(put(name, bytes), options).model;
  }
  std::string error_of(const std::string& name, const std::string& bytes,
                       const ModelOptions& options = {}) const {
    return message_of([&] { read(name, bytes, options); });
  }
  /// An image of one pixel.
  std::filesystem::path put_image(const std::string& name) const {
    std::filesystem::create_directories(in(name).parent_path());
    Image8 image(1, 1, 3);
    image.at(0, 0)[1] = 200;
    write_png(in(name), image);
    return in(name);
  }
  void expect_wedge(const Model& model, const glm::dvec3& size) const {
    ASSERT_EQ(model.mesh.triangles.size(), 4u);
    EXPECT_EQ(model.mesh.vertices_m.size(), 4u);
    const ModelBounds bounds = bounds_of(model.mesh);
    EXPECT_EQ(bounds.low_m, glm::dvec3(0));
    EXPECT_EQ(bounds.high_m, size);
    // A tetrahedron has a sixth of its box's volume; inside out it would be negative.
    EXPECT_DOUBLE_EQ(six_volumes(model), size.x * size.y * size.z);
    for (const glm::uvec3& sides : testing::neighbours_of(model.mesh)) {
      for (int k = 0; k < 3; ++k) EXPECT_NE(sides[k], testing::no_neighbour);
    }
  }
  TemporaryFolder folder_;
};

TEST_F(ModelIo, EveryFormatReadsTheSameWedge) {
  put("wedge.bin", wedge_binary());
  std::string obj, ply_rows, ply_faces, ascii_stl = "solid wedge\n";
  for (const glm::vec3& p : wedge_vertices) {
    obj += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
    ply_rows += fmt::format("{} {} {}\n", p.x, p.y, p.z);
  }
  for (const glm::uvec3& t : wedge_triangles) {
    obj += fmt::format("f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
    ply_faces += fmt::format("3 {} {} {}\n", t.x, t.y, t.z);
    ascii_stl += "facet normal 0 0 0\nouter loop\n";
    for (int k = 0; k < 3; ++k) {
      const glm::vec3& p = wedge_vertices[t[k]];
      ascii_stl += fmt::format("vertex {} {} {}\n", p.x, p.y, p.z);
    }
    ascii_stl += "endloop\nendfacet\n";
  }
  const glm::dvec3 z_up(1, 2, 4), y_up(4, 1, 2);
  expect_wedge(read("a.obj", obj), z_up);
  expect_wedge(read("a.ply", ascii_ply(xyz, 4, ply_rows, 4, ply_faces)), z_up);
  expect_wedge(read("a.stl", wedge_stl()), z_up);
  expect_wedge(read("b.STL", ascii_stl + "endsolid wedge\n"), z_up);
  expect_wedge(read("a.gltf", wedge_gltf(R"({"mesh":0})", bin_file)), y_up);
  expect_wedge(read("a.glb", glb(wedge_gltf(R"({"mesh":0})", R"(],"buffers":[{"byteLength":96}])"),
                                 wedge_binary())),
               y_up);
  EXPECT_THAT(error_of("a.fbx", ""),
              HasSubstr("a.fbx: the name of a model must end in .obj, .ply"));
  EXPECT_THAT(error_of("a.dae", "<COLLADA/>"),
              AllOf(HasSubstr("a.dae: Collada is not read; convert it to glTF"),
                    HasSubstr("assimp export '" + in("a.dae").string() + "' '" +
                              in("a.glb").string() + "'")));
}

// Assimp looks for the first buffer in the file itself, whatever its URI is.
TEST_F(ModelIo, RejectsAJsonOnlyGlbWithAnExternalBuffer) {
  std::string bytes = glb(wedge_gltf(R"({"mesh":0})", bin_file), "");
  bytes.resize(bytes.size() - 8);  // without the second chunk
  bytes[8] = static_cast<char>(bytes.size() & 0xff);
  bytes[9] = static_cast<char>(bytes.size() >> 8);
  EXPECT_THAT(error_of("a.glb", bytes), HasSubstr(in("a.glb").string()));
}

TEST_F(ModelIo, MeshesWrittenByGroundrayRoundTripExactly) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> east(435000, 435001), north(5150000, 5150001);
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < 300; ++i) {
    mesh.vertices_m.emplace_back(east(random), north(random), east(random) - 435000);
    if (i % 3 == 2) mesh.triangles.emplace_back(i - 2, i - 1, i);
  }
  for (const char* name : {"a.ply", "a.obj"}) {
    write_mesh(in(name), mesh, {});
    const ModelFile file = read_model(in(name), {});
    EXPECT_EQ(file.model.mesh.vertices_m, mesh.vertices_m);
    EXPECT_EQ(file.model.mesh.triangles, mesh.triangles);
    EXPECT_EQ(file.rounding_m, 0);
    EXPECT_TRUE(file.model.uv.empty());
    EXPECT_TRUE(file.model.normals.empty());
  }
  write_mesh(in("a.glb"), mesh, {});
  EXPECT_THAT(message_of([&] { read_model(in("a.glb"), {}); }),
              HasSubstr("positions are stored as floats and rounded by up to"));
  const ModelFile file = read_model(in("a.glb"), drop);
  EXPECT_GT(file.rounding_m, 0.25);  // half an ulp at 5.15e6 m, the rounding error of a float
  for (const auto& [file_p, p] : {std::tuple(corner(file.model, 0, 0), mesh.vertices_m[0])}) {
    // write_mesh mapped x, y, z to x, z, -y, with the second axis up.
    EXPECT_NEAR(file_p.x, -p.y, file.rounding_m);
    EXPECT_NEAR(file_p.y, p.x, file.rounding_m);
    EXPECT_NEAR(file_p.z, p.z, file.rounding_m);
  }
}

TEST_F(ModelIo, TrianglesInMemoryGiveTheModelOfTheirFile) {
  // The first vertex is unused, two are equal, and triangles refer to them out of order.
  const TriangleMesh mesh{{{9, 9, 9}, {0, 0, 0}, {0.1, 0, 0}, {0, 1 / 3., 0}, {0, 0, 0}, {0, 0, 2}},
                          {{3, 2, 1}, {4, 2, 5}, {5, 3, 4}},
                          {}};
  write_mesh(in("a.ply"), mesh, {});
  const Model of_file = read_model(in("a.ply"), {}).model;
  const Model model = model_from(mesh, "a mesh");
  EXPECT_EQ(model.mesh.vertices_m, of_file.mesh.vertices_m);
  EXPECT_EQ(model.mesh.vertices_m.size(), 4);
  EXPECT_EQ(model.mesh.triangles, of_file.mesh.triangles);
  EXPECT_EQ(model.surface_of, of_file.surface_of);
  ASSERT_EQ(model.surfaces.size(), 1);
  EXPECT_EQ(model.surfaces[0].name, of_file.surfaces[0].name);
  EXPECT_TRUE(model.uv.empty() && model.normals.empty());
}

TEST_F(ModelIo, InvalidTrianglesInMemoryAreRejected) {
  const std::vector<glm::dvec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {NAN, 0, 0}};
  const auto message = [&](const glm::uvec3& triangle) {
    return message_of([&] { model_from({corners, {{0, 1, 2}, triangle}, {}}, "a mesh"); });
  };
  EXPECT_THAT(message({0, 1, 9}), AllOf(HasSubstr("a mesh"), HasSubstr("missing vertex")));
  EXPECT_THAT(message({0, 1, 3}), HasSubstr("1 polygons have a position or uv that is not finite"));
  EXPECT_THAT(message({0, 1, 1}), HasSubstr("1 polygons or triangles have no area"));
  EXPECT_THAT(message_of([&] {
                model_from({corners, {}, {}}, "a mesh");
              }),
              HasSubstr("a mesh: there is no triangle"));
}

TEST_F(ModelIo, UnitsAndAxesComeFromTheFileOrTheCaller) {
  put("wedge.bin", wedge_binary());
  const std::string gltf = wedge_gltf(R"({"mesh":0})", bin_file);
  expect_wedge(read("a.gltf", gltf, {.metres_per_unit = 0.5}), {2, 0.5, 1});
  expect_wedge(read("a.gltf", gltf, {.up = UpAxis::Z}), {1, 2, 4});
  expect_wedge(read("a.stl", wedge_stl(), {.metres_per_unit = 1e-3, .up = UpAxis::X}),
               {2 * 1e-3, 4 * 1e-3, 1e-3});
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THAT(error_of("a.gltf", gltf, {.metres_per_unit = bad}),
                HasSubstr("metres_per_unit = "));
  }
}

TEST_F(ModelIo, NodesTranslateRotateScaleAndMirror) {
  put("wedge.bin", wedge_binary());
  // The child's own length doubles, then both lie 10 along x; the mirror image lies 5 along y.
  const std::string nodes =
      R"({"children":[1,2],"translation":[10,0,0]},{"mesh":0,"scale":[2,2,2]},)"
      R"({"mesh":0,"matrix":[1,0,0,0,0,-1,0,0,0,0,1,0,0,5,0,1]})";
  const Model model = read("a.gltf", wedge_gltf(nodes, bin_file), {.up = UpAxis::Z});
  ASSERT_EQ(model.mesh.triangles.size(), 8u);
  const ModelBounds bounds = bounds_of(model.mesh);
  EXPECT_EQ(bounds.low_m, glm::dvec3(10, 0, 0));
  EXPECT_EQ(bounds.high_m, glm::dvec3(12, 5, 8));
  EXPECT_DOUBLE_EQ(six_volumes(model), 8 * 8 + 8);  // both positive: the mirrored one was rewound
  // A quarter turn about z, as a quaternion.
  const Model turned =
      read("b.gltf", wedge_gltf(R"({"mesh":0,"rotation":[0,0,0.70710678,0.70710678]})", bin_file),
           {.up = UpAxis::Z});
  EXPECT_NEAR(bounds_of(turned.mesh).low_m.x, -2, 1e-6);
  EXPECT_NEAR(bounds_of(turned.mesh).high_m.y, 1, 1e-6);
}

TEST_F(ModelIo, ObjVerticesAreJoinedWherePositionUvAndNormalAreEqual) {
  // Two adjacent squares share an edge; in the first file the second square has separate uv there.
  const std::string vertices =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nv 1 0 -0\n"
      "vt 0 0\nvt 0.25 0.5\nvn 0 0 2\n";
  const Model seam =
      read("a.obj", vertices + "f 1/1/1 2/1/1 3/1/1 4/1/1\nf 7/2/1 5/2/1 6/2/1 -5/2/1\n");
  EXPECT_EQ(seam.mesh.vertices_m.size(), 8u);
  EXPECT_EQ(seam.mesh.triangles.size(), 4u);
  EXPECT_THAT(seam.uv, ::testing::Contains(glm::vec2(0.25f, 0.5f)).Times(4));
  EXPECT_THAT(seam.normals, ::testing::Each(glm::vec3(0, 0, 1)));
  const Model joined = read("a.obj", vertices + "f 1/1 2/1 3/1 4/1\nf 7/1 5/1 6/1 3/1\n");
  EXPECT_EQ(joined.mesh.vertices_m.size(), 6u);  // 2 and 7 differ in the sign of a zero
  EXPECT_EQ(joined.mesh.triangles,
            (std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}}));
  EXPECT_TRUE(joined.normals.empty());
  // With or without seams, the squares are neighbours.
  EXPECT_EQ(testing::neighbours_of(seam.mesh), testing::neighbours_of(joined.mesh));
}

TEST_F(ModelIo, CornersWithoutANormalUseTheNormalOfTheirTriangle) {
  const Model model = read("a.obj",
                           "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 1 0 0\nvn 0 0 0\n"
                           "f 1//1 2//1 3//1\nf 1 4 2\nf 1//2 3//2 4//2\n");
  EXPECT_THAT(model.normals, ElementsAre(glm::vec3(1, 0, 0), glm::vec3(1, 0, 0), glm::vec3(1, 0, 0),
                                         glm::vec3(0, 1, 0), glm::vec3(0, 1, 0), glm::vec3(0, 1, 0),
                                         glm::vec3(1, 0, 0)));
}

TEST_F(ModelIo, ReadsSurfacesFromMtl) {
  put("all.mtl",
      "# by hand\nnewmtl not used\nmap_Kd nowhere.png\n"
      "newmtl old bark\nKd 0.5 0 1.0\nmap_Kd -s 2 2 -clamp on C:\\art\\old bark.png\n"
      "map_Bump -bm 0.3 bumps.png\nnorm tex/n.png\nnewmtl leaf\nmap_d leaf.png\nmap_Kd leaf.png\n"
      "newmtl cut\nmap_d mask.png\n");
  for (const char* image : {"old bark.png", "bumps.png", "tex/n.png", "leaf.png", "mask.png"}) {
    put_image(image);
  }
  const Model model =
      read("a.obj",
           "mtllib all.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl leaf\nf 3 2 1\n"
           "usemtl old bark\nf 1 2 3\nusemtl cut\nf 1 2 3\nusemtl leaf\nf 1 2 3\n");
  ASSERT_EQ(model.surfaces.size(), 4u);
  EXPECT_THAT(model.surface_of, ElementsAre(0, 1, 2, 3, 1));
  EXPECT_EQ(model.surfaces[0].name, "default");
  EXPECT_EQ(model.surfaces[0].color, glm::vec3(1));
  EXPECT_FALSE(model.surfaces[0].albedo.exists());
  EXPECT_EQ(model.surfaces[1].name, "leaf");
  EXPECT_EQ(model.surfaces[1].albedo.file, in("leaf.png"));
  EXPECT_FALSE(model.surfaces[1].opacity.exists());  // the albedo's own alpha channel
  EXPECT_EQ(model.surfaces[2].name, "old bark");
  // IEC 61966-2-1: half of the full code is 0.214041 of the full light.
  EXPECT_NEAR(model.surfaces[2].color.x, 0.214041, 1e-6);
  EXPECT_EQ(model.surfaces[2].color.y, 0);
  EXPECT_EQ(model.surfaces[2].color.z, 1);
  EXPECT_EQ(model.surfaces[2].albedo.file, in("old bark.png"));
  EXPECT_EQ(model.surfaces[2].normal.file, in("tex/n.png"));
  EXPECT_EQ(model.surfaces[3].opacity.file, in("mask.png"));
}

TEST_F(ModelIo, SkipsAByteOrderMarkInObjAndMtl) {
  const std::string mark = "\xEF\xBB\xBF";
  put("a.mtl", mark + "newmtl red\nKd 1 0 0\n");
  // If its first vertex were lost, the triangle would use the three that follow.
  const Model model = read("a.obj", mark +
                                        "v 5 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nmtllib a.mtl\n"
                                        "usemtl red\nf 1 2 3\n");
  EXPECT_EQ(corner(model, 0, 0), glm::dvec3(5, 0, 0));
  EXPECT_EQ(model.surfaces.at(0).color, glm::vec3(1, 0, 0));
  EXPECT_THAT(error_of("a.obj", mark + "v 0 0\n"), HasSubstr("a.obj:1: v needs 3 numbers"));
}

TEST_F(ModelIo, CommentsAreCutOffNamesUnlessTheFullNameExists) {
  put("c.mtl",
      "newmtl rock # grey\nKd 0 1 0\nnewmtl rock #2\nKd 0 0 1\nnewmtl moss\t# green\nKd 1 0 0\n");
  put("d #1.mtl", "newmtl d\nKd 0 0 0\n");
  put("e.mtl", "newmtl e\nKd 0 0 0\n");
  const Model model =
      read("a.obj",
           "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
           "usemtl rock # first\nf 1 2 3\nusemtl rock #2\nf 1 2 3\nusemtl rock\nf 1 2 3\n"
           "usemtl moss # wet\nf 1 2 3\nusemtl no#comment\nf 1 2 3\nusemtl lost # here\nf 1 2 3\n"
           "usemtl d\nf 1 2 3\nusemtl e\nf 1 2 3\n"
           "mtllib c.mtl # after them\nmtllib d #1.mtl\nmtllib e.mtl c.mtl # two\n");
  EXPECT_THAT(model.surface_of, ElementsAre(0, 1, 0, 2, 3, 4, 5, 6));
  std::vector<std::string> names;
  for (const ModelSurface& surface : model.surfaces) names.push_back(surface.name);
  EXPECT_THAT(names, ElementsAre("rock", "rock #2", "moss", "no#comment", "lost", "d", "e"));
  EXPECT_EQ(model.surfaces[0].color, glm::vec3(0, 1, 0));
  EXPECT_EQ(model.surfaces[1].color, glm::vec3(0, 0, 1));
  EXPECT_EQ(model.surfaces[2].color, glm::vec3(1, 0, 0));
  EXPECT_EQ(model.surfaces[5].color, glm::vec3(0));
  EXPECT_EQ(model.surfaces[6].color, glm::vec3(0));
  EXPECT_THAT(error_of("a.obj", "mtllib no.mtl # lib\n"),
              HasSubstr("a.obj:1: \"no.mtl\" is missing: there is no '"));
}

TEST_F(ModelIo, ObjErrorsNameFileAndLine) {
  EXPECT_THAT(error_of("a.obj", "v 0 0\n"), HasSubstr("a.obj:1: v needs 3 numbers"));
  EXPECT_THAT(error_of("a.obj", "# x\nv 0 0 1,5\n"), HasSubstr("a.obj:2: \"1,5\" is not a number"));
  EXPECT_THAT(error_of("a.obj", "v 0 0 0\nf 1 2\n"),
              HasSubstr("a.obj:2: f needs 3 corners or more"));
  EXPECT_THAT(error_of("a.obj", "f 0 1 2\n"), HasSubstr("a.obj:1: \"0\" must be an integer"));
  EXPECT_THAT(error_of("a.obj", "f 1/x/ 1 2\n"), HasSubstr("a.obj:1: \"x\" must be an integer"));
  EXPECT_THAT(error_of("a.obj", "mtllib sub/no.mtl\n"),
              AllOf(HasSubstr("a.obj:1: \"sub/no.mtl\" is missing: there is no '"),
                    HasSubstr("/sub/no.mtl' and no '"), HasSubstr("/no.mtl'")));
  put("b.mtl", "\nKd 1 1 1\n");
  EXPECT_THAT(error_of("a.obj", "v 0 0 0\nmtllib b.mtl\n"),
              HasSubstr("a.obj:2: b.mtl:2: Kd must follow a newmtl"));
  EXPECT_THAT(message_of([&] { read_model(in("none.obj"), {}); }), HasSubstr("none.obj"));
  EXPECT_THAT(message_of([&] { read_model(in("none.glb"), {}); }), HasSubstr("none.glb"));
}

TEST_F(ModelIo, ReadsSurfacesFromGltf) {
  put("wedge.bin", wedge_binary());
  const std::filesystem::path bark = put_image("my bark.png");
  const auto surface = [&](const std::string& material) {
    const std::string more =
        R"(,"images":[{"uri":"my%20bark.png"}],"textures":[{"source":0}],"materials":[)" +
        material + "]";
    return read("a.gltf", wedge_gltf(R"({"mesh":0})", bin_file, more, R"(,"material":0)"))
        .surfaces.at(0);
  };
  const ModelSurface plain =
      surface(R"({"name":"wood","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0,1],)"
              R"("baseColorTexture":{"index":0}},"normalTexture":{"index":0}})");
  EXPECT_EQ(plain.name, "wood");
  EXPECT_EQ(plain.color, glm::vec3(0.5f, 0.25f, 0));  // linear in the file
  EXPECT_EQ(plain.albedo.file, bark);
  EXPECT_EQ(plain.normal.file, bark);
  EXPECT_EQ(plain.least_alpha, 0);  // glTF's default alphaMode is OPAQUE
  EXPECT_EQ(surface(R"({"alphaMode":"MASK"})").least_alpha, 0.5f);
  EXPECT_EQ(surface(R"({"alphaMode":"MASK","alphaCutoff":0.25})").least_alpha, 0.25f);
  EXPECT_EQ(surface(R"({"alphaMode":"MASK","alphaCutoff":0.25,)"
                    R"("pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5]}})")
                .least_alpha,
            0.5f);
  EXPECT_EQ(surface(R"({"alphaMode":"BLEND"})").least_alpha, 0.5f);
  // The map's alpha times 0.8 is 0.5 where the map's is 0.625; the cutoff applies to MASK only.
  EXPECT_FLOAT_EQ(surface(R"({"alphaMode":"BLEND","alphaCutoff":0.25,)"
                          R"("pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.8]}})")
                      .least_alpha,
                  0.625f);
}

TEST_F(ModelIo, DecodesImagesEmbeddedInAGlb) {
  std::ifstream file(put_image("one.png"), std::ios::binary);
  const std::string png{std::istreambuf_iterator<char>(file), {}};
  const std::string json = wedge_gltf(
      R"({"mesh":0})",
      fmt::format(
          R"(,{{"buffer":0,"byteOffset":96,"byteLength":{}}}],"buffers":[{{"byteLength":{}}}])",
          png.size(), 96 + png.size()),
      R"(,"images":[{"bufferView":2,"mimeType":"image/png"}],"textures":[{"source":0}],)"
      R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])",
      R"(,"material":0)");
  const Model model = read("a.glb", glb(json, wedge_binary() + png));
  const ModelImage& albedo = model.surfaces.at(0).albedo;
  EXPECT_TRUE(albedo.file.empty());
  ASSERT_EQ(albedo.pixels.width(), 1);
  EXPECT_EQ(albedo.pixels.at(0, 0)[1], 200);
  std::string broken = png;
  broken.resize(png.size() / 2);
  broken.resize(png.size());
  EXPECT_THAT(error_of("a.glb", glb(json, wedge_binary() + broken)), HasSubstr("a.glb, image "));
}

TEST_F(ModelIo, ReadsTheTextureNamedByAPly) {
  put_image("tex.png");
  const std::string rows = "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 0.75\n";
  const std::string text = ascii_ply(xyz + "property float s\nproperty float t\n", 3, rows, 1,
                                     "3 0 1 2\n", "comment TextureFile tex.png\n");
  const Model model = read("a.ply", text);
  EXPECT_EQ(model.surfaces.at(0).albedo.file, in("tex.png"));
  EXPECT_THAT(model.uv, ElementsAre(glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(0, 0.75f)));
}

TEST_F(ModelIo, BrokenPolygonsAreReportedByKindOrDropped) {
  const std::string text =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv 0 inf 0\nv 2 0 0\nv 1 1 0\nv 0 0 1.#QNAN\n"
      "vt 0 nan\n"
      "f 1 2 3\n"            // the valid one
      "f 1 2 9\nf 1 2 -9\n"  // there are 8
      "f 1/2 2/1 3/1\n"      // there is one vt
      "f 1 2 4\nf 1 3 5\nf 1 2 8\nf 1/1 2/1 3/1\n"
      "f 1 2 6\nf 1 1 2\nf 1 2 6 2\n"  // collinear
      "f 1 2 3 7\n"                    // a bow tie
      "l 1 2\np 3\n";
  const std::string message = error_of("a.obj", text);
  EXPECT_THAT(message, AllOf(HasSubstr("a.obj"), HasSubstr("3 polygons refer to a missing vertex"),
                             HasSubstr("4 polygons have a position or uv that is not finite"),
                             HasSubstr("3 polygons or triangles have no area"),
                             HasSubstr("1 polygons intersect themselves")));
  const ModelFile file = read_model(in("a.obj"), drop);
  EXPECT_EQ(file.model.mesh.triangles.size(), 1u);
  EXPECT_EQ(file.model.mesh.vertices_m.size(), 3u);
  EXPECT_EQ(file.dropped.out_of_range, 3u);
  EXPECT_EQ(file.dropped.not_finite, 4u);
  EXPECT_EQ(file.dropped.degenerate, 3u);
  EXPECT_EQ(file.dropped.entangled, 1u);
  EXPECT_EQ(file.skipped, 2u);
  EXPECT_THAT(error_of("a.obj", "v 0 0 0\nf 1 1 1\nl 1 1\n", drop),
              HasSubstr("there is no triangle; 1 broken polygons were dropped, and 1 points"));
}

TEST_F(ModelIo, CountsBrokenPolygonsInEveryFormat) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto expect = [&](const std::string& name, const std::string& bytes, std::size_t finite,
                          std::size_t degenerate, std::size_t range) {
    const ModelFile file = read_model(put(name, bytes), drop);
    EXPECT_EQ(file.dropped.not_finite, finite) << name;
    EXPECT_EQ(file.dropped.degenerate, degenerate) << name;
    EXPECT_EQ(file.dropped.out_of_range, range) << name;
    EXPECT_EQ(file.model.mesh.triangles.size(), 4 - finite - degenerate - range) << name;
    EXPECT_THAT(message_of([&] { read_model(in(name), {}); }), HasSubstr("repair the model"));
  };
  std::string stl = wedge_stl();
  std::memcpy(stl.data() + 84 + 12, &nan, sizeof nan);
  stl.replace(84 + 50 + 12, 12, stl.substr(84 + 50 + 24, 12));
  expect("a.stl", stl, 1, 1, 0);
  std::string binary = wedge_binary();
  std::memcpy(binary.data() + 12, &nan, sizeof nan);  // vertex 1 of triangles 0, 1 and 3
  put("wedge.bin", binary);
  expect("a.gltf", wedge_gltf(R"({"mesh":0})", bin_file), 3, 0, 0);
  binary = wedge_binary();
  const std::uint32_t beyond = 4, far = 0xfffffff0;
  std::memcpy(binary.data() + 48, &beyond, sizeof beyond);
  std::memcpy(binary.data() + 64, &far, sizeof far);
  put("wedge.bin", binary);
  expect("a.gltf", wedge_gltf(R"({"mesh":0})", bin_file), 0, 0, 2);
  const std::string rows = "0 0 0\n1 0 0\n0 2 0\nnan 0 4\n";
  expect("a.ply", ascii_ply(xyz, 4, rows, 4, "3 0 1 2\n3 0 1 3\n3 1 1 2\n3 0 1 4\n"), 1, 1, 1);
}

TEST_F(ModelIo, RejectsTruncatedFiles) {
  put("wedge.bin", wedge_binary());
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 4}}, wedge_triangles, {}};
  write_mesh(in("whole.ply"), mesh, {});
  std::ifstream ply(in("whole.ply"), std::ios::binary);
  const std::vector<std::pair<std::string, std::string>> files{
      {"a.ply", {std::istreambuf_iterator<char>(ply), {}}},
      {"b.ply", ascii_ply(xyz, 4, "0 0 0\n1 0 0\n0 2 0\n0 0 4\n", 4,
                          "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")},
      {"a.stl", wedge_stl()},
      {"a.gltf", wedge_gltf(R"({"mesh":0})", bin_file)},
      {"a.glb",
       glb(wedge_gltf(R"({"mesh":0})", R"(],"buffers":[{"byteLength":96}])"), wedge_binary())}};
  for (const auto& [name, bytes] : files) {
    ASSERT_EQ(read(name, bytes).mesh.triangles.size(), 4u) << name;
    const std::size_t step = std::max<std::size_t>(1, bytes.size() / 40);
    // A text form ends with only white space and an end of line.
    for (std::size_t size = 0; size + 3 < bytes.size(); size += step) {
      EXPECT_THAT(error_of(name, bytes.substr(0, size)), HasSubstr(in(name).string()))
          << size << " of " << bytes.size() << " bytes";
    }
  }
}

// Each of these crashed assimp 5.2 or made it loop forever.
TEST_F(ModelIo, RejectsFilesThatWouldCrashAssimp) {
  const std::string buffer = R"(],"buffers":[{"byteLength":96}])";
  std::string bytes = glb(wedge_gltf(R"({"mesh":0})", buffer), wedge_binary());
  bytes[15] = '\x7f';  // in the length of the JSON
  EXPECT_THAT(error_of("a.glb", bytes), HasSubstr("extends beyond the end"));
  std::string json = wedge_gltf(R"({"mesh":0})", buffer);
  json.replace(json.find(R"("count":4)"), 9, R"("count":9)");
  EXPECT_THAT(error_of("a.glb", glb(json, wedge_binary())),
              HasSubstr("accessors[0]: it extends to byte 108 of a view of 48"));
  json = wedge_gltf(R"({"mesh":0})", R"(],"buffers":[{"byteLength":90}])");
  EXPECT_THAT(error_of("a.glb", glb(json, wedge_binary())),
              HasSubstr("bufferViews[1]: it extends to byte 96 of a buffer of 90"));
  EXPECT_THAT(error_of("a.gltf", "{"), HasSubstr("a.gltf: "));
  json = wedge_gltf(R"({"mesh":0})", buffer);
  json.replace(json.find(R"("count":4)"), 9, R"("sparse":{"count":1},"count":4)");
  EXPECT_THAT(error_of("a.glb", glb(json, wedge_binary())),
              HasSubstr("accessors[0] is sparse, which is not read"));
  json = wedge_gltf(R"({"mesh":1})", buffer);
  EXPECT_THAT(error_of("a.glb", glb(json, wedge_binary())),
              HasSubstr("nodes[0]: there is no meshes[1]"));
  json = wedge_gltf(R"({"mesh":1e99})", buffer);
  EXPECT_THAT(error_of("a.glb", glb(json, wedge_binary())),
              HasSubstr("nodes[0]: mesh = 1e+99 must be a whole number"));
}

TEST_F(ModelIo, NamesTheFaultyValueOfAGltf) {
  put("wedge.bin", wedge_binary());
  const std::string good = wedge_gltf(R"({"mesh":0})", bin_file);
  const auto fault_of = [&](const std::string& was, const std::string& is) {
    std::string bytes = good;
    bytes.replace(bytes.find(was), was.size(), is);
    return error_of("a.gltf", bytes);
  };
  const std::vector<std::array<std::string, 3>> faults{
      {R"("2.0")", "2", "a.gltf: asset.version must be a text"},
      {R"("2.0")", R"("1.0")", "asset.version = \"1.0\", but only glTF 2 is read"},
      {"asset", "other", "it has no asset with a version: is it glTF?"},
      {R"("count":12)", R"("count":"12")",
       "accessors[1]: count must be a number, but its type is string"},
      {R"("count":12)", R"("more":12)", "accessors[1]: count is missing"},
      {R"("count":12)", R"("count":1.5)", "accessors[1]: count = 1.5 must be a whole number"},
      {R"("bufferView":1)", R"("bufferView":2)", "accessors[1]: there is no bufferViews[2]"},
      {R"("buffer":0)", R"("buffer":9)", "bufferViews[0]: there is no buffers[9]"},
      {R"("count":12)", R"("count":0)", "accessors[1]: count must be at least 1"},
      {R"("count":12)", R"("count":null)", "count must be a number, but its type is null"},
      {R"("SCALAR")", R"("SOLID")", "accessors[1]: type must be SCALAR, VEC2,"},
      {R"("type":"SCALAR",)", "", "accessors[1]: type must be SCALAR, VEC2,"},
      {"5125", "5124", "accessors[1]: componentType must be 5120 to 5123, 5125 or 5126"},
      {R"("byteOffset":48)", R"("byteOffset":-4)", "bufferViews[1]: byteOffset = -4 must be a"},
      {R"("primitives")", R"("others")", "meshes[0]: primitives is missing"},
      {R"("attributes")", R"("others")", "meshes[0]: primitives[0]: attributes is missing"},
      {R"("POSITION":0)", R"("POSITION":"a")", "POSITION must be a number, but its type is string"},
      {R"("POSITION":0)", R"("NORMAL":0)", "there is no triangle"},  // glTF: it shall be skipped
      {R"("indices":1)", R"("indices":1,"mode":7)", "mode = 7 must be 0 to 6"},
      {R"("indices":1)", R"("extensions":{"KHR_draco_mesh_compression":{}})", "it is compressed"},
      {R"("indices":1)", R"("indices":7)", "meshes[0]: primitives[0]: there is no accessors[7]"},
      {R"([{"uri":"wedge.bin","byteLength":96}])", "[3]", "buffers[0]: must be an object"},
      {R"("scenes":[{"nodes":[0]}])", R"("scenes":[{"nodes":["a"]}])",
       "scenes[0]: nodes must be numbers"},
      {"wedge.bin", "\xff", ": it is not UTF-8"},
      {R"("indices":1})", R"("indices":1)", "its JSON is invalid at byte"},
  };
  for (const auto& [was, is, words] : faults)
    EXPECT_THAT(fault_of(was, is), HasSubstr(words)) << is;
  EXPECT_THAT(error_of("a.gltf", good.substr(0, 99)), HasSubstr("was the file cut short?"));
}

TEST_F(ModelIo, RejectsOrStripsWhatWouldCrashAssimpInMaterials) {
  put("wedge.bin", wedge_binary());
  const auto textured = [&](const std::string& image, const std::string& info = "") {
    const std::string more =
        R"(,"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0)" + info +
        R"(}}}],"textures":[{"source":0}],"extensionsUsed":["KHR_texture_transform"],"images":[)" +
        image + "]";
    return wedge_gltf(R"({"mesh":0})", bin_file, more, R"(,"material":0)");
  };
  for (const auto& [image, words] : std::vector<std::pair<std::string, std::string>>{
           {R"({"uri":"data:foo;base64,AAAA"})", "images[0]: its media type must be image/png"},
           {R"({"uri":"data:image,AAAA"})", "images[0]: its media type must be image/png"},
           {R"({"uri":"\u0010\u0005\u0005AAAA"})", "images[0]: its uri has control characters"},
           {R"({"uri":"a.png","mimeType":3})", "images[0]: mimeType must be a text, but its type"}})
    EXPECT_THAT(error_of("a.gltf", textured(image)), HasSubstr(words));
  EXPECT_THAT(error_of("a.gltf", textured(R"({"mimeType":"a\u0000/png","bufferView":0})")),
              HasSubstr("must have a valid bufferView and mimetype"));
  put_image("bark.png");
  for (const std::string transform : {"[1]", "[]", R"(["a","b"])"}) {
    const std::string info =
        R"(,"extensions":{"KHR_texture_transform":{"offset":)" + transform + "}}";
    EXPECT_EQ(read("a.gltf", textured(R"({"uri":"bark.png"})", info)).mesh.triangles.size(), 4u);
  }
}

// assimp allocates for as many indices as a strip lacks.
TEST_F(ModelIo, RejectsPrimitivesWithTooFewVertices) {
  put("wedge.bin", wedge_binary());
  for (const auto& [mode, count] : {std::pair(2, 1), {3, 1}, {5, 2}, {6, 1}, {4, 2}}) {
    std::string bytes =
        wedge_gltf(R"({"mesh":0})", bin_file, "", fmt::format(R"(,"mode":{})", mode));
    bytes.replace(bytes.find(R"("count":12)"), 10, fmt::format(R"("count":{})", count));
    EXPECT_THAT(error_of("a.gltf", bytes),
                HasSubstr(fmt::format("{} vertices are too few for its mode, {}", count, mode)));
  }
}

// Animations, skins and morph targets have accessors of their own, which assimp would read.
TEST_F(ModelIo, IgnoresWhatIsNotShown) {
  put("wedge.bin", wedge_binary());
  const std::string animated = wedge_gltf(
      R"({"mesh":0,"skin":0,"camera":7})", bin_file,
      R"(,"skins":[{"joints":[99]}],"animations":[{"samplers":[{"input":99}],"channels":[]}])");
  EXPECT_EQ(read("a.gltf", animated).mesh.triangles.size(), 4u);
  std::string morphed = wedge_gltf(R"({"mesh":0})", bin_file, "", R"(,"targets":[{"POSITION":2}])");
  const std::string indices = R"("count":12})";
  morphed.insert(morphed.find(indices) + indices.size(),
                 R"(,{"componentType":5126,"type":"VEC3","count":4,"sparse":{"count":1}})");
  EXPECT_EQ(read("a.gltf", morphed).mesh.triangles.size(), 4u);
}

TEST_F(ModelIo, ReadsNoFileOutsideItsFolder) {
  put("wedge.bin", wedge_binary());
  const auto with = [&](const std::string& uri) {
    std::string bytes = wedge_gltf(R"({"mesh":0})", bin_file);
    return bytes.replace(bytes.find("wedge.bin"), 9, uri);
  };
  for (const std::string uri : {"../wedge.bin", "%2e%2e/wedge.bin", "a/../../wedge.bin",
                                "..\\\\wedge.bin", "file:///wedge.bin"}) {
    EXPECT_THAT(error_of("sub/a.gltf", with(uri)),
                HasSubstr("only files in its own folder are read"))
        << uri;
  }
  EXPECT_THAT(error_of("sub/a.gltf", with(in("wedge.bin").string())),
              HasSubstr("only files in its own folder are read"));
  EXPECT_THAT(error_of("sub/a.gltf", with("http://localhost/wedge.bin")),
              HasSubstr("cannot be read"));
  put("sub/parts/wedge.bin", wedge_binary());
  EXPECT_EQ(read("sub/a.gltf", with("parts/wedge.bin")).mesh.triangles.size(), 4u);
  // Of images and .mtl files, the name alone is looked up in the folder.
  const std::filesystem::path outside = put_image("bark.png");
  const std::string obj = "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const std::string& name : {std::string("../bark.png"), outside.string()}) {
    put("sub/a.mtl", "newmtl a\nmap_Kd " + name + "\n");
    EXPECT_THAT(error_of("sub/a.obj", obj), HasSubstr("only files in the model's folder are read"));
  }
  const std::filesystem::path inside = put_image("sub/bark.png");
  EXPECT_EQ(read("sub/a.obj", obj).surfaces.at(0).albedo.file, inside);
  put("c.mtl", "");
  EXPECT_THAT(error_of("sub/b.obj", "mtllib ../c.mtl\n" + obj.substr(obj.find("v 0"))),
              HasSubstr("only files in the model's folder are read"));
}

TEST_F(ModelIo, LimitsTheNumberOfNodeInstances) {
  put("wedge.bin", wedge_binary());
  // Each node has the next one twice, so that the first has the wedge 2^n times.
  const auto doublings = [&](int count) {
    std::string nodes;
    for (int i = 1; i <= count; ++i) nodes += fmt::format(R"({{"children":[{0},{0}]}},)", i);
    return wedge_gltf(nodes + R"({"mesh":0})", bin_file);
  };
  EXPECT_EQ(read("a.gltf", doublings(4)).mesh.triangles.size(), 4u * 16);
  std::string roots = doublings(14);  // 2^15 nodes for each root
  std::string list = "[0";
  for (int i = 0; i < 40; ++i) list += ",0";
  roots.replace(roots.find(R"("nodes":[0])") + 8, 3, list + "]");
  EXPECT_THAT(error_of("a.gltf", roots), HasSubstr("its nodes have more than 1e+06 descendants"));
  EXPECT_THAT(error_of("a.gltf", doublings(20)), HasSubstr("more than 1e+06 descendants"));
  std::string chain;
  for (int i = 1; i <= 20'000; ++i) chain += fmt::format(R"({{"children":[{}]}},)", i);
  EXPECT_THAT(error_of("a.gltf", wedge_gltf(chain + R"({"mesh":0})", bin_file)),
              HasSubstr("and its descendants are nested more than 1000 deep"));
}

// A mesh of 96 bytes, 10^6 times, of a primitive that refers to it 10^4 times.
TEST_F(ModelIo, LimitsTheMemoryOfInstances) {
  put("wedge.bin", wedge_binary());
  std::string nodes = R"({"children":[)";
  for (int i = 0; i < 900'000; ++i) nodes += i == 0 ? "1" : ",1";
  std::string bytes = wedge_gltf(nodes + R"(]},{"mesh":0})", bin_file);
  const std::string begin = R"("primitives":[)";
  const std::size_t at = bytes.find(begin) + begin.size();
  const std::string primitive = bytes.substr(at, bytes.find("]}", at) - at);
  std::string more;
  for (int i = 0; i < 10'000; ++i) more += primitive + ",";
  bytes.insert(at, more);
  EXPECT_THAT(error_of("a.gltf", bytes), HasSubstr("its meshes and their instances take 14"));
}

TEST_F(ModelIo, RejectsGltfNestedTooDeep) {
  put("wedge.bin", wedge_binary());
  const auto nested = [&](std::size_t levels) {
    // Brackets inside a string do not count.
    return wedge_gltf(R"({"mesh":0})", bin_file,
                      R"(,"extras":["\\\"[[)" + std::string(200, '[') + R"(\\",)" +
                          std::string(levels, '[') + std::string(levels, ']') + "]");
  };
  EXPECT_EQ(read("a.gltf", nested(98)).mesh.triangles.size(), 4u);
  for (const std::size_t levels : {99, 200'000}) {
    EXPECT_THAT(error_of("a.gltf", nested(levels)),
                HasSubstr("a.gltf: its JSON is nested more than 100 deep"));
  }
  std::string chain;
  for (int i = 1; i <= 20'000; ++i) chain += fmt::format(R"({{"children":[{}]}},)", i);
  EXPECT_THAT(error_of("a.gltf", wedge_gltf(chain + R"({"mesh":0})", bin_file)),
              HasSubstr("nodes[1000] and its descendants are nested more than 1000 deep"));
  EXPECT_THAT(error_of("a.gltf", wedge_gltf(R"({"mesh":0,"children":[0]})", bin_file)),
              HasSubstr("nodes[0] contains itself"));
  EXPECT_THAT(error_of("a.gltf", wedge_gltf(R"({"mesh":0,"children":[7]})", bin_file)),
              HasSubstr("nodes[0]: there is no nodes[7]"));
}

TEST_F(ModelIo, RejectsAMissingBuffer) {
  EXPECT_THAT(error_of("a.gltf", wedge_gltf(R"({"mesh":0})", bin_file)), HasSubstr("wedge.bin"));
}

/// Corners of a polygon in the plane z = x / 2 + y, which is not parallel to any axis.
std::string obj_polygon(const std::vector<glm::dvec2>& outline) {
  std::string vertices, face = "f";
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const glm::dvec2& p = outline[i];
    vertices += fmt::format("v {} {} {}\n", p.x, p.y, p.x / 2 + p.y);
    face += fmt::format(" {}", i + 1);
  }
  return vertices + face + "\n";
}

TEST_F(ModelIo, TriangulationCoversAPolygonExactlyOnce) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> radius(0.2, 1);
  std::vector<std::vector<glm::dvec2>> outlines{
      {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}},          // corners on its sides
      {{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}},  // a U
      {{0, 0}, {1, 1}, {0, 2}, {-3, 1}},
      // A frame: the hole is joined to the outline by an edge that is traversed in both directions.
      {{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}}};
  for (int n = 4; n < 60; ++n) {  // stars: simple for any radii
    std::vector<glm::dvec2> star;
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n;
      star.push_back(radius(random) * glm::dvec2(std::cos(angle), std::sin(angle)));
    }
    outlines.push_back(star);
  }
  for (const std::vector<glm::dvec2>& outline : outlines) {
    double shoelace = 0;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const glm::dvec2 &p = outline[i], &q = outline[(i + 1) % outline.size()];
      shoelace += p.x * q.y - q.x * p.y;
    }
    const Model model = read("a.obj", obj_polygon(outline));
    EXPECT_EQ(model.mesh.triangles.size(), outline.size() - 2);
    double sum = 0;
    for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
      const glm::dvec2 a(corner(model, i, 0)), b(corner(model, i, 1)), c(corner(model, i, 2));
      const double area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
      EXPECT_GT(area, 0);  // all positive, so that none overlap if they sum to the whole
      sum += area;
    }
    EXPECT_NEAR(sum, shoelace, 1e-14 * static_cast<double>(outline.size()));
  }
}

TEST_F(ModelIo, TriangulatesLargePolygonsQuickly) {
  std::vector<glm::dvec2> round, comb;
  for (int i = 0; i < 5000; ++i) {
    const double angle = 2 * std::numbers::pi * i / 5000;
    round.emplace_back(std::cos(angle), std::sin(angle));
    comb.emplace_back(5000 - i, i % 2 == 0 ? 100 : 1);
  }
  comb.emplace_back(0, 0);
  comb.emplace_back(5000, 0);
  EXPECT_EQ(read("a.obj", obj_polygon(round)).mesh.triangles.size(), 4998u);
  EXPECT_EQ(read("a.obj", obj_polygon(comb)).mesh.triangles.size(), 5000u);
}

// A file of a few megabytes may not take minutes.
TEST_F(ModelIo, TheWorkForAPolygonIsBounded) {
  constexpr int corners = 1'200'000;
  std::vector<glm::dvec2> round, comb;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners;
    round.emplace_back(std::cos(angle), std::sin(angle));
    comb.emplace_back(corners - i, i % 2 == 0 ? 100 : 1);
  }
  comb.emplace_back(0, 0);
  const std::clock_t begin = std::clock();
  EXPECT_EQ(read("a.obj", obj_polygon(round)).mesh.triangles.size(), corners - 2u);
  EXPECT_THAT(error_of("a.obj", obj_polygon(comb)),
              HasSubstr("1 polygons intersect themselves or are too complex"));
  // 3 s of processor time on the developer's machine; without bounds, hours.
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 60);
}

/// Public data sets; their counts were obtained with plyfile 1.1.5 and numpy 2.4.6, and by reading
/// the XML.
class SharedModel : public ModelIo {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(folder())) {
      GTEST_SKIP() << "there are no public models in " << folder() << "; set GROUNDRAY_SHARED_DATA";
    }
  }
  static std::filesystem::path folder() { return shared_data_folder() / "mesh"; }
};

TEST_F(SharedModel, StanfordBunny) {
  const std::string gunzip = fmt::format(
      "gunzip -c '{}' > '{}'", (folder() / "stanford_bunny_scans/bun_zipper.ply.gz").string(),
      in("bunny.ply").string());
  ASSERT_EQ(std::system(gunzip.c_str()), 0);
  const ModelFile bunny = read_model(in("bunny.ply"), {});
  EXPECT_EQ(bunny.model.mesh.triangles.size(), 69451u);
  EXPECT_EQ(bunny.model.mesh.vertices_m.size(), 34834u);  // those of 35947 that triangles use
  // 223 of its edges have one face, the others two.
  std::size_t borders = 0;
  for (const glm::uvec3& sides : testing::neighbours_of(bunny.model.mesh)) {
    for (int k = 0; k < 3; ++k) borders += sides[k] == testing::no_neighbour;
  }
  EXPECT_EQ(borders, 223u);
}

TEST_F(SharedModel, WarthogRobot) {
  const std::filesystem::path robot = folder() / "warthog_robot";
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(robot)) {
    if (entry.path().extension() != ".stl") continue;
    std::ifstream stl(entry.path(), std::ios::binary);
    stl.seekg(80);
    std::uint32_t triangles = 0;
    stl.read(reinterpret_cast<char*>(&triangles), sizeof triangles);
    const ModelFile part = read_model(entry.path(), drop);
    EXPECT_EQ(part.model.mesh.triangles.size() + part.dropped.degenerate, triangles) << entry;
    // In exact arithmetic 1 triangle of the bulkhead is flat and 1 has sides at 1.6e-15 rad.
    EXPECT_EQ(part.dropped.total(), entry.path().filename() == "bulkhead.stl" ? 2u : 0u) << entry;
    ++files;
  }
  EXPECT_EQ(files, 14u);
}

TEST(Model, CheckReportsEveryFault) {
  Model model;
  EXPECT_THAT(message_of([&] { check_model(model, "rock"); }),
              AllOf(HasSubstr("rock"), HasSubstr("no triangle"), HasSubstr("no surface")));
  model.mesh = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}};
  model.surfaces.resize(1);
  model.surface_of = {0};
  check_model(model, "rock");
  model.uv.resize(3);
  model.normals.resize(3, glm::vec3(0, 0, 1));
  check_model(model, "rock");
  model.mesh.vertices_m[1].y = std::numeric_limits<double>::infinity();
  model.mesh.triangles[0].z = 3;
  model.mesh.levels = {0};
  model.uv[2].x = std::numeric_limits<float>::quiet_NaN();
  model.normals[1].z = 2;
  model.surface_of = {1, 0};
  EXPECT_THAT(
      message_of([&] { check_model(model, "rock"); }),
      AllOf(HasSubstr("vertex 1 must have a finite position"),
            HasSubstr("triangle 0 refers to a vertex beyond the last of 3"),
            HasSubstr("a model must not have levels"), HasSubstr("vertex 2 must have finite uv"),
            HasSubstr("vertex 1 must have a normal of length 1"),
            HasSubstr("2 surfaces for 1 triangles"),
            HasSubstr("triangle 0 refers to a surface beyond the last of 1")));
  model.uv.pop_back();
  model.normals.pop_back();
  EXPECT_THAT(message_of([&] { check_model(model, "rock"); }),
              AllOf(HasSubstr("2 uv for 3 vertices"), HasSubstr("2 normals for 3 vertices")));
}

TEST(Model, BoundsCoverOnlyVerticesUsedByTriangles) {
  const TriangleMesh mesh{{{1, 2, 3}, {-1, 5, 0}, {0, 0, 9}, {99, 99, 99}}, {{0, 1, 2}}, {}};
  EXPECT_EQ(bounds_of(mesh).low_m, glm::dvec3(-1, 0, 0));
  EXPECT_EQ(bounds_of(mesh).high_m, glm::dvec3(1, 5, 9));
  EXPECT_GT(bounds_of({}).low_m.x, bounds_of({}).high_m.x);
}

}  // namespace
}  // namespace groundray::model_io_test
