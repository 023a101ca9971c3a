#include "apps/golden/compare/images/image_similarity.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace groundray::golden {
namespace {

constexpr int reach_px = 5;
constexpr std::size_t window_px = 2 * reach_px + 1;

std::array<double, window_px> weights() {
  constexpr double sigma_px = 1.5;
  std::array<double, window_px> result{};
  double sum = 0;
  for (std::size_t i = 0; i < window_px; ++i) {
    const double off_px = static_cast<double>(i) - reach_px;
    sum += result[i] = std::exp(-off_px * off_px / (2 * sigma_px * sigma_px));
  }
  for (double& weight : result) weight /= sum;
  return result;
}

/// Weighted means of a, b, a a, b b and a b.
using Moments = std::array<double, 5>;
constexpr int moments = 5;

/// Returns weighted means along each row. The Gaussian is separable: means along columns follow.
Image<double> along_rows(const Image<double>& a, const Image<double>& b) {
  const auto weight = weights();
  Image<double> result(a.width(), a.height(), moments);
  for (int y = 0; y < a.height(); ++y) {
    for (int x = reach_px; x < a.width() - reach_px; ++x) {
      const auto to = result.at(x, y);
      for (std::size_t i = 0; i < window_px; ++i) {
        const int from = x + static_cast<int>(i) - reach_px;
        const double of_a = a.at(from, y)[0], of_b = b.at(from, y)[0];
        const Moments terms{of_a, of_b, of_a * of_a, of_b * of_b, of_a * of_b};
        for (std::size_t k = 0; k < terms.size(); ++k) to[k] += weight[i] * terms[k];
      }
    }
  }
  return result;
}

double similarity(const Moments& mean, double range) {
  const double c1 = 0.01 * range * 0.01 * range, c2 = 0.03 * range * 0.03 * range;
  const double both = mean[0] * mean[1], squares = mean[0] * mean[0] + mean[1] * mean[1];
  const double variances = mean[2] + mean[3] - squares, covariance = mean[4] - both;
  return (2 * both + c1) * (2 * covariance + c2) / ((squares + c1) * (variances + c2));
}

}  // namespace

double structural_similarity(const Image<double>& a, const Image<double>& b, double range) {
  const auto weight = weights();
  const Image<double> rows = along_rows(a, b);
  double sum = 0;
  std::size_t count = 0;
  for (int y = reach_px; y < a.height() - reach_px; ++y) {
    for (int x = reach_px; x < a.width() - reach_px; ++x) {
      Moments mean{};
      for (std::size_t i = 0; i < window_px; ++i) {
        const auto row = rows.at(x, y + static_cast<int>(i) - reach_px);
        for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += weight[i] * row[k];
      }
      const double here = similarity(mean, range);
      if (!std::isfinite(here)) continue;
      sum += here;
      ++count;
    }
  }
  return count > 0 ? sum / static_cast<double>(count) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace groundray::golden
