#include "terrain/assets/asset_sway.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <string_view>

#include "terrain/assets/asset_defaults.h"

namespace groundray::asset_sway_test {
namespace {

constexpr std::array<std::string_view, 7> trees{
    "conifer", "broadleaf_tree", "spruce", "pine", "birch", "oak", "snag"};
constexpr std::array<std::string_view, 6> herbs{"shrub", "bush",       "fern",
                                                "reed",  "grass_tuft", "grass_patch"};

// Moore and Maguire (2004), with the diameter in cm and the height in m.
double tree_hz(double height_m, double diameter_cm) {
  return 0.0766 + 3.1219 * diameter_cm / (height_m * height_m);
}

TEST(AssetSway, FrequenciesOfTreesAreThoseOfConifersOf55Diameters) {
  for (const std::string_view name : trees) {
    const AssetKind kind = asset_kind(name);
    EXPECT_NEAR(asset_flexibility({.kind = kind, .size_m = 22}).frequency_hz, tree_hz(22, 40),
                1e-12);
    const double usual_m = asset_defaults(kind).size_m;
    EXPECT_NEAR(asset_flexibility({.kind = kind}).frequency_hz,
                tree_hz(usual_m, 100 * usual_m / 55), 1e-12);
  }
}

TEST(AssetSway, OtherPlantsSwayInProportionToTheirHeight) {
  for (const std::string_view name : herbs)
    EXPECT_NEAR(asset_flexibility({.kind = asset_kind(name), .size_m = 0.85}).frequency_hz, 2,
                1e-12);
}

TEST(AssetSway, OnlyPlantsYieldAndHerbsMoreThanTrees) {
  for (const std::string_view name : asset_names()) {
    const double lean_rad = asset_flexibility({.kind = asset_kind(name)}).lean_rad;
    const bool is_tree = std::ranges::count(trees, name) > 0;
    const bool is_herb = std::ranges::count(herbs, name) > 0;
    EXPECT_EQ(lean_rad > 0, is_tree || is_herb) << name;
    const double lean_deg = lean_rad * 180 / std::numbers::pi;
    EXPECT_TRUE(!is_tree || lean_deg < 2.01) << name;
    EXPECT_TRUE(!is_herb || lean_deg > 4.99) << name;
  }
}

}  // namespace
}  // namespace groundray::asset_sway_test
