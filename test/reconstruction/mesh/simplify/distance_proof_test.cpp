#include "reconstruction/mesh/simplify/distance_proof.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "reconstruction/mesh/accuracy/accuracy.h"

namespace groundray::distance_proof_test {
namespace {

using Random = std::mt19937_64;

TriangleMesh rough_sheet(unsigned side, double height_m, Random& random) {
  std::uniform_real_distribution<double> noise(-height_m, height_m);
  TriangleMesh mesh;
  for (unsigned row = 0; row < side; ++row) {
    for (unsigned column = 0; column < side; ++column)
      mesh.vertices_m.emplace_back(column, row, noise(random));
  }
  for (unsigned row = 0; row + 1 < side; ++row) {
    for (unsigned column = 0; column + 1 < side; ++column) {
      const unsigned a = row * side + column;
      mesh.triangles.emplace_back(a, a + 1, a + side);
      mesh.triangles.emplace_back(a + 1, a + side + 1, a + side);
    }
  }
  return mesh;
}

// A triangle whose permitted distance is below its largest distance is reported, others are not.
// Oracle: the distance of each triangle, from a search of its own.
TEST(DistanceProof, FindsTrianglesBeyondTheDistance) {
  Random random(3);
  for (int i = 0; i < 4; ++i) {
    const TriangleMesh from = rough_sheet(12, 0.6, random);
    const ClosestPoint to(rough_sheet(12, 0.6, random));
    std::vector<double> largest_m;
    for (const glm::uvec3& t : from.triangles) {
      const TriangleMesh one{
          {from.vertices_m[t.x], from.vertices_m[t.y], from.vertices_m[t.z]}, {{0, 1, 2}}, {}};
      largest_m.push_back(MeshDistance(one, to).largest(1e-6).at_least_m);
    }
    for (const double most_m : {0.2, 0.4, 0.6}) {
      std::vector<bool> is_beyond(from.triangles.size());
      for (const Beyond& beyond : find_beyond(from, to, most_m)) {
        is_beyond[beyond.triangle] = true;
        EXPECT_GE(largest_m[beyond.triangle] + 2e-6, beyond.distance_m);
      }
      for (std::size_t k = 0; k < largest_m.size(); ++k) {
        if (largest_m[k] > most_m) {
          EXPECT_TRUE(is_beyond[k]) << k;
        }
        if (largest_m[k] < 0.998 * most_m) {
          EXPECT_FALSE(is_beyond[k]) << k;
        }
      }
    }
  }
}

// Triangles of any size in one plane are within the smallest bound.
TEST(DistanceProof, ProvesThatCoplanarMeshesCoincide) {
  Random random(4);
  const ClosestPoint fine(rough_sheet(30, 0, random));
  const TriangleMesh coarse{
      {{0, 0, 0}, {29, 0, 0}, {29, 29, 0}, {0, 29, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
  EXPECT_TRUE(find_beyond(coarse, fine, 1e-5).empty());
  EXPECT_TRUE(find_beyond(fine.mesh(), ClosestPoint(coarse), 1e-9).empty());
}

}  // namespace
}  // namespace groundray::distance_proof_test
