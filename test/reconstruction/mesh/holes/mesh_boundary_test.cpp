#include "reconstruction/mesh/holes/mesh_boundary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

namespace groundray::mesh_boundary_test {
namespace {

// Some of six triangles round vertex 0.
TriangleMesh wheel(const std::vector<unsigned>& spokes) {
  TriangleMesh mesh;
  mesh.vertices_m = {{0, 0, 0},  {2, 0, 0},   {1, 2, 0}, {-1, 2, 0},
                     {-2, 0, 0}, {-1, -2, 0}, {1, -2, 0}};
  for (const unsigned k : spokes) mesh.triangles.emplace_back(0, 1 + k, 1 + (k + 1) % 6);
  return mesh;
}

TEST(MeshBoundary, PassesEachVertexOnce) {
  SurfaceMesh surface = to_surface(wheel({0, 1, 3}));  // two pieces that touch at the centre
  const std::vector<BoundaryLoop> loops = find_boundary(surface);
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_EQ(loops[0].size() + loops[1].size(), 7u);
}

// Two holes of a sheet that touch at a vertex: two of the triangles around it are missing.
TEST(MeshBoundary, SeparatesHolesThatTouch) {
  TriangleMesh mesh = wheel({0, 1, 3, 4});
  for (unsigned k = 0; k < 6; ++k) {
    mesh.vertices_m.push_back(2.0 * mesh.vertices_m[1 + k]);
    const unsigned a = 1 + k, b = 1 + (k + 1) % 6, c = 7 + k, d = 7 + (k + 1) % 6;
    mesh.triangles.emplace_back(a, c, b);
    mesh.triangles.emplace_back(b, c, d);
  }
  SurfaceMesh surface = to_surface(mesh);
  std::vector<std::set<std::uint32_t>> found;
  for (const BoundaryLoop& loop : find_boundary(surface)) {
    const std::vector<std::uint32_t> vertices = vertices_of(surface, loop);
    EXPECT_EQ(vertices.size(), loop.size());
    found.emplace_back(vertices.begin(), vertices.end());
  }
  EXPECT_THAT(found, ::testing::UnorderedElementsAre(std::set<std::uint32_t>{0, 3, 4},
                                                     std::set<std::uint32_t>{0, 6, 1},
                                                     std::set<std::uint32_t>{7, 8, 9, 10, 11, 12}));
}

TEST(MeshBoundary, ContainsEachBorderEdgeOnceInClosedLoops) {
  std::mt19937_64 random(6);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto vertices = 3 + random() % 8, triangles = random() % 14;
    TriangleMesh mesh;
    mesh.vertices_m.resize(vertices);
    const auto any = [&] { return static_cast<unsigned>(random() % vertices); };
    for (std::size_t i = 0; i < triangles; ++i) {
      const unsigned a = any(), b = any();
      mesh.triangles.emplace_back(a, b, any());
    }
    SurfaceMesh surface = to_surface(mesh);
    std::size_t borders = 0, in_loops = 0;
    for (const auto h : surface.halfedges())
      borders +=
          surface.is_boundary(h) && !surface.status(surface.opposite_face_handle(h)).tagged();
    for (const BoundaryLoop& loop : find_boundary(surface)) {
      std::set<std::uint32_t> passed;
      for (std::size_t i = 0; i < loop.size(); ++i) {
        const auto next = loop[(i + 1) % loop.size()];
        EXPECT_EQ(surface.next_halfedge_handle(loop[i]), next);
        EXPECT_EQ(surface.to_vertex_handle(loop[i]), surface.from_vertex_handle(next));
        EXPECT_TRUE(surface.is_boundary(loop[i]));
        EXPECT_TRUE(passed.insert(number_of(surface.from_vertex_handle(loop[i]))).second);
      }
      in_loops += loop.size();
    }
    EXPECT_EQ(in_loops, borders) << "trial " << trial;
  }
}

}  // namespace
}  // namespace groundray::mesh_boundary_test
