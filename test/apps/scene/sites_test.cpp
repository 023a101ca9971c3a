#include "apps/scene/sites.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/simulation.h"
#include "core/error.h"
#include "terrain/assets/asset.h"
#include "test/support/temporary_folder.h"

namespace groundray::sites_test {
namespace {

using groundray::testing::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Flat ground of 60 m x 60 m with a pit, at W = (1000, 2000) m.
class SitesOnFlatGround : public ::testing::Test {
 protected:
  SitesOnFlatGround() {
    std::ofstream dem(folder_ / "dem.asc");
    dem << "ncols 61\nnrows 61\nxllcorner 1000\nyllcorner 2000\ncellsize 1\n";
    for (int row = 0; row < 61; ++row) {
      for (int column = 0; column < 61; ++column) {
        const bool is_pit = std::abs(row - 40) < 5 && std::abs(column - 40) < 5;
        dem << (is_pit ? "4.8 " : "5 ");
      }
      dem << '\n';
    }
  }

  SceneSpec parse(const std::string& keys, const std::string& entries) const {
    return parse_scene("groundray: 1\nseed: 1\nduration_s: 0.1\nterrain:\n  dem: dem.asc\n" + keys +
                           "platform: {drive: {waypoints_m: [[1020, 2030], [1030, 2030]], "
                           "speed_m_s: 1, height_m: 0, footprint_m: [1, 1]}}\n"
                           "lidars:\n  - {name: top, preset: velodyne_vlp16, mount: "
                           "{translation_m: [0, 0, 2]}}\n" +
                           entries,
                       folder_ / "scene.yaml", testing::data_folder() / "sensors");
  }
  static Terrain load(const TerrainSpec& spec) { return {spec.dem, spec.options, spec.detail}; }

  TemporaryFolder folder_;
};

TEST_F(SitesOnFlatGround, SharesAreProductsOfTheConditions) {
  const TerrainSpec spec =
      parse("  water: {cell_m: 0.5}\n  canopy: {cell_m: 0.25, radius_m: 2}\n", "").terrain;
  const Terrain terrain = load(spec);
  Sites sites(spec, terrain);
  EXPECT_FALSE(sites.suitability({}));
  const glm::dvec2 pit = glm::dvec2(1040.5, 2020.5) - glm::dvec2(terrain.header().origin_w_m);
  sites.shade(std::vector<Crown>{{pit, 10}, {pit + glm::dvec2(-15, 0), 4}});
  const SiteConditions below{.trail = {}, .water = {}, .canopy = CoverLimits{.low = 0.5}};
  const auto is_below = sites.suitability(below);
  EXPECT_EQ(is_below(pit), 1);
  EXPECT_EQ(is_below(pit + glm::dvec2(-13, 0)), 1);
  EXPECT_EQ(is_below(pit + glm::dvec2(14, 0)), 0);
  // Half of a small disc is below a large one if its centre is at its edge: slightly less.
  const SiteConditions ramp{
      .trail = {}, .water = {}, .canopy = CoverLimits{.low = 0.5, .blend = 1}};
  EXPECT_NEAR(sites.suitability(ramp)(pit + glm::dvec2(10, 0)), 0.46, 0.03);
  const SiteConditions wet{
      .trail = {},
      .water = SiteConditions::Water{.quantity = SiteConditions::Water::Quantity::Depth,
                                     .limits = {.low = 0.1}},
      .canopy = CoverLimits{.low = 0.5}};
  const auto is_both = sites.suitability(wet);
  EXPECT_EQ(is_both(pit), 1);
  EXPECT_EQ(is_both(pit + glm::dvec2(8, 0)), 0);  // below crowns, but dry
  EXPECT_EQ(is_both(pit + glm::dvec2(-15, 0)), 0);
}

// The pit is 8 m wide at its bottom, with its middle at the samples 40, 40.
TEST_F(SitesOnFlatGround, DistancesCountFromStandingWater) {
  const TerrainSpec spec = parse("  water: {cell_m: 0.5}\n", "").terrain;
  const Terrain terrain = load(spec);
  Sites sites(spec, terrain);
  const SiteConditions near{
      .trail = {},
      .water = SiteConditions::Water{.quantity = SiteConditions::Water::Quantity::Distance,
                                     .limits = {.low = -1, .high = 5}},
      .canopy = {}};
  const auto is_near = sites.suitability(near);
  const glm::dvec2 pit = glm::dvec2(1040.5, 2020.5) - glm::dvec2(terrain.header().origin_w_m);
  EXPECT_EQ(is_near(pit), 1);
  EXPECT_EQ(is_near(pit + glm::dvec2(8, 0)), 1);
  EXPECT_EQ(is_near(pit + glm::dvec2(11, 0)), 0);
  EXPECT_EQ(is_near(pit + glm::dvec2(-11, 0)), 0);
}

TEST_F(SitesOnFlatGround, ALowerLimitOfZeroMetresFromWaterHasNoRamp) {
  SceneSpec spec =
      parse("  water: {cell_m: 0.5}\n",
            "scatter:\n  - {name: reeds, label: 3, density_per_m2: 0.1, models: [{asset: reed}],"
            " water: {distance_m: [0, 5], blend_m: 2}}\n");
  const Terrain terrain = load(spec.terrain);
  Sites sites(spec.terrain, terrain);
  const auto share = sites.suitability(spec.scatter.at(0).site);
  const glm::dvec2 pit = glm::dvec2(1040.5, 2020.5) - glm::dvec2(terrain.header().origin_w_m);
  EXPECT_EQ(share(pit), 1);
}

TEST_F(SitesOnFlatGround, UndergrowthStandsBelowCrowns) {
  const std::string oak =
      "objects: [{name: oak, label: 1, asset: oak, size_m: 12, at_m: [1030, 2030]}]\n";
  const auto count = [&](const std::string& canopy) {
    const SceneObjects objects =
        build_simulation(parse("", oak +
                                       "scatter: [{name: fern, label: 2, density_per_m2: 1, "
                                       "models: [{asset: stone}], canopy: " +
                                       canopy + "}]\n"))
            .scene_objects;
    EXPECT_EQ(objects.groups.at(1).name, "fern");
    return objects.groups.at(1).count;
  };
  const double below = count("[0.5, 1]"), beside = count("[0, 0.5]");
  const double radius_m = std::sqrt(
      foliage_area(make_asset({.kind = AssetKind::Oak, .size_m = 12})).crown_m2 / std::numbers::pi);
  // Half of the neighbourhood is covered at a distance that is slightly less than the radius.
  const double expected = std::numbers::pi * radius_m * radius_m;
  EXPECT_GT(radius_m, 4);
  EXPECT_LT(below, expected + 4 * std::sqrt(expected));
  EXPECT_GT(below, 0.75 * expected - 4 * std::sqrt(expected));
  EXPECT_NEAR(below + beside, 3600, 4 * 60);
}

TEST_F(SitesOnFlatGround, SpeciesCompete) {
  const auto counts = [&](const std::string& keys) {
    const SceneObjects objects =
        build_simulation(
            parse("",
                  "ecosystem:\n  - {name: oak, label: 1, asset: oak, density_per_m2: 0.2, sizes_m: "
                  "[12, 12], variants: 1}\n  - {name: birch, label: 2, asset: birch, "
                  "density_per_m2: 0.5, sizes_m: [3, 6]" +
                      keys + "}\n"))
            .scene_objects;
    EXPECT_EQ(objects.groups.size(), 2u);
    return std::vector<std::uint32_t>{objects.groups.at(0).count, objects.groups.at(1).count};
  };
  const auto yielding = counts(""), tolerant = counts(", tolerance: 1");
  EXPECT_EQ(yielding[0], tolerant[0]);  // birches do not matter to taller oaks
  EXPECT_GT(yielding[0], 5u);
  EXPECT_LT(yielding[0], 60u);  // of 720 seedlings
  EXPECT_LT(yielding[1], 600u);
  EXPECT_NEAR(tolerant[1], 1800, 4 * std::sqrt(1800));  // all of them
}

TEST_F(SitesOnFlatGround, ACanopyNeedsTrees) {
  EXPECT_THAT(
      [&] {
        build_simulation(parse("",
                               "scatter: [{name: fern, label: 2, density_per_m2: 1, models: "
                               "[{asset: fern}], canopy: [0.5, 1]}]\n"));
      },
      ThrowsMessage<Error>(HasSubstr("no plant with foliage is 2 m high or higher")));
}

}  // namespace
}  // namespace groundray::sites_test
