#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "apps/golden/compare/images/image_comparison.h"
#include "test/support/scans/sample_image.h"

namespace groundray::golden::light_match_test {
namespace {

using groundray::testing::figure;
using groundray::testing::image;
using groundray::testing::layer;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Reason for the limit of a figure.
std::string because(const Section& section, const std::string& name) {
  const auto found = std::ranges::find(section.measures, name, &Measure::name);
  return found == section.measures.end() ? "there is no such figure" : found->because;
}

Section compare(const ImageFile& reference, const ImageFile& other) {
  return compare_images(reference, other, {}, "images");
}

/// Radiance of mean 1 + `bias`, estimated from 64 paths with known standard errors.
ImageFile estimate(unsigned seed, double bias) {
  std::mt19937 random(seed);
  const auto sigma = [](int x, int y, int) { return 0.02 + 0.001 * ((x + y) % 10); };
  return image(
      {layer("RGB", LayerKind::Colour, {32, 24}, 3,
             [&](int x, int y, int k) {
               std::normal_distribution<double> normal(1 + bias, sigma(x, y, k));
               return normal(random);
             }),
       layer("StdError", LayerKind::Number, {32, 24}, 3, sigma),
       layer("Samples", LayerKind::Number, {32, 24}, 1, [](int, int, int) { return 64.0; })});
}

// Each of the three kinds of tests, with all its tests together, fails by chance in 1 % of runs: at
// most 3 % in sum. Of 200 runs, 6 fail, and 15 or more with a probability of 0.1 %.
TEST(CompareImages, PassesEstimatesOfEqualRadiance) {
  int failures = 0;
  for (unsigned i = 0; i < 200; ++i) {
    const Section section = compare(estimate(2 * i + 1, 0), estimate(2 * i + 2, 0));
    if (section.verdict == Verdict::Failed) ++failures;
  }
  EXPECT_LE(failures, 14);
}

// A bias of 0.8 % is a quarter of the standard error of a difference of two values, but 6 standard
// errors of a channel's mean.
TEST(CompareImages, FailsASmallBiasOfTheEntireImage) {
  const Section section = compare(estimate(1, 0), estimate(2, 0.008));
  EXPECT_EQ(section.verdict, Verdict::Failed);
  EXPECT_EQ(figure(section, "RGB: values that differ significantly"), 0);
  EXPECT_GT(figure(section, "RGB: mean of G over the image"), 3);
}

TEST(CompareImages, FailsASingleWrongPixelAndDescribesTheTest) {
  ImageFile other = estimate(2, 0);
  other.layers[0].values.at(5, 6)[1] = 2;  // 30 standard errors: Student's t has long tails
  const Section section = compare(estimate(1, 0), other);
  EXPECT_EQ(section.verdict, Verdict::Failed);
  EXPECT_EQ(figure(section, "RGB: values that differ significantly"), 1);
  EXPECT_THAT(because(section, "RGB: values that differ significantly"),
              AllOf(HasSubstr("significance 0.01"), HasSubstr("standard errors of both")));
  other.layers.resize(1);
  const Section exact = compare(estimate(1, 0), other);
  EXPECT_THAT(because(exact, "RGB: mean of B over the image"),
              HasSubstr("the other image counts as exact"));
}

TEST(CompareImages, FailsValuesThatAreFiniteInTheReferenceOnly) {
  const std::string lost = "RGB: values or standard errors that are finite in the reference alone";
  const std::string untested = "RGB: values that were not tested, being not finite";
  const auto with = [](std::size_t layer, double value) {
    ImageFile other = estimate(2, 0);
    other.layers[layer].values.at(5, 6)[1] = value;
    return other;
  };
  const ImageFile good = estimate(1, 0);
  ASSERT_EQ(compare(good, estimate(2, 0)).verdict, Verdict::Passed);
  for (const std::size_t layer : {0u, 1u}) {  // radiance, its standard errors
    for (const double value : {std::nan(""), infinity, -infinity}) {
      const Section section = compare(good, with(layer, value));
      EXPECT_EQ(section.verdict, Verdict::Failed);
      EXPECT_EQ(figure(section, lost), 1);
      EXPECT_EQ(figure(section, untested), 1);
      const Section of_reference = compare(with(layer, value), good);  // faulty itself
      EXPECT_EQ(of_reference.verdict, Verdict::Passed);
      EXPECT_EQ(figure(of_reference, lost), 0);
      EXPECT_EQ(figure(of_reference, untested), 1);
    }
  }
}

TEST(CompareImages, FailsIfNoValueCanBeTested) {
  for (const std::size_t layer : {0u, 1u}) {
    const auto nothing = [layer](unsigned seed) {
      ImageFile file = estimate(seed, 0);
      std::ranges::fill(file.layers[layer].values.values(), std::nan(""));
      return file;
    };
    for (const auto& reference : {estimate(1, 0), nothing(3)}) {
      const Section section = compare(reference, nothing(2));
      EXPECT_EQ(section.verdict, Verdict::Failed);
      EXPECT_EQ(figure(section, "RGB: values that could be tested"), 0);
      EXPECT_EQ(figure(section, "RGB: values that were not tested, being not finite"), 32 * 24 * 3);
    }
  }
}

// The standard error of a single path is infinite.
TEST(CompareImages, RequiresEqualityOfSinglePathEstimates) {
  ImageFile single = estimate(1, 0);
  std::ranges::fill(single.layers[1].values.values(), infinity);
  EXPECT_EQ(compare(single, single).verdict, Verdict::Passed);
  ImageFile other = single;
  other.layers[0].values.at(5, 6)[1] += 1e-4;
  const Section section = compare(single, other);
  EXPECT_EQ(section.verdict, Verdict::Failed);
  EXPECT_EQ(figure(section, "RGB: values that could be tested"), 0);
}

// Two of 2304 values: an allowed fraction of a thousandth permits both.
TEST(CompareImages, RequiresEqualityOfValuesWithoutVariance) {
  ImageFile reference = estimate(1, 0), other = estimate(2, 0);
  for (ImageFile* file : {&reference, &other}) {
    for (int x = 3; x < 6; ++x) {
      file->layers[0].values.at(x, 4)[2] = 1;
      file->layers[1].values.at(x, 4)[2] = 0;
    }
  }
  const std::string name = "RGB: values that differ without any spread";
  EXPECT_EQ(figure(compare(reference, other), name), 0);
  other.layers[0].values.at(3, 4)[2] = 1 + 1e-7;  // the next float
  other.layers[0].values.at(4, 4)[2] = 1 + 1e-4;
  other.layers[0].values.at(5, 4)[2] = 1 - 1e-4;
  const Section section = compare(reference, other);
  EXPECT_EQ(figure(section, name), 2);
  EXPECT_EQ(section.verdict, Verdict::Failed);
  EXPECT_EQ(compare_images(reference, other, {.beyond_share = 1e-3}, "images").verdict,
            Verdict::Passed);
}

}  // namespace
}  // namespace groundray::golden::light_match_test
