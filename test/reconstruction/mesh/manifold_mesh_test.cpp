#include "reconstruction/mesh/manifold_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "test/support/scans/solid.h"
#include "test/support/terrain/surface_check.h"

namespace groundray::manifold_mesh_test {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

TriangleMesh some_points(std::size_t count) {
  TriangleMesh mesh;
  for (std::size_t i = 0; i < count; ++i)
    mesh.vertices_m.emplace_back(static_cast<double>(i), static_cast<double>(i * i), 0);
  return mesh;
}

void expect_borders_close(const TriangleMesh& mesh, const EdgePairs& pairs) {
  for (HalfEdge h = 0; h < pairs.twins.size(); ++h) {
    if (pairs.twins[h] != none) {
      EXPECT_EQ(pairs.twins[pairs.twins[h]], h);
    } else {
      const HalfEdge next = next_border(pairs, h);
      EXPECT_EQ(pairs.twins[next], none);
      EXPECT_EQ(corner_of(mesh.triangles, next_of(next)), corner_of(mesh.triangles, h));
    }
  }
}

TEST(ManifoldMesh, KeepsManifolds) {
  for (const TriangleMesh& mesh :
       {testing::icosphere(2, 3).mesh, testing::cylinder(1, 2, 12).mesh}) {
    const ManifoldMesh cut = cut_to_manifold(mesh);
    EXPECT_EQ(cut.shape.vertices_m, mesh.vertices_m);
    EXPECT_EQ(cut.shape.triangles, mesh.triangles);
    EXPECT_EQ(cut.tangled_edges + cut.dropped + cut.copies, 0u);
    EXPECT_TRUE(std::ranges::all_of(cut.pairs.twins, [](HalfEdge h) { return h != none; }));
  }
}

TEST(ManifoldMesh, SeparatesTrianglesThatTouchAtAPoint) {
  TriangleMesh mesh = some_points(5);
  mesh.triangles = {{0, 1, 2}, {2, 3, 4}};
  const ManifoldMesh cut = cut_to_manifold(mesh);
  EXPECT_EQ(cut.copies, 1u);
  EXPECT_EQ(cut.shape.triangles, (std::vector<glm::uvec3>{{0, 1, 2}, {5, 3, 4}}));
  EXPECT_EQ(cut.sources, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 2}));
}

TEST(ManifoldMesh, CutsWhereThreeTrianglesMeet) {
  TriangleMesh mesh = some_points(5);
  mesh.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  const ManifoldMesh cut = cut_to_manifold(mesh);
  EXPECT_EQ(cut.tangled_edges, 1u);
  EXPECT_EQ(cut.shape.vertices_m.size(), 9u);
  EXPECT_EQ(testing::border_edges(cut.shape), 9u);
}

TEST(ManifoldMesh, CutsBetweenInconsistentlyWoundTriangles) {
  TriangleMesh mesh = some_points(4);
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}};
  const ManifoldMesh cut = cut_to_manifold(mesh);
  EXPECT_EQ(cut.tangled_edges, 1u);
  EXPECT_EQ(testing::border_edges(cut.shape), 6u);
}

TEST(ManifoldMesh, DropsDegenerateAndRepeatedTriangles) {
  TriangleMesh mesh = some_points(4);
  mesh.triangles = {{0, 1, 2}, {1, 1, 2}, {1, 2, 0}, {2, 1, 3}, {3, 3, 3}};
  const ManifoldMesh cut = cut_to_manifold(mesh);
  EXPECT_EQ(cut.dropped, 3u);
  EXPECT_EQ(cut.shape.triangles, (std::vector<glm::uvec3>{{0, 1, 2}, {2, 1, 3}}));
  EXPECT_EQ(cut.tangled_edges, 0u);
}

TEST(ManifoldMesh, IsASurfaceForAnyTriangles) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 3000; ++trial) {
    const auto vertices = 3 + random() % 8, triangles = random() % 14;
    TriangleMesh mesh = some_points(vertices);
    const auto any = [&] { return static_cast<unsigned>(random() % vertices); };
    for (std::size_t i = 0; i < triangles; ++i) {
      const unsigned a = any(), b = any();
      mesh.triangles.emplace_back(a, b, any());
    }
    const ManifoldMesh cut = cut_to_manifold(mesh);
    EXPECT_THAT(testing::surface_faults(cut.shape), IsEmpty()) << "trial " << trial;
    EXPECT_EQ(cut.shape.triangles.size() + cut.dropped, triangles);
    EXPECT_EQ(cut.pairs.tangled_edges, 0u);
    expect_borders_close(cut.shape, cut.pairs);
    std::set<std::uint32_t> used;
    for (const glm::uvec3& t : cut.shape.triangles) used.insert({t.x, t.y, t.z});
    EXPECT_EQ(used.size(), cut.shape.vertices_m.size());
    for (std::size_t i = 0; i < cut.sources.size(); ++i)
      EXPECT_EQ(cut.shape.vertices_m[i], mesh.vertices_m[cut.sources[i]]);
  }
}

TEST(EdgePairs, TwinsRunInOppositeDirections) {
  const std::vector<glm::uvec3> triangles{{0, 1, 2}, {2, 1, 3}};
  EXPECT_THAT(pair_edges(triangles, 4).twins, ElementsAre(none, 3, none, 1, none, none));
}

TEST(EdgePairs, NonManifoldAndInconsistentlyWoundEdgesHaveNoTwins) {
  const std::vector<glm::uvec3> three{{0, 1, 2}, {1, 0, 3}, {1, 0, 4}};
  EXPECT_THAT(pair_edges(three, 5).twins, Each(none));
  const std::vector<glm::uvec3> against{{0, 1, 2}, {0, 1, 3}};
  EXPECT_THAT(pair_edges(against, 4).twins, Each(none));
}

TEST(DropConflicts, DropsLaterTrianglesAlongAnEdge) {
  std::vector<glm::uvec3> triangles{{0, 1, 2}, {1, 0, 3}, {1, 0, 4}, {5, 5, 6}};
  EXPECT_EQ(drop_conflicts(triangles, 7), 2u);
  EXPECT_THAT(triangles, ElementsAre(glm::uvec3(0, 1, 2), glm::uvec3(1, 0, 3)));
}

TEST(PartFans, EachFanGetsItsOwnVertex) {
  std::vector<glm::uvec3> triangles{{0, 1, 2}, {0, 3, 4}, {0, 5, 6}, {0, 2, 7}};
  EXPECT_THAT(part_fans(triangles, 8, pair_edges(triangles, 8)), ElementsAre(0, 0));
  EXPECT_THAT(triangles, ElementsAre(glm::uvec3(0, 1, 2), glm::uvec3(8, 3, 4), glm::uvec3(9, 5, 6),
                                     glm::uvec3(0, 2, 7)));
}

TEST(DropConflicts, AndPartFansMakeASurfaceOfAnyTriangles) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) {
    const unsigned vertices = 4 + static_cast<unsigned>(i) % 30;
    std::uniform_int_distribution<unsigned> any(0, vertices - 1);
    TriangleMesh mesh = some_points(vertices);
    for (int k = 0; k < 3 * i; ++k)
      mesh.triangles.emplace_back(any(random), any(random), any(random));
    const std::size_t before_it = mesh.triangles.size();
    const std::size_t dropped = drop_conflicts(mesh.triangles, vertices);
    EXPECT_EQ(mesh.triangles.size() + dropped, before_it);
    const EdgePairs pairs = pair_edges(mesh.triangles, vertices);
    EXPECT_EQ(pairs.tangled_edges + pairs.dropped, 0u);
    const std::vector<std::uint32_t> added = part_fans(mesh.triangles, vertices, pairs);
    mesh.vertices_m.resize(vertices + added.size());
    EXPECT_THAT(testing::surface_faults(mesh), IsEmpty());
    EXPECT_EQ(drop_conflicts(mesh.triangles, mesh.vertices_m.size()), 0u);
  }
}

TEST(ManifoldMesh, EmptyMeshStaysEmpty) {
  const ManifoldMesh cut = cut_to_manifold(some_points(4));
  EXPECT_TRUE(cut.shape.vertices_m.empty());
  EXPECT_TRUE(cut.shape.triangles.empty());
}

}  // namespace
}  // namespace groundray::manifold_mesh_test
