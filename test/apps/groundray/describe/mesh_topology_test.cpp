#include "apps/groundray/describe/mesh_topology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <utility>

#include "terrain/assets/asset.h"

namespace groundray::mesh_topology_test {
namespace {

TEST(MeshTopology, OfASphereIsClosedWithNearlyItsAreaAndVolume) {
  constexpr double radius_m = 2;
  TriangleMesh sphere = make_asset({.kind = AssetKind::SphereTarget, .size_m = 2 * radius_m}).mesh;
  MeshTopology topology = topology_of(sphere);
  EXPECT_TRUE(topology.is_closed());
  // Its 5120 triangles are inscribed: both are too small, by less than half a percent.
  const double area_m2 = 4 * std::numbers::pi * radius_m * radius_m;
  EXPECT_LT(topology.area_m2, area_m2);
  EXPECT_GT(topology.area_m2, 0.995 * area_m2);
  EXPECT_LT(topology.volume_m3, area_m2 * radius_m / 3);
  EXPECT_GT(topology.volume_m3, 0.995 * area_m2 * radius_m / 3);

  const double volume_m3 = topology.volume_m3;
  for (glm::uvec3& triangle : sphere.triangles) std::swap(triangle.x, triangle.y);
  topology = topology_of(sphere);
  EXPECT_TRUE(topology.is_closed());
  EXPECT_NEAR(topology.volume_m3, -volume_m3, 1e-12 * volume_m3);

  std::swap(sphere.triangles[7].x, sphere.triangles[7].y);
  topology = topology_of(sphere);
  EXPECT_EQ(topology.reversed_edges, 3u);
  EXPECT_FALSE(topology.is_closed());
  EXPECT_EQ(topology.volume_m3, 0);

  sphere.triangles.erase(sphere.triangles.begin() + 7);
  topology = topology_of(sphere);
  EXPECT_EQ(topology.boundary_edges, 3u);
  EXPECT_EQ(topology.reversed_edges, 0u);
}

TEST(MeshTopology, OfNothingIsNothing) {
  const MeshTopology topology = topology_of({});
  EXPECT_EQ(topology.area_m2, 0);
  EXPECT_EQ(topology.boundary_edges, 0u);
}

}  // namespace
}  // namespace groundray::mesh_topology_test
