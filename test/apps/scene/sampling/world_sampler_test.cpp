// Worlds of a scene file: statistics of the values drawn, and the scenes that they make.
#include "apps/scene/sampling/world_sampler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/yaml_writer.h"
#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::world_sampler_test {
namespace {

using groundray::sampling::find;
using groundray::sampling::WorldSampler;
using groundray::testing::data_folder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* scene_head = R"(groundray: 1
seed: 3
duration_s: 1
terrain: {dem: a.tif}
platform: {drive: {waypoints_m: [[0, 0], [9, 0]], speed_m_s: 1, height_m: 1}}
objects:
  - {name: deer, label: 20, asset: deer, at_m: [5, 5]}
  - {name: rock, label: 7, asset: rock, at_m: [6, 5]}
lidars:
  - {name: top, preset: velodyne_vlp16, mount: {translation_m: [0, 0, 1]}}
)";

std::string scene_with(const std::string& vary, std::uint32_t count = 10000) {
  return scene_head + ("worlds:\n  count: " + std::to_string(count) + "\n  vary:\n") + vary;
}

WorldSampler sampler_of(const std::string& text) {
  yaml::Faults faults("scene.yaml");
  auto sampler = WorldSampler::read(yaml::parse(text, "scene.yaml"), faults);
  faults.throw_if_any();
  return sampler.value();
}

std::string complaint(const std::string& vary) {
  try {
    sampler_of(scene_with("    " + vary + "\n"));
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

SceneSpec world_of(const std::string& text, std::uint32_t world) {
  return parse_scene(text, "scenes/scene.yaml", data_folder() / "sensors", world);
}

// Texts of the value of each world at the only key that varies.
std::vector<std::string> texts_of(const std::string& distribution, std::uint32_t count = 10000) {
  const WorldSampler worlds = sampler_of(scene_with("    platform.x: " + distribution + "\n"));
  std::vector<std::string> texts;
  for (std::uint32_t world = 0; world < count; ++world)
    texts.push_back(yaml::line_of(worlds.values_of(world).front()));
  return texts;
}

// Significance of each of the tests below: 1 % over all 20 of them, by Sidak.
const double significance = 1 - std::pow(0.99, 1.0 / 20);

// Expects that counts agree with probabilities by a chi-squared test.
void expect_counts(const std::vector<double>& counts, const std::vector<double>& probabilities) {
  double total = 0, chi_squared = 0;
  for (const double count : counts) total += count;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double expected = total * probabilities[i];
    chi_squared += (counts[i] - expected) * (counts[i] - expected) / expected;
  }
  const boost::math::chi_squared law(static_cast<double>(counts.size()) - 1);
  EXPECT_LT(chi_squared, quantile(complement(law, significance)));
}

// Expects that a function of the values, their cumulative distribution, is uniform.
template <typename Cdf>
void expect_distribution(const std::string& distribution, const Cdf& cdf) {
  constexpr std::size_t bins = 50;
  std::vector<double> counts(bins, 0);
  for (const std::string& text : texts_of(distribution)) {
    const double share = cdf(std::stod(text));
    ASSERT_GE(share, 0) << text;
    ASSERT_LE(share, 1) << text;
    ++counts[std::min(static_cast<std::size_t>(share * bins), bins - 1)];
  }
  expect_counts(counts, std::vector<double>(bins, 1.0 / bins));
}

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

TEST(WorldSampler, NumbersHaveTheirDistributions) {
  expect_distribution("{uniform: [-3, 5]}", [](double x) { return (x + 3) / 8; });
  expect_distribution("{log_uniform: [0.01, 1000]}",
                      [](double x) { return (std::log10(x) + 2) / 5; });
  expect_distribution("{normal: [4, 0.5]}", [](double x) { return normal_cdf((x - 4) / 0.5); });
  expect_distribution("{normal: [4, 2], within: [3, 9]}", [](double x) {
    const double low = normal_cdf(-0.5), high = normal_cdf(2.5);
    return (normal_cdf((x - 4) / 2) - low) / (high - low);
  });
}

TEST(WorldSampler, WholeNumbersChoicesAndPresencesHaveTheirProbabilities) {
  std::map<std::string, double> counts;
  for (const std::string& text : texts_of("{whole: [-2, 4]}")) ++counts[text];
  EXPECT_EQ(counts.size(), 7u);
  expect_counts(
      {counts["-2"], counts["-1"], counts["0"], counts["1"], counts["2"], counts["3"], counts["4"]},
      std::vector<double>(7, 1.0 / 7));
  counts.clear();
  for (const std::string& text :
       texts_of("{choice: [sand, mud, 3, [1, 2]], weights: [5, 0, 3, 2]}"))
    ++counts[text];
  EXPECT_EQ(counts.size(), 3u);  // no mud
  expect_counts({counts["sand"], counts["3"], counts["[1, 2]"]}, {0.5, 0.3, 0.2});
  const WorldSampler worlds = sampler_of(scene_with("    objects.deer: {present: 0.3}\n"));
  double present = 0;
  for (std::uint32_t world = 0; world < 10000; ++world)
    present += worlds.values_of(world).front().text == "true" ? 1 : 0;
  expect_counts({present, 10000 - present}, {0.3, 0.7});
}

TEST(WorldSampler, ColumnsOfATableAreDrawnTogether) {
  const WorldSampler worlds = sampler_of(scene_with(R"(    season:
      table:
        columns: [terrain.material, platform.rain_mm_h]
        rows: [[dry_grass, 0], [dry_soil, 0], [wet_soil, 8]]
        weights: [2, 1, 1]
)"));
  EXPECT_THAT(worlds.keys(), ElementsAre("terrain.material", "platform.rain_mm_h"));
  std::map<std::string, double> counts;
  for (std::uint32_t world = 0; world < 10000; ++world) {
    const auto values = worlds.values_of(world);
    ++counts[values[0].text + " " + values[1].text];
  }
  EXPECT_EQ(counts.size(), 3u);
  expect_counts({counts["dry_grass 0"], counts["dry_soil 0"], counts["wet_soil 8"]},
                {0.5, 0.25, 0.25});
}

// Independence of two keys in one world, and of one key in successive worlds: 5 x 5 cells.
TEST(WorldSampler, KeysAndWorldsAreIndependent) {
  const WorldSampler worlds =
      sampler_of(scene_with("    a: {uniform: [0, 5]}\n    b: {uniform: [0, 5]}\n"));
  std::vector<double> between_keys(25, 0), between_worlds(25, 0);
  std::size_t before = 0;
  for (std::uint32_t world = 0; world < 10000; ++world) {
    const auto values = worlds.values_of(world);
    const auto a = static_cast<std::size_t>(std::stod(values[0].text));
    const auto b = static_cast<std::size_t>(std::stod(values[1].text));
    ++between_keys[5 * a + b];
    if (world > 0) ++between_worlds[5 * before + a];
    before = a;
  }
  expect_counts(between_keys, std::vector<double>(25, 1.0 / 25));
  expect_counts(between_worlds, std::vector<double>(25, 1.0 / 25));
}

TEST(WorldSampler, SeedsOfWorldsDifferFromEachOtherAndFollowTheScenes) {
  const WorldSampler worlds = sampler_of(scene_with("    a: {whole: [0, 9]}\n"));
  std::set<std::uint64_t> seeds;
  for (std::uint32_t world = 0; world < 10000; ++world) seeds.insert(worlds.seed_of(world).value);
  EXPECT_EQ(seeds.size(), 10000u);
  std::string other = scene_with("    a: {whole: [0, 9]}\n");
  other.replace(other.find("seed: 3"), 7, "seed: 4");
  EXPECT_EQ(seeds.count(sampler_of(other).seed_of(0).value), 0u);
}

// A world must not change because another key varies too, or because the file has more worlds.
TEST(WorldSampler, AValueDependsOnItsKeyAndWorldAlone) {
  const WorldSampler alone = sampler_of(scene_with("    b: {normal: [0, 1]}\n", 20));
  const WorldSampler among = sampler_of(scene_with(
      "    a: {whole: [0, 9]}\n    b: {normal: [0, 1]}\n    c: {choice: [x, y]}\n", 500));
  for (std::uint32_t world = 0; world < 20; ++world) {
    EXPECT_EQ(alone.values_of(world)[0].text, among.values_of(world)[1].text);
    EXPECT_EQ(alone.seed_of(world).value, among.seed_of(world).value);
  }
}

TEST(WorldSampler, ASceneHasItsValuesAndStatesThem) {
  const std::string text = scene_with(R"(    weather.visibility_m: {log_uniform: [300, 20000]}
    lidars.top.mount.translation_m.2: {uniform: [1.5, 1.6]}
    lidars.0.rate_hz: {choice: [5, 20]}
    objects.deer.yaw_deg: {uniform: [0, 360]}
)");
  EXPECT_THAT(complaint("weather.visibility_m: {log_uniform: [300, 20000]}"),
              HasSubstr("the scene has no 'weather'"));
  const std::string with_weather = "weather: {group_index: 1.00028}\n" + text;
  const WorldSampler worlds = sampler_of(with_weather);
  for (std::uint32_t world = 0; world < 50; ++world) {
    const SceneSpec scene = world_of(with_weather, world);
    const auto values = worlds.values_of(world);
    EXPECT_EQ(scene.air.visibility_m, std::stod(values[0].text));
    EXPECT_EQ(scene.lidars[0].X_BS.translation_m.z, std::stod(values[1].text));
    EXPECT_EQ(scene.seed.value, worlds.seed_of(world).value);
    ASSERT_TRUE(scene.world);
    EXPECT_EQ(scene.world->number, world);
    EXPECT_THAT(scene.world->drawn, HasSubstr("weather.visibility_m: " + values[0].text));
    EXPECT_THAT(scene.world->drawn, Not(HasSubstr("\n")));
  }
}

TEST(WorldSampler, WhatIsAbsentLeavesTheSceneAndNumbersOfItemsAreThoseBefore) {
  const std::string text = scene_with(R"(    objects.0: {present: 0.5}
    objects.1: {present: 0.5}
    objects.1.yaw_deg: {uniform: [10, 20]}
)");
  const WorldSampler worlds = sampler_of(text);
  std::set<std::string> seen;
  for (std::uint32_t world = 0; world < 40; ++world) {
    const auto values = worlds.values_of(world);
    const yaml::Node scene = worlds.scene_of(world);
    std::string names, expected;
    for (const yaml::Node& object : find(scene, {"objects"})->items) {
      const std::string name = find(object, {"name"})->text;
      names += name;
      EXPECT_EQ(find(object, {"yaw_deg"}) != nullptr, name == "rock");
    }
    if (values[0].text == "true") expected += "deer";
    if (values[1].text == "true") expected += "rock";
    EXPECT_EQ(names, expected);
    seen.insert(names);
  }
  EXPECT_EQ(seen.size(), 4u);
}

TEST(WorldSampler, AWorldsTextMakesTheSameScene) {
  const std::string text =
      scene_with("    duration_s: {uniform: [1, 2]}\n    objects.deer: {present: 0.5}\n");
  for (std::uint32_t world = 0; world < 20; ++world) {
    const SceneSpec chosen = world_of(text, world);
    const SceneSpec read = parse_scene(chosen.text, "scenes/world.yaml", data_folder() / "sensors");
    EXPECT_EQ(read.text, chosen.text);
    EXPECT_EQ(read.seed.value, chosen.seed.value);
    EXPECT_EQ(read.duration_s, chosen.duration_s);
    EXPECT_EQ(read.objects.size(), chosen.objects.size());
    EXPECT_EQ(read.world->number, world);
    EXPECT_EQ(read.world->drawn, chosen.world->drawn);
    EXPECT_EQ(read.worlds, 0u);
  }
}

TEST(WorldSampler, WithoutAChosenWorldTheSceneIsAsWritten) {
  const std::string text = scene_with("    duration_s: {uniform: [1, 2]}\n", 12);
  const SceneSpec scene = parse_scene(text, "scenes/scene.yaml", data_folder() / "sensors");
  EXPECT_EQ(scene.duration_s, 1);
  EXPECT_EQ(scene.seed.value, 3u);
  EXPECT_EQ(scene.worlds, 12u);
  EXPECT_EQ(scene.text, text);
  EXPECT_FALSE(scene.world);
}

TEST(WorldSampler, FaultsNameTheKeyAndTheRule) {
  EXPECT_THAT(complaint("a: {uniform: [5, 2]}"),
              HasSubstr("scene.yaml:14:18: key 'uniform': is [5, 2], from which nothing can be "
                        "drawn: the first must be less"));
  EXPECT_THAT(complaint("a: {log_uniform: [0, 2]}"), HasSubstr("begins at 0, but logarithms"));
  EXPECT_THAT(complaint("a: {normal: [5, 0]}"), HasSubstr("but the latter must be > 0"));
  EXPECT_THAT(complaint("a: {normal: [5, 1], within: [6, 9]}"), HasSubstr("must contain the mean"));
  EXPECT_THAT(complaint("a: {whole: [1.5, 3]}"), HasSubstr("must be two whole numbers"));
  EXPECT_THAT(complaint("a: {choice: []}"), HasSubstr("must be a list of values"));
  EXPECT_THAT(complaint("a: {choice: [1, 2], weights: [1]}"), HasSubstr("a list of 2 numbers"));
  EXPECT_THAT(complaint("a: {choice: [1, 2], weights: [0, 0]}"), HasSubstr("nothing can be drawn"));
  EXPECT_THAT(complaint("a: {choice: [1, 2], weights: [1, -1]}"), HasSubstr("must be >= 0"));
  EXPECT_THAT(complaint("objects.deer: {present: 1.5}"), HasSubstr("must be from 0 to 1"));
  EXPECT_THAT(complaint("objects.fox: {present: 0.5}"), HasSubstr("is not in the scene"));
  EXPECT_THAT(complaint("a: {unifrom: [1, 2]}"), HasSubstr("did you mean 'uniform'"));
  EXPECT_THAT(complaint("a: {uniform: [1, 2], whole: [1, 2]}"),
              HasSubstr("has uniform and whole, but must have one of them"));
  EXPECT_THAT(complaint("a: 5"), HasSubstr("must be a map"));
  EXPECT_THAT(complaint("a: {table: {columns: [b, c], rows: [[1]]}}"),
              HasSubstr("a list of 2 values, one for each column"));
  EXPECT_THAT(complaint("a: {table: {columns: [b], rows: []}}"), HasSubstr("is empty"));
  EXPECT_THAT(complaint("seed: {whole: [1, 2]}"), HasSubstr("the seed of a world follows from"));
  EXPECT_THAT(complaint("sky.sun.elevation_deg: {uniform: [1, 2]}"),
              HasSubstr("the scene has no 'sky'"));
  EXPECT_THAT(complaint("lidars.7.rate_hz: {uniform: [1, 2]}"), HasSubstr("the scene has no '7'"));
  EXPECT_THAT(complaint("terrain: {choice: [{dem: b.tif}]}\n    terrain.dem: {choice: [c.tif]}"),
              HasSubstr("key 'terrain.dem': varies what 'terrain' varies too"));
}

TEST(WorldSampler, FaultsOfAWorldNameItsNumberAndThePlaceOfTheDistribution) {
  const std::string text = scene_with("    duration_s: {uniform: [-2, -1]}\n", 5);
  const auto fault_of = [&](std::uint32_t world) -> std::string {
    try {
      world_of(text, world);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(fault_of(3), HasSubstr("scenes/scene.yaml:14:17: key 'duration_s': is -1."));
  EXPECT_THAT(fault_of(3), HasSubstr("in world 3, which `groundray sample --index 3` prints"));
  EXPECT_THAT(fault_of(5), HasSubstr("scene.yaml:12:10: key 'count': is 5, so that the worlds are "
                                     "0 to 4; there is no world 5"));
  EXPECT_THROW(world_of(scene_head, 0), Error);
}

}  // namespace
}  // namespace groundray::world_sampler_test
