#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "apps/golden/suite/checks.h"
#include "core/error.h"

namespace groundray::golden::statistical_match_test {
namespace {

constexpr glm::ivec2 size_px(32, 24);

// An image with normally distributed values: mean 5 + the column, standard deviation 0.1.
Columns draw(std::uint64_t seed, double shift = 0) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0, 0.1);
  Columns image{
      .rows = std::size_t{32} * 24, .all = {{"R", {}, Stored::Float}}, .size_px = size_px};
  for (std::size_t i = 0; i < image.rows; ++i)
    image.all[0].values.push_back(5 + static_cast<double>(i % 32) + shift + normal(engine));
  return image;
}

Columns stored() {
  Moments moments({"R"});
  for (std::uint64_t k = 1; k <= statistical_runs; ++k) moments.add(draw(k));
  return moments.columns();
}

std::vector<Verdict> match(const Columns& image, const Columns& moments) {
  Section section;
  check_statistically({.columns = {"R"}}, "", image, moments, section);
  std::vector<Verdict> verdicts;
  for (const Measure& measure : section.measures) {
    if (measure.limit) verdicts.push_back(measure.verdict);
  }
  return verdicts;
}

TEST(StatisticalMatch, MomentsAreMeanAndUnbiasedVariance) {
  Moments moments({"R"});
  for (const double value : {1.0, 2.0, 6.0})
    moments.add({.rows = 1, .all = {{"R", {value}, Stored::Float}}, .size_px = {1, 1}});
  const Columns columns = moments.columns();
  EXPECT_DOUBLE_EQ(columns.find("Mean_R")->values[0], 3);
  EXPECT_DOUBLE_EQ(columns.find("Variance_R")->values[0], 7);
}

TEST(StatisticalMatch, AcceptsAnotherSample) {
  // Each of the three kinds of tests fails for a correct draw with a probability of 1 %: of 200
  // draws some fail, and 25 or more only with a probability of 1e-9.
  const Columns moments = stored();
  std::int64_t failed = 0;
  for (std::uint64_t seed = 1000; seed < 1200; ++seed)
    failed += std::ranges::count(match(draw(seed), moments), Verdict::Failed) > 0 ? 1 : 0;
  EXPECT_LT(failed, 25);
}

TEST(StatisticalMatch, DetectsDeviationsOfAPixelABlockAndTheMean) {
  const Columns moments = stored();
  Columns pixel = draw(1000);
  pixel.all[0].values[100] += 1;
  EXPECT_EQ(match(pixel, moments)[0], Verdict::Failed);
  Columns block = draw(1000);
  for (std::size_t y = 8; y < 16; ++y) {
    for (std::size_t x = 8; x < 16; ++x) block.all[0].values[y * 32 + x] += 0.1;
  }
  EXPECT_EQ(match(block, moments)[0], Verdict::Passed);  // the first test cannot detect it
  EXPECT_EQ(match(block, moments)[1], Verdict::Failed);
  const Columns shifted = draw(1000, 0.02);
  EXPECT_EQ(match(shifted, moments)[0], Verdict::Passed);
  EXPECT_EQ(match(shifted, moments)[2], Verdict::Failed);
}

TEST(StatisticalMatch, WithoutNoiseOnlyRoundingIsAllowed) {
  Moments moments({"R"});
  const auto image = [](float value) {
    return Columns{.rows = 1, .all = {{"R", {value}, Stored::Float}}, .size_px = {1, 1}};
  };
  for (int k = 0; k < statistical_runs; ++k) moments.add(image(1));
  EXPECT_THAT(match(image(1 + 1e-7F), moments.columns()), ::testing::Each(Verdict::Passed));
  EXPECT_THAT(match(image(1 + 1e-5F), moments.columns()), ::testing::Contains(Verdict::Failed));
}

TEST(StatisticalMatch, RejectsNonFiniteMoments) {
  for (const double bad : {std::nan(""), HUGE_VAL}) {
    Columns moments = stored();
    moments.all[1].values[7] = bad;
    EXPECT_THROW(match(draw(1000), moments), Error);
    Columns image = draw(1);
    image.all[0].values[7] = bad;
    Moments of_runs({"R"});
    of_runs.add(image);
    of_runs.add(draw(2));
    EXPECT_THROW(of_runs.columns(), Error);
    Columns odd = draw(1000);
    odd.all[0].values[7] = bad;
    EXPECT_THAT(match(odd, stored()), ::testing::Each(Verdict::Failed));
  }
}

TEST(StatisticalMatch, RejectsAnotherSizeAndMissingColumns) {
  const Columns moments = stored();
  Columns turned = draw(1);
  turned.size_px = {24, 32};
  EXPECT_THROW(match(turned, moments), Error);
  Columns other = draw(1);
  other.all[0].name = "G";
  EXPECT_THROW(match(other, moments), Error);
}

}  // namespace
}  // namespace groundray::golden::statistical_match_test
