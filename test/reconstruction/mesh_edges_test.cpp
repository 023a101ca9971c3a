#include "reconstruction/mesh_edges.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "test/support/surface_check.h"

namespace groundray {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::surface_faults;

constexpr auto none = no_edge;

TEST(MeshEdges, TwinsAreTheSameEdgeRunBack) {
  const std::vector<glm::uvec3> triangles{{0, 1, 2}, {2, 1, 3}};
  EXPECT_THAT(edge_twins(triangles, 4), ElementsAre(none, 3, none, 1, none, none));
}

TEST(MeshEdges, WhereThreeMeetOrWindingsDifferThereAreNone) {
  const std::vector<glm::uvec3> three{{0, 1, 2}, {1, 0, 3}, {1, 0, 4}};
  EXPECT_THAT(edge_twins(three, 5), ::testing::Each(none));
  const std::vector<glm::uvec3> against{{0, 1, 2}, {0, 1, 3}};
  EXPECT_THAT(edge_twins(against, 4), ::testing::Each(none));
}

TEST(MeshEdges, LaterTrianglesAlongAnEdgeAreLeftOut) {
  std::vector<glm::uvec3> triangles{{0, 1, 2}, {1, 0, 3}, {1, 0, 4}, {5, 5, 6}};
  std::vector<std::uint32_t> doubled;
  const ManifoldFaults faults = make_manifold(triangles, 7, doubled);
  EXPECT_EQ(faults.triangles, 2u);
  EXPECT_EQ(faults.vertices, 0u);
  EXPECT_THAT(triangles, ElementsAre(glm::uvec3(0, 1, 2), glm::uvec3(1, 0, 3)));
}

TEST(MeshEdges, EachFanGetsAVertexOfItsOwn) {
  std::vector<glm::uvec3> triangles{{0, 1, 2}, {0, 3, 4}, {0, 5, 6}, {0, 2, 7}};
  std::vector<std::uint32_t> doubled;
  const ManifoldFaults faults = make_manifold(triangles, 8, doubled);
  EXPECT_EQ(faults.triangles, 0u);
  EXPECT_EQ(faults.vertices, 2u);
  EXPECT_THAT(doubled, ElementsAre(0, 0));
  EXPECT_THAT(triangles, ElementsAre(glm::uvec3(0, 1, 2), glm::uvec3(8, 3, 4), glm::uvec3(9, 5, 6),
                                     glm::uvec3(0, 2, 7)));
}

TEST(MeshEdges, AnyTrianglesBecomeASurface) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) {
    const unsigned vertices = 4 + static_cast<unsigned>(i) % 30;
    std::uniform_int_distribution<unsigned> any(0, vertices - 1);
    TriangleMesh mesh;
    mesh.vertices_m.resize(vertices);
    for (int k = 0; k < 3 * i; ++k)
      mesh.triangles.emplace_back(any(random), any(random), any(random));
    std::vector<std::uint32_t> doubled;
    const std::size_t before = mesh.triangles.size();
    const ManifoldFaults faults = make_manifold(mesh.triangles, vertices, doubled);
    EXPECT_EQ(mesh.triangles.size() + faults.triangles, before);
    EXPECT_EQ(doubled.size(), faults.vertices);
    mesh.vertices_m.resize(vertices + doubled.size());
    EXPECT_THAT(surface_faults(mesh), IsEmpty());
    // It is one already: nothing more is left out.
    doubled.clear();
    const ManifoldFaults again = make_manifold(mesh.triangles, mesh.vertices_m.size(), doubled);
    EXPECT_EQ(again.triangles + again.vertices, 0u);
  }
}

}  // namespace
}  // namespace groundray
