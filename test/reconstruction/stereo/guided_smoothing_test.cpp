#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "reconstruction/stereo/semi_global.h"

namespace groundray::guided_smoothing_test {
namespace {

// Disparities of a pair in which the right image confirms those of the left one.
SemiGlobalDisparity confirmed(ImageF left_px) {
  SemiGlobalDisparity found{.left_px = left_px, .right_px = left_px};
  for (float& value : found.right_px.values()) value = no_disparity;
  for (int y = 0; y < left_px.height(); ++y) {
    for (int x = 0; x < left_px.width(); ++x) {
      const float value = left_px.at(x, y)[0];
      const int there = std::isnan(value) ? -1 : x - static_cast<int>(std::lround(value));
      if (there >= 0) found.right_px.at(there, y)[0] = value;
    }
  }
  for (int y = 0; y < left_px.height(); ++y) {  // no holes in the right image
    for (int x = left_px.width() - 2; x >= 0; --x) {
      float& value = found.right_px.at(x, y)[0];
      if (std::isnan(value)) value = found.right_px.at(x + 1, y)[0];
    }
    for (int x = 1; x < left_px.width(); ++x) {
      float& value = found.right_px.at(x, y)[0];
      if (std::isnan(value)) value = found.right_px.at(x - 1, y)[0];
    }
  }
  return found;
}

// Solves a dense system by Gaussian elimination.
std::vector<double> solved(std::vector<std::vector<double>> a, std::vector<double> b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t i = k + 1; i < n; ++i) {
      const double factor = a[i][k] / a[k][k];
      for (std::size_t j = k; j < n; ++j) a[i][j] -= factor * a[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
  return b;
}

// Variance of the disparities within 5 px, by its definition; infinity if one is missing.
double variance_round(const ImageF& disparity_px, int x, int y) {
  std::vector<double> values;
  for (int v = std::max(y - 5, 0); v <= std::min(y + 5, disparity_px.height() - 1); ++v) {
    for (int u = std::max(x - 5, 0); u <= std::min(x + 5, disparity_px.width() - 1); ++u)
      values.push_back(disparity_px.at(u, v)[0]);
  }
  double mean = 0, squares = 0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::isnan(mean) ? INFINITY : squares / static_cast<double>(values.size());
}

// Rows of doubles.
using Table = std::vector<std::vector<double>>;

// Solves each line's least squares as a dense system.
void solve_line(const std::vector<double>& grey, double smoothness, std::vector<double>& line) {
  const std::size_t n = line.size();
  Table a(n, std::vector<double>(n, 0));
  for (std::size_t i = 0; i < n; ++i) a[i][i] += 1;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const double link = smoothness * std::exp(-std::abs(grey[i] - grey[i + 1]) / 0.8);
    a[i][i] += link;
    a[i + 1][i + 1] += link;
    a[i][i + 1] -= link;
    a[i + 1][i] -= link;
  }
  line = solved(a, line);
}

Table transposed(const Table& table) {
  Table result(table[0].size(), std::vector<double>(table.size()));
  for (std::size_t y = 0; y < table.size(); ++y) {
    for (std::size_t x = 0; x < table[0].size(); ++x) result[x][y] = table[y][x];
  }
  return result;
}

// Three passes along rows and along columns, each with a quarter of the smoothness before.
Table smoothed(Table table, const Table& grey) {
  for (const double smoothness : {200.0, 50.0, 12.5}) {
    for (std::size_t y = 0; y < table.size(); ++y) solve_line(grey[y], smoothness, table[y]);
    table = transposed(table);
    const Table turned = transposed(grey);
    for (std::size_t x = 0; x < table.size(); ++x) solve_line(turned[x], smoothness, table[x]);
    table = transposed(table);
  }
  return table;
}

struct Sample {
  Image8 grey{40, 24, 1};
  SemiGlobalDisparity found{.left_px{40, 24, 1}, .right_px{40, 24, 1}};
};

// Random disparities to 1/16 px, with a hole in each image and a patch of which a half is not
// confirmed, on an image with noise, an edge, and dots of a contrast of 40 and of 150.
Sample sample() {
  Sample sample;
  std::mt19937 random(3);
  const auto drawn = [&](unsigned least, unsigned most) {
    return least + random() % (most - least);
  };
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 40; ++x) {
      sample.grey.at(x, y)[0] = static_cast<std::uint8_t>(drawn(60, 64) + (x + y > 36 ? 7 : 0));
      sample.found.left_px.at(x, y)[0] = static_cast<float>(drawn(56, 72)) / 16;
      const bool is_off = x >= 25 && x < 30 && y <= 8;
      sample.found.right_px.at(x, y)[0] =
          static_cast<float>(drawn(56, 72)) / 16 + (is_off ? 1.5F : 0);
    }
  }
  sample.found.left_px.at(12, 3)[0] = no_disparity;
  sample.found.right_px.at(3, 20)[0] = no_disparity;
  sample.grey.at(20, 12)[0] = 104;
  sample.found.left_px.at(20, 12)[0] = 9;
  sample.grey.at(25, 17)[0] = 213;
  sample.found.left_px.at(25, 17)[0] = 0;
  return sample;
}

TEST(GuidedSmoothing, MatchesDenseSolutionsOfItsLeastSquares) {
  const auto [grey, found] = sample();
  Table greys(24, std::vector<double>(40)), products = greys, weights = greys;
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 40; ++x) {
      const auto row = static_cast<std::size_t>(y), column = static_cast<std::size_t>(x);
      greys[row][column] = grey.at(x, y)[0];
      const double left_px = found.left_px.at(x, y)[0];
      if (std::isnan(left_px) || left_px > x + 0.5) continue;
      const int there = x - static_cast<int>(std::lround(left_px));
      if (there < 0 || !(std::abs(found.right_px.at(there, y)[0] - left_px) <= 1.5)) continue;
      const double variance =
          std::max(variance_round(found.left_px, x, y), variance_round(found.right_px, there, y));
      weights[row][column] = std::max(0.0, 1 - variance / 4);
      products[row][column] = weights[row][column] * left_px;
    }
  }
  products = smoothed(products, greys);
  weights = smoothed(weights, greys);
  const ImageF smooth = smooth_guided(grey, found);
  double least = 1;
  int missing = 0;
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 40; ++x) {
      const double weight = weights[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
      const double product = products[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
      if (weight < std::numeric_limits<float>::min()) {
        EXPECT_TRUE(std::isnan(smooth.at(x, y)[0])) << x << ", " << y;
        ++missing;
        continue;
      }
      least = std::min(least, weight);
      // Six sweeps forwards and backwards over up to 40 pixels, all terms positive: 480 roundings,
      // which add up at random, of products and weights.
      EXPECT_NEAR(smooth.at(x, y)[0], product / weight, 1e-5) << x << ", " << y;
    }
  }
  EXPECT_LT(least, 1e-10);  // the dot of less contrast
  EXPECT_EQ(missing, 1);    // the other one, whose neighbours' weights are below all floats
}

// A pixel that the right image does not confirm takes the disparity of its surroundings, however
// much it contrasts with them.
TEST(GuidedSmoothing, LeavesNoDisparityThatItsSurroundingsContradict) {
  for (const int contrast : {0, 5, 10, 20, 40, 60}) {
    Image8 grey(32, 32, 1);
    for (std::uint8_t& value : grey.values()) value = 100;
    ImageF right_px(32, 32, 1);
    for (float& value : right_px.values()) value = 5;
    ImageF left_px = right_px;
    left_px.at(16, 16)[0] = 7;
    grey.at(16, 16)[0] = static_cast<std::uint8_t>(100 + contrast);
    const ImageF smooth = smooth_guided(grey, {.left_px = left_px, .right_px = right_px});
    EXPECT_NEAR(smooth.at(16, 16)[0], 5, 1e-5) << contrast;
  }
}

TEST(GuidedSmoothing, DoesNotDependOnTheNumberOfThreads) {
  const auto [grey, found] = sample();
  std::vector<std::uint32_t> first;
  for (const std::size_t threads : {1, 2, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const ImageF smooth = smooth_guided(grey, found);
    std::vector<std::uint32_t> bits;
    for (const float value : smooth.values()) bits.push_back(std::bit_cast<std::uint32_t>(value));
    if (first.empty()) first = bits;
    EXPECT_EQ(bits, first) << threads;
  }
}

// Two surfaces meet at an edge of the image; a hole beside it belongs to the left one.
TEST(GuidedSmoothing, FillsHolesUpToEdgesOfTheImage) {
  constexpr int width = 96, height = 40, edge = 60;
  Image8 grey(width, height, 1);
  ImageF left_px(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool is_hole = x >= edge - 8 && x < edge && y > 10 && y < 30;
      grey.at(x, y)[0] = x < edge ? 60 : 180;
      left_px.at(x, y)[0] = is_hole ? no_disparity : x < edge ? 5.F : 12.F;
    }
  }
  const ImageF smooth = smooth_guided(grey, confirmed(left_px));
  for (int y = 0; y < height; ++y) {
    for (int x = 20; x < width; ++x)
      ASSERT_NEAR(smooth.at(x, y)[0], x < edge ? 5 : 12, 0.01) << x << ", " << y;
  }
}

TEST(GuidedSmoothing, HasNoDisparitiesWithoutAnyThatAreConfirmed) {
  const Image8 grey(20, 10, 1);
  ImageF none(20, 10, 1);
  for (float& value : none.values()) value = no_disparity;
  const ImageF smooth = smooth_guided(grey, {.left_px = none, .right_px = none});
  for (const float value : smooth.values()) EXPECT_TRUE(std::isnan(value));
}

TEST(GuidedSmoothing, AcceptsSinglePixelsRowsAndColumns) {
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(9, 1), std::pair(1, 9)}) {
    ImageF zero_px(width, height, 1);
    const ImageF smooth =
        smooth_guided(Image8(width, height, 1), {.left_px = zero_px, .right_px = zero_px});
    for (const float value : smooth.values()) EXPECT_EQ(value, 0);
  }
}

}  // namespace
}  // namespace groundray::guided_smoothing_test
