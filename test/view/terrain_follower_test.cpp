#include "apps/view/layers/terrain_follower.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::terrain_follower_test {
namespace {

using testing::TemporaryFolder;

class Followed : public ::testing::Test {
 protected:
  void SetUp() override {
    const HeightGrid grid = testing::fractal(513, 2, 80, Seed{4});
    testing::GeoTiff file{.size = {513, 513}};
    file.values.assign(grid.heights_m().begin(), grid.heights_m().end());
    file.save(folder_ / "dem.tif");
  }
  std::filesystem::path dem() const { return folder_ / "dem.tif"; }
  static glm::dvec3 eye(double east_m) { return {500100 + east_m, 5149500, 150}; }

 private:
  TemporaryFolder folder_;
};

std::vector<float> places_of(const FollowedTerrain& terrain) {
  const auto places = coordinates(*terrain.layer.data);
  return {places.begin(), places.end()};
}

TEST_F(Followed, TerrainDependsOnTheViewpointOnly) {
  TerrainFollower follower(dem(), {.triangles = 60'000});
  const std::vector<float> here = places_of(follower.follow(eye(0)));
  const std::vector<float> there = places_of(follower.follow(eye(400)));
  EXPECT_NE(here, there);
  EXPECT_EQ(here, places_of(follower.follow(eye(0))));
  TerrainFollower other(dem(), {.triangles = 60'000});
  EXPECT_EQ(there, places_of(other.follow(eye(400))));
}

TEST_F(Followed, TerrainKeepsToTheTriangleBudget) {
  for (const std::size_t most : {20'000u, 100'000u}) {
    TerrainFollower follower(dem(), {.triangles = most});
    const FollowedTerrain terrain = follower.follow(eye(0));
    EXPECT_LE(terrain.triangles, most);
    EXPECT_GT(terrain.triangles, most / 10);
    EXPECT_EQ(terrain.triangles, terrain.layer.triangles());
    EXPECT_GT(terrain.memory_bytes, 0u);
  }
}

// The kept angle, times the distance from the eye, bounds the certified deviation of each triangle.
TEST_F(Followed, TerrainKeepsTheCertifiedAngle) {
  TerrainFollower follower(dem(), {.triangles = 60'000});
  const FollowedTerrain terrain = follower.follow(eye(0));
  const LayerColumn* const deviation = terrain.layer.find("certified deviation");
  ASSERT_NE(deviation, nullptr);
  const auto corner = corners(*terrain.layer.data);
  for (std::size_t i = 0; i < terrain.triangles; ++i) {
    const glm::dvec3 p = terrain.layer.p_w_m(corner[3 * i]);
    const double distance_m = glm::length(p - eye(0));
    ASSERT_LE(terrain.layer.value(*deviation, static_cast<vtkIdType>(i)),
              terrain.angle_rad * distance_m * (1 + 1e-6));
  }
}

// A repeated request reuses the terrain, also if the view's own frame has rounded the position of
// the eye.
TEST_F(Followed, TerrainIsReusedForTheSameViewpoint) {
  TerrainFollower follower(dem());
  const FollowedTerrain terrain = follower.follow(eye(0));
  EXPECT_EQ(follower.follow(eye(1e-9)).layer.data, terrain.layer.data);
  EXPECT_NE(follower.follow(eye(1)).layer.data, terrain.layer.data);
}

// If the memory does not suffice, the angle is not kept everywhere, and this is reported.
TEST_F(Followed, TerrainReportsALackOfMemory) {
  const FollowedTerrain whole = TerrainFollower(dem()).follow(eye(0));
  EXPECT_TRUE(whole.is_angle_kept);
  const FollowedTerrain part = TerrainFollower(dem(), {.memory_bytes = 1'600'000}).follow(eye(0));
  EXPECT_FALSE(part.is_angle_kept);
  EXPECT_GT(part.levels, 2);
  EXPECT_LT(part.triangles, whole.triangles);
  EXPECT_NE(part.layer.facts[1].find("as far as its windows reach"), std::string::npos);
}

TEST_F(Followed, TerrainIsCoarserDuringMotion) {
  TerrainFollower follower(dem());
  const FollowedTerrain terrain = follower.follow(eye(0));
  EXPECT_LT(terrain.layer.coarse->GetNumberOfPolys(), 100'001);
  EXPECT_GT(terrain.layer.coarse->GetNumberOfPolys(), 0);
}

}  // namespace
}  // namespace groundray::terrain_follower_test
