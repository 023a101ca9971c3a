// Tests of the fit of single cells, through the whole fusion.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/ext/scalar_constants.hpp>
#include <glm/geometric.hpp>
#include <vector>

#include "core/random.h"
#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/fusion/dem_fusion.h"
#include "test/reconstruction/dem/rolling_ground.h"
#include "test/support/margin.h"

namespace groundray::cell_fit_test {
namespace {

using testing::add_point;
using testing::record_margin;
using enum PointOrigin;

Fusion fuse_all(const MeasuredPoints& points, const GridFrame& frame) {
  return fuse(
      [&, given = false](MeasuredPoints& block) mutable {
        block = points;
        return !std::exchange(given, true);
      },
      frame);
}

glm::dvec2 uniform(std::size_t i, std::uint32_t what) {
  return random_uniform({.seed = Seed{3}, .frame = what, .pulse = static_cast<std::uint32_t>(i)});
}
glm::dvec2 normal(std::size_t i, std::uint32_t what) {
  return random_normal({.seed = Seed{4}, .frame = what, .pulse = static_cast<std::uint32_t>(i)});
}

// Reference: the method in its plain form, with dense matrices of doubles and every iteration run
// to convergence.
struct DenseFit {
  double height_m = 0, variance_m2 = 0, chi2 = 0;
};

using Matrix3 = std::array<std::array<double, 3>, 3>;

Matrix3 inverse(const Matrix3& m) {
  Matrix3 result;
  double det = 0;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t a = (r + 1) % 3, b = (r + 2) % 3, d = (c + 1) % 3, e = (c + 2) % 3;
      result[c][r] = m[a][d] * m[b][e] - m[a][e] * m[b][d];
    }
    det += m[0][r] * result[r][0];
  }
  for (auto& row : result)
    for (double& value : row) value /= det;
  return result;
}

class DenseReference {
 public:
  DenseReference(const MeasuredPoints& points, glm::dvec2 sample) : points_(points) {
    for (const glm::dvec3& p : points.p_m) rows_.push_back({1, p.x - sample.x, p.y - sample.y});
  }

  DenseFit fit() {
    std::vector<double> heights;
    for (const glm::dvec3& p : points_.p_m) heights.push_back(p.z);
    std::sort(heights.begin(), heights.end());
    const std::size_t n = heights.size();
    plane_ = {0.5 * (heights[(n - 1) / 2] + heights[n / 2]), 0, 0};
    set_covariance(0);
    double times = scale();
    for (int i = 0; i < 200; ++i) solve(times, [](double u) { return u > 1.345 ? 1.345 / u : 1; });
    set_covariance(plane_[1] * plane_[1] + plane_[2] * plane_[2]);
    times = scale();
    for (int i = 0; i < 200; ++i) {
      solve(times, [](double u) {
        const double inside = std::max(0.0, 1 - u * u / (4.685 * 4.685));
        return inside * inside;
      });
    }
    return tell();
  }

 private:
  std::size_t n() const { return rows_.size(); }

  void set_covariance(double rise2) {
    covariance_.assign(n(), std::vector<double>(n(), 0));
    noise_.assign(n(), 0);
    for (std::size_t i = 0; i < n(); ++i) {
      for (std::size_t j = 0; j < n(); ++j)
        if (points_.groups[i] == points_.groups[j])
          covariance_[i][j] = double{points_.bias_sd_m[i]} * points_.bias_sd_m[j];
      const double sd = points_.sd_m[i], across = points_.across_sd_m[i];
      noise_[i] = sd * sd + rise2 * across * across;
      covariance_[i][i] += noise_[i];
    }
  }
  double residual(std::size_t i) const {
    return points_.p_m[i].z - plane_[0] * rows_[i][0] - plane_[1] * rows_[i][1] -
           plane_[2] * rows_[i][2];
  }
  double scale() const {
    std::vector<double> sizes;
    for (std::size_t i = 0; i < n(); ++i)
      sizes.push_back(std::abs(residual(i)) / std::sqrt(covariance_[i][i]));
    std::sort(sizes.begin(), sizes.end());
    return std::max(1.0, 1.4826 * sizes[n() / 2]);
  }
  template <typename Robust>
  void solve(double times, const Robust& robust) {
    weights_.assign(n(), 0);
    normal_ = {{{0, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  // slopes have a standard deviation of 1
    std::array<double, 3> right{};
    for (std::size_t i = 0; i < n(); ++i) {
      double shared = 0;
      for (std::size_t j = 0; j < n(); ++j)
        if (points_.groups[i] == points_.groups[j])
          shared += std::pow(points_.bias_sd_m[j], 2) / noise_[j];
      const double u = std::abs(residual(i)) / std::sqrt(covariance_[i][i]) / times;
      weights_[i] = robust(u) / (noise_[i] * (1 + shared)) / (times * times);
      for (std::size_t r = 0; r < 3; ++r) {
        right[r] += weights_[i] * rows_[i][r] * points_.p_m[i].z;
        for (std::size_t c = 0; c < 3; ++c)
          normal_[r][c] += weights_[i] * rows_[i][r] * rows_[i][c];
      }
    }
    const Matrix3 m = inverse(normal_);
    for (std::size_t r = 0; r < 3; ++r)
      plane_[r] = m[r][0] * right[0] + m[r][1] * right[1] + m[r][2] * right[2];
  }
  // Variance of a linear estimate, from the full covariance matrix of the points.
  DenseFit tell() const {
    const Matrix3 m = inverse(normal_);
    std::vector<double> lever(n());
    for (std::size_t i = 0; i < n(); ++i)
      for (std::size_t r = 0; r < 3; ++r) lever[i] += weights_[i] * m[0][r] * rows_[i][r];
    double noise = 0, shared = 0, chi2 = 0, inside = 0;
    for (std::size_t i = 0; i < n(); ++i) {
      noise += lever[i] * lever[i] * noise_[i];
      for (std::size_t j = 0; j < n(); ++j)
        shared += lever[i] * lever[j] * (covariance_[i][j] - (i == j ? noise_[i] : 0));
    }
    for (std::size_t i = 0; i < n(); ++i) {
      if (weights_[i] == 0) continue;
      double with_own = 0;  // covariance of the point's shared part with the estimate
      for (std::size_t j = 0; j < n(); ++j)
        with_own += lever[j] * (covariance_[i][j] - (i == j ? noise_[i] : 0));
      const double own = covariance_[i][i] - noise_[i];
      chi2 += std::pow(residual(i), 2) / (noise_[i] + std::max(0.0, own - 2 * with_own + shared));
      inside += 1;
    }
    chi2 /= inside - 3 + m[1][1] + m[2][2];
    return {plane_[0], noise * std::max(1.0, chi2) + shared + m[0][1] * m[0][1] + m[0][2] * m[0][2],
            chi2};
  }

  const MeasuredPoints& points_;
  std::vector<std::array<double, 3>> rows_;
  std::vector<std::vector<double>> covariance_;
  std::vector<double> noise_, weights_;
  Matrix3 normal_{};
  std::array<double, 3> plane_{};
};

// With few iterations the result is within some hundredths of a standard deviation of that with
// many.
TEST(CellFit, MatchesADenseRobustFit) {
  const GridFrame frame{{2, 2}, {0, 0}, {1, 1}, {1, 1}};
  double worst_height = 0, worst_variance = 0;
  for (std::size_t trial = 0; trial < 60; ++trial) {
    MeasuredPoints points;
    const std::size_t n = 8 + trial;
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t i = 100 * trial + k;
      const glm::dvec2 p = uniform(i, 1) - 0.5;
      const auto group = static_cast<std::uint32_t>(k % 4);
      const double sd_m = 0.01 + 0.03 * uniform(i, 2).x, bias_m = 0.004 * group;
      const double shift_m = bias_m * normal(4 * trial + group, 3).x;
      const double outlier_m = k % 25 == 7 ? 0.25 : 0;
      add_point(points,
                {p, 2 + 0.2 * p.x - 0.1 * p.y + shift_m + sd_m * normal(i, 4).x + outlier_m}, sd_m,
                bias_m, 0.05, group, group % 2 == 0 ? Lidar : Stereo);
    }
    const Fusion fusion = fuse_all(points, frame);
    const DenseFit dense = DenseReference(points, {0, 0}).fit();
    const double sd_m = std::sqrt(dense.variance_m2);
    worst_height = std::max(worst_height,
                            std::abs(double{fusion.layers.elevation_m[0]} - dense.height_m) / sd_m);
    worst_variance = std::max(
        worst_variance, std::abs(double{fusion.layers.variance_m2[0]} / dense.variance_m2 - 1));
    EXPECT_NEAR(fusion.layers.chi2[0], dense.chi2, 0.05 * dense.chi2 + 0.02);
  }
  EXPECT_LE(worst_height, 0.05);
  EXPECT_LE(worst_variance, 0.05);
  record_margin("fused cell against a dense fit, in sd", worst_height, 0.05);
}

// One group of n points: sd² / n + bias². Two groups of half as many: half of the bias term.
TEST(CellFit, MorePointsOfOneGroupDoNotReduceItsBias) {
  const GridFrame frame{{2, 2}, {0, 0}, {1, 1}, {1, 1}};
  constexpr double sd_m = 0.02, bias_m = 0.03;
  for (const std::uint32_t groups : {1U, 2U, 5U}) {
    MeasuredPoints points;
    for (std::size_t i = 0; i < 1000; ++i) {
      const double turn = 2 * glm::pi<double>() * static_cast<double>(i - i % groups) / 1000;
      add_point(points, {0.4 * std::cos(turn), 0.4 * std::sin(turn), 5 + (i % 2 == 0 ? 0 : 1e-5)},
                sd_m, bias_m, 0, static_cast<std::uint32_t>(i) % groups, Stereo);
    }
    const DemLayers layers = fuse_all(points, frame).layers;
    const double expected = sd_m * sd_m / 1000 + bias_m * bias_m / groups;
    EXPECT_NEAR(layers.variance_m2[0], expected, 1e-3 * expected);
    EXPECT_EQ(layers.stereo[0], 1000U);
    EXPECT_EQ(layers.source[0], HeightSource::Stereo);
  }
}

// The stated errors hold for points with known noise, a bias for each group, position errors, and
// outliers, on a slope. With exact normal errors, 10^4 cells give a root mean square of 1 within 1
// %; chi² is one-sided, so a smaller value is expected, and outliers increase it.
TEST(CellFit, StatedErrorsAreCorrectUnderNoiseBiasAndOutliers) {
  const GridFrame frame = frame_over({{-20, -20}, {20, 20}}, 0.4);
  const auto cells = testing::number_of(frame, {0, frame.samples.y});
  MeasuredPoints points;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const glm::dvec2 sample = frame.to_D(
        {static_cast<int>(cell) % frame.samples.x, static_cast<int>(cell) / frame.samples.x});
    const std::size_t count = 3 + cell % 20;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = 32 * cell + k;
      const glm::dvec2 p = sample + (uniform(i, 10) - 0.5) * 0.4;
      const auto group = static_cast<std::uint32_t>(4 * cell + k % 4);
      const bool is_lidar = k % 4 < 2;
      const double sd_m = is_lidar ? 0.01 : 0.02 + 0.03 * uniform(i, 11).x;
      const double bias_m = is_lidar ? 0.003 : 0.02, across_m = 0.03;
      const glm::dvec2 off = across_m * normal(i, 12);
      double z = 0.4 * (p.x + off.x) - 0.1 * (p.y + off.y) + sd_m * normal(i, 13).x +
                 bias_m * normal(group, 14).x;
      if (uniform(i, 15).x < 0.015) z += 6 * (uniform(i, 16).x - 0.5);
      add_point(points, {p, z}, sd_m, bias_m, across_m, group, is_lidar ? Lidar : Stereo);
    }
  }
  const Fusion fusion = fuse_all(points, frame);
  double sum = 0, one = 0, two = 0, count = 0;
  for (std::size_t i = 0; i < cells; ++i) {
    if (std::isnan(fusion.layers.elevation_m[i])) continue;
    const glm::dvec2 p =
        frame.to_D({static_cast<int>(i) % frame.samples.x, static_cast<int>(i) / frame.samples.x});
    const double z = (double{fusion.layers.elevation_m[i]} - 0.4 * p.x + 0.1 * p.y) /
                     std::sqrt(double{fusion.layers.variance_m2[i]});
    sum += z * z;
    one += std::abs(z) <= 1 ? 1 : 0;
    two += std::abs(z) <= 2 ? 1 : 0;
    count += 1;
  }
  const double rms = std::sqrt(sum / count);
  EXPECT_GT(count, 0.995 * static_cast<double>(cells));
  EXPECT_NEAR(rms, 1, 0.15);
  EXPECT_NEAR(one / count, 0.683, 0.05);
  EXPECT_NEAR(two / count, 0.954, 0.02);
  record_margin("normalised error of fused heights", rms - 1, 0.15);
  RecordProperty("coverage", fmt::format("{:.3f} {:.3f}", one / count, two / count));
}

// Cells of a plane, each seen by two pairs and a scan along a line that dips by 10 degrees.
struct ObliqueView {
  glm::dvec2 slope{0};
  int most_points = 0;  // of a cell
};

MeasuredPoints seen_obliquely(const ObliqueView& view, const GridFrame& frame, std::size_t cells) {
  const glm::dvec3 sight(std::cos(0.2) * std::cos(0.17), std::sin(0.2) * std::cos(0.17),
                         -std::sin(0.17));
  const glm::dvec2 lean = glm::dvec2(sight) / sight.z;
  constexpr double across_m = 0.03;
  MeasuredPoints points;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const glm::dvec2 sample = frame.to_D(
        {static_cast<int>(cell) % frame.samples.x, static_cast<int>(cell) / frame.samples.x});
    const std::size_t count = 4 + cell % static_cast<std::size_t>(view.most_points - 3);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = 32 * cell + k;
      const glm::dvec2 p = sample + (uniform(i, 20) - 0.5) * 0.4;
      const auto group = static_cast<std::uint32_t>(3 * cell + k % 3);
      const bool is_lidar = k % 3 == 0;
      const double sd_m = is_lidar ? 0.01 : 0.02 + 0.03 * uniform(i, 21).x;
      const double bias_m = is_lidar ? 0.003 : 0.02;
      const double shift_m = bias_m * normal(group, 24).x;
      const double along_m = sd_m * normal(i, 23).x + (is_lidar ? 0 : shift_m);  // in height
      // The measured position is where the errors move the ground point that was hit.
      const glm::dvec2 met = p - along_m * lean - across_m * normal(i, 22);
      add_point(points, {p, glm::dot(view.slope, met) + along_m + (is_lidar ? shift_m : 0)}, sd_m,
                bias_m, across_m, group, is_lidar ? Lidar : Stereo, lean);
    }
  }
  return points;
}

// Errors along lines of sight that dip by 10 degrees (6 m in plan per metre of height), on ground
// that faces the sensor, is level, falls away from it, or is seen from the side. With exact normal
// errors, 10^4 cells give a root mean square of 1 within 1 %; chi² is one-sided, so a smaller value
// is expected. Ground that falls away more steeply is subject to least_tilt.
TEST(CellFit, StatedErrorsAreCorrectAlongLinesOfSight) {
  const GridFrame frame = frame_over({{-20, -20}, {20, 20}}, 0.4);
  const auto cells = testing::number_of(frame, {0, frame.samples.y});
  for (const glm::dvec2 slope : {glm::dvec2(0.3, 0.06), {0, 0}, {-0.07, -0.02}, {-0.06, 0.3}}) {
    const Fusion fusion = fuse_all(seen_obliquely({slope, 23}, frame, cells), frame);
    double sum = 0, within = 0, count = 0;
    for (std::size_t i = 0; i < cells; ++i) {
      if (std::isnan(fusion.layers.elevation_m[i])) continue;
      const glm::dvec2 p = frame.to_D(
          {static_cast<int>(i) % frame.samples.x, static_cast<int>(i) / frame.samples.x});
      const double z = (double{fusion.layers.elevation_m[i]} - glm::dot(slope, p)) /
                       std::sqrt(double{fusion.layers.variance_m2[i]});
      sum += z * z;
      within += std::abs(z) <= 1 ? 1 : 0;
      count += 1;
    }
    const double rms = std::sqrt(sum / count);
    EXPECT_GT(count, 0.99 * static_cast<double>(cells));
    EXPECT_NEAR(rms, 1, 0.15) << slope.x << ", " << slope.y;
    EXPECT_NEAR(within / count, 0.683, 0.05);
    record_margin(fmt::format("oblique errors, slope {} {}", slope.x, slope.y), rms - 1, 0.15);
  }
}

}  // namespace
}  // namespace groundray::cell_fit_test
