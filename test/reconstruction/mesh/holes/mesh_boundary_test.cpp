#include "reconstruction/mesh/holes/mesh_boundary.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

namespace groundray::mesh_rims_test {
namespace {

// Some of six triangles round vertex 0.
TriangleMesh wheel(const std::vector<unsigned>& spokes) {
  TriangleMesh mesh;
  mesh.vertices_m = {{0, 0, 0},  {2, 0, 0},   {1, 2, 0}, {-1, 2, 0},
                     {-2, 0, 0}, {-1, -2, 0}, {1, -2, 0}};
  for (const unsigned k : spokes) mesh.triangles.emplace_back(0, 1 + k, 1 + (k + 1) % 6);
  return mesh;
}

TEST(MeshBoundary, PassEachVertexOnce) {
  const TriangleMesh mesh = wheel({0, 1, 3});  // two pieces that touch at the centre
  const MeshBoundary boundary =
      find_boundary(mesh, pair_edges(mesh.triangles, mesh.vertices_m.size()));
  ASSERT_EQ(boundary.chains.size(), 2u);
  EXPECT_EQ(boundary.chains[0].size() + boundary.chains[1].size(), 7u);
}

TEST(MeshBoundary, ContainEachBorderEdgeOnceInClosedChains) {
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
    const EdgePairs pairs = pair_edges(mesh.triangles, mesh.vertices_m.size());
    const MeshBoundary boundary = find_boundary(mesh, pairs);
    std::size_t borders = 0, in_chains = 0;
    for (HalfEdge h = 0; h < pairs.twins.size(); ++h)
      borders += pairs.twins[h] == none && !pairs.is_dropped[h / 3];
    for (const std::vector<HalfEdge>& chain : boundary.chains) {
      std::set<std::uint32_t> passed;
      for (std::size_t i = 0; i < chain.size(); ++i) {
        const HalfEdge next = chain[(i + 1) % chain.size()];
        EXPECT_EQ(boundary.next[chain[i]], next);
        EXPECT_EQ(corner_of(mesh.triangles, next_of(next)), corner_of(mesh.triangles, chain[i]));
        EXPECT_EQ(pairs.twins[chain[i]], none);
        EXPECT_TRUE(passed.insert(corner_of(mesh.triangles, chain[i])).second);
      }
      in_chains += chain.size();
    }
    EXPECT_EQ(in_chains, borders) << "trial " << trial;
  }
}

TEST(MeshBoundary, StarsAreTheTrianglesOfAVertex) {
  const TriangleMesh mesh = wheel({0, 1, 2, 3});
  const VertexStars stars(mesh, pair_edges(mesh.triangles, mesh.vertices_m.size()));
  EXPECT_EQ(stars.at(0).size(), 4u);
  EXPECT_EQ(stars.at(1).size(), 1u);
  EXPECT_EQ(stars.at(2).size(), 2u);
  EXPECT_TRUE(stars.at(6).empty());
  EXPECT_TRUE(stars.has_edge(mesh, 2, 3) && stars.has_edge(mesh, 3, 2));
  EXPECT_FALSE(stars.has_edge(mesh, 1, 3));
}

TEST(MeshPieces, AreConnectedByEdges) {
  const TriangleMesh mesh = wheel({0, 3, 1, 4});
  EXPECT_EQ(number_pieces(pair_edges(mesh.triangles, mesh.vertices_m.size())),
            (std::vector<std::uint32_t>{0, 1, 0, 1}));
}

}  // namespace
}  // namespace groundray::mesh_rims_test
