#include "reconstruction/mesh/merge/consensus.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace groundray::consensus_test {
namespace {

constexpr CoverTolerance limits{.apart_m = 0.1, .least_cosine = 0.5};

MeasuredMesh square_at(double z_m) {
  MeasuredMesh mesh;
  mesh.shape.vertices_m = {{0, 0, z_m}, {1, 0, z_m}, {1, 1, z_m}, {0, 1, z_m}};
  mesh.shape.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.sd_m.assign(4, 0.01f);
  return mesh;
}

// A vertex in the middle of an edge, seen by another scan 0.04 m above: it moves halfway, unless
// the other scan's surface there is refuted.
TEST(Consensus, IgnoresRefutedSurfaces) {
  const std::array meshes{square_at(0), square_at(0.04)};
  for (const char is_refuted : {char{0}, char{1}}) {
    std::vector<RatedSurface> rated;
    for (const MeasuredMesh& mesh : meshes)
      rated.push_back({CoverSurface(mesh.shape, mesh.sd_m, limits), {0.001f, 0.001f}, {}});
    rated[1].is_refuted.assign(2, is_refuted);
    const std::vector<VertexCovers> covers = find_covers(rated, {});
    const std::vector<ConsensusScan> scans{{&rated[0], &meshes[0], &covers[0]},
                                           {&rated[1], &meshes[1], &covers[1]}};
    StitchedMesh stitched;
    stitched.vertices.push_back(
        {.p = {0.5, 0.5, 0}, .normal = {0, 0, 1}, .sd_m = 0.01f, .nearest = 0});
    EXPECT_EQ(move_to_consensus(stitched, scans), is_refuted != 0 ? 0u : 1u);
    EXPECT_NEAR(stitched.vertices[0].p.z, is_refuted != 0 ? 0 : 0.02, 1e-7);
  }
}

}  // namespace
}  // namespace groundray::consensus_test
