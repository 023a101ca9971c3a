#include "reconstruction/mesh/simplify/collapsible_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "test/support/scans/solid.h"
#include "test/support/terrain/plan_check.h"

namespace groundray::collapsible_mesh_test {
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

TriangleMesh triangles_of(const CollapsibleMesh& mesh) {
  TriangleMesh out;
  std::vector<std::uint32_t> numbers(mesh.vertices(), none);
  for (std::uint32_t i = 0; i < mesh.numbers(); ++i) {
    if (!mesh.has_triangle(i)) continue;
    glm::uvec3 t = mesh.corners(i);
    for (int k = 0; k < 3; ++k) {
      std::uint32_t& number = numbers[t[k]];
      if (number == none) {
        number = static_cast<std::uint32_t>(out.vertices_m.size());
        out.vertices_m.emplace_back(0);
      }
      t[k] = number;
    }
    out.triangles.push_back(t);
  }
  return out;
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
void expect_star(const CollapsibleMesh& mesh, std::uint32_t vertex) {
  Star star;
  mesh.gather(vertex, star);
  ASSERT_EQ(star.centre, vertex);
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < mesh.numbers(); ++i) {
    if (!mesh.has_triangle(i)) continue;
    const glm::uvec3 t = mesh.corners(i);
    count += t.x == vertex || t.y == vertex || t.z == vertex;
  }
  ASSERT_EQ(star.spokes.size(), count);
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_EQ(mesh.from(star.spokes[i]), vertex);
    EXPECT_EQ(mesh.to(star.spokes[i]), star.ring[i]);
    EXPECT_EQ(mesh.to(next_of(star.spokes[i])), star.ring[(i + 1) % star.ring.size()]);
  }
}

TEST(CollapsibleMesh, StaysManifold) {
  Random random(5);
  for (int i = 0; i < 12; ++i) {
    const TriangleMesh begun = i % 3 == 0 ? testing::icosphere(1, 2).mesh : torn_sheet(9, random);
    const ManifoldMesh manifold = cut_to_manifold(begun);
    CollapsibleMesh mesh(manifold);
    const long before = characteristic(manifold.shape);
    Star star;
    std::size_t collapses = 0;
    for (int k = 0; k < 4000; ++k) {
      const auto vertex = static_cast<std::uint32_t>(random() % mesh.vertices());
      if (!mesh.has_vertex(vertex)) continue;
      mesh.gather(vertex, star);
      const std::size_t to = star.is_open() ? (random() % 2 == 0 ? 0 : star.ring.size() - 1)
                                            : random() % star.ring.size();
      if (!mesh.may_collapse(star, to)) continue;
      const std::size_t vanishing = star.is_open() ? 1 : 2, triangles = mesh.triangles();
      mesh.collapse(star, to);
      EXPECT_EQ(mesh.triangles() + vanishing, triangles);
      EXPECT_FALSE(mesh.has_vertex(vertex));
      if (++collapses % 7 != 0) continue;
      const TriangleMesh now = triangles_of(mesh);
      ASSERT_EQ(testing::manifold_faults(now), 0u);
      ASSERT_EQ(characteristic(now), before);
      for (const std::uint32_t neighbour : star.ring) expect_star(mesh, neighbour);
    }
    EXPECT_GT(collapses, 20u);
    // A ball is reduced to a tetrahedron, a sheet to few triangles for each piece and hole.
    if (i % 3 == 0) {
      EXPECT_EQ(mesh.triangles(), 4u);
    }
  }
}

}  // namespace
}  // namespace groundray::collapsible_mesh_test
