#include "reconstruction/mesh/simplify/star.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "reconstruction/mesh/manifold_mesh.h"
#include "test/support/scans/solid.h"
#include "test/support/terrain/plan_check.h"

namespace groundray::star_test {
namespace {

using Random = std::mt19937_64;

// Sheet with some triangles missing.
TriangleMesh torn_sheet(unsigned side, Random& random) {
  TriangleMesh mesh;
  for (unsigned row = 0; row < side; ++row) {
    for (unsigned column = 0; column < side; ++column) mesh.vertices_m.emplace_back(column, row, 0);
  }
  for (unsigned row = 0; row + 1 < side; ++row) {
    for (unsigned column = 0; column + 1 < side; ++column) {
      const unsigned a = row * side + column;
      if (random() % 8 != 0) mesh.triangles.emplace_back(a, a + 1, a + side);
      if (random() % 8 != 0) mesh.triangles.emplace_back(a + 1, a + side + 1, a + side);
    }
  }
  return mesh;
}

// Euler characteristic (vertices - edges + triangles), which collapses do not change.
long characteristic(const TriangleMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  }
  return static_cast<long>(mesh.vertices_m.size() + mesh.triangles.size()) -
         static_cast<long>(edges.size());
}

// Oracle: the star as the corners of the triangles define it.
void expect_star(const SurfaceMesh& mesh, std::uint32_t vertex) {
  Star star;
  gather(mesh, vertex, star);
  ASSERT_EQ(star.centre, vertex);
  std::set<std::uint32_t> around;
  for (const auto face : mesh.faces()) {
    const glm::uvec3 t = corners_of(mesh, number_of(face));
    if (t.x == vertex || t.y == vertex || t.z == vertex) around.insert(number_of(face));
  }
  ASSERT_EQ(star.triangles(), around.size());
  ASSERT_EQ(star.spokes.size(), star.ring.size());
  for (std::size_t i = 0; i < star.triangles(); ++i) {
    EXPECT_EQ(around.erase(star.triangle(i)), 1u);
    const glm::uvec3 t = corners_of(mesh, star.triangle(i));
    const int centre = t.x == vertex ? 0 : t.y == vertex ? 1 : 2;
    EXPECT_EQ(t[(centre + 1) % 3], star.ring[i]);
    EXPECT_EQ(t[(centre + 2) % 3], star.ring[(i + 1) % star.ring.size()]);
    EXPECT_EQ(number_of(mesh.to_vertex_handle(star.spokes[i])), star.ring[i]);
  }
}

TEST(Star, CollapsesKeepSurfaceManifold) {
  Random random(5);
  for (int i = 0; i < 12; ++i) {
    const TriangleMesh begun = i % 3 == 0 ? testing::icosphere(1, 2).mesh : torn_sheet(9, random);
    const ManifoldMesh manifold = cut_to_manifold(begun);
    SurfaceMesh mesh = to_surface(manifold.shape);
    const long before = characteristic(manifold.shape);
    std::size_t triangles = manifold.shape.triangles.size();
    Star star;
    std::size_t collapses = 0;
    for (int k = 0; k < 4000; ++k) {
      const auto vertex = static_cast<std::uint32_t>(random() % mesh.n_vertices());
      if (mesh.status(mesh.vertex_handle(vertex)).deleted()) continue;
      gather(mesh, vertex, star);
      const std::size_t to = star.is_open() ? (random() % 2 == 0 ? 0 : star.ring.size() - 1)
                                            : random() % star.ring.size();
      if (!may_collapse(star, to)) continue;
      triangles -= star.is_open() ? 1 : 2;
      collapse(mesh, star, to);
      EXPECT_TRUE(mesh.status(mesh.vertex_handle(vertex)).deleted());
      if (++collapses % 7 != 0) continue;
      const TriangleMesh now = remaining_mesh(mesh).mesh;
      ASSERT_EQ(now.triangles.size(), triangles);
      ASSERT_EQ(testing::manifold_faults(now), 0u);
      ASSERT_EQ(characteristic(now), before);
      for (const std::uint32_t neighbour : star.ring) expect_star(mesh, neighbour);
    }
    EXPECT_GT(collapses, 20u);
    // A ball is reduced to a tetrahedron, a sheet to few triangles for each piece and hole.
    if (i % 3 == 0) {
      EXPECT_EQ(triangles, 4u);
    }
  }
}

}  // namespace
}  // namespace groundray::star_test
