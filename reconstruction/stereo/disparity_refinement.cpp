#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "core/math.h"
#include "reconstruction/stereo/semi_global.h"

namespace groundray {
namespace {

constexpr int most_steps = 8;
constexpr double done_px = 0.002;
constexpr double most_shift_px = 1;  // from the start
constexpr double most_off_plane_px = 1;
constexpr double steepest = 0.8;  // largest change of disparity from pixel to pixel
// Contribution of independent noise of both images, together of variance 1, to the mean square of
// their mean slope: a quarter of a spline's mean square slope, which is 9 (2 / sqrt(3) - 1) = 1.39
// at pixels and little more between them.
constexpr double noise_slope = 0.36;
constexpr double least_texture = 0.1;  // least fraction of the slopes that is not noise
// Error of a plane in the middle of a window, per root mean square deviation of the starting
// disparities from it: 0.82 for a surface of second degree that bends in one direction, with
// weights that end at two standard deviations. Less than that, found by trial, because these
// disparities have noise, too.
constexpr double bend_share = 0.5;
// Noise of rounding to 255 steps; no image is more accurate.
constexpr double least_noise = 0.29 / 255;

// Rows of an image as cubic splines through its pixels.
class RowSplines {
 public:
  explicit RowSplines(const ImageF& image)
      : width_(image.width()), coefficients_(image.values().begin(), image.values().end()) {
    tbb::parallel_for(0, image.height(), [&](int row) { prefilter(row); });
  }

  struct Sample {
    double value = 0, by_x = 0;
  };
  Sample at(double x, int row) const {
    const int cell = static_cast<int>(std::floor(x));
    const double t = x - cell, s = 1 - t;
    const std::array<double, 4> values{s * s * s / 6, 2.0 / 3 - t * t * (2 - t) / 2,
                                       2.0 / 3 - s * s * (2 - s) / 2, t * t * t / 6};
    const std::array<double, 4> slopes{-s * s / 2, t * (1.5 * t - 2), -s * (1.5 * s - 2),
                                       t * t / 2};
    Sample sample;
    for (int i = 0; i < 4; ++i) {
      const double c = coefficient(cell - 1 + i, row);
      sample.value += values[static_cast<std::size_t>(i)] * c;
      sample.by_x += slopes[static_cast<std::size_t>(i)] * c;
    }
    return sample;
  }

 private:
  std::size_t index(int x, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }
  double coefficient(int x, int row) const {
    return static_cast<double>(coefficients_[index(std::clamp(x, 0, width_ - 1), row)]);
  }
  // The image is mirrored beyond its edges, with edge pixels repeated; so are the coefficients.
  void prefilter(int row) {
    const double pole = std::sqrt(3.0) - 2;
    const std::size_t first = index(0, row), last = index(width_ - 1, row);
    std::vector<double> c(coefficients_.begin() + static_cast<std::ptrdiff_t>(first),
                          coefficients_.begin() + static_cast<std::ptrdiff_t>(last) + 1);
    for (double& value : c) value *= 6;
    c[0] = mirrored_sum(c, pole);
    for (std::size_t i = 1; i < c.size(); ++i) c[i] += pole * c[i - 1];
    c.back() *= -pole / (1 - pole);
    for (std::size_t i = c.size() - 1; i-- > 0;) c[i] = pole * (c[i + 1] - c[i]);
    std::ranges::transform(c, coefficients_.begin() + static_cast<std::ptrdiff_t>(first),
                           [](double value) { return static_cast<float>(value); });
  }

  // Returns the first value plus its mirrored predecessors, each times a power of the pole.
  static double mirrored_sum(const std::vector<double>& values, double pole) {
    const std::size_t period = 2 * values.size();
    double sum = values[0], power = 1;
    for (std::size_t i = 0; std::abs(power) > 1e-17; ++i) {
      power *= pole;
      const std::size_t at = i % period;
      sum += power * values[std::min(at, period - 1 - at)];
    }
    return sum;
  }

  int width_;
  std::vector<float> coefficients_;
};

struct Plane {
  double at_px = 0, by_x = 0, by_y = 0;
  double of(int dx, int dy) const { return at_px + by_x * dx + by_y * dy; }
};

struct Refined {
  double disparity_px = 0, sd_px = 0, bend_px = 0, explained = 0;
};

class Refinement {
 public:
  Refinement(const ImageF& left, const ImageF& right, const ImageF& start_px, int window_px)
      : start_px_(start_px), left_(left), right_(right), image_(left), reach_(window_px / 2) {
    const double sd = std::max(0.5, window_px / 4.5);
    for (int i = -reach_; i <= reach_; ++i) fall_.push_back(math::exp(-0.5 * i * i / (sd * sd)));
  }

  std::optional<Refined> at(int x, int y) const {
    const double start = start_px_.at(x, y)[0];
    if (std::isnan(start)) return std::nullopt;
    Plane plane = plane_at(x, y, start);
    const double begin_px = plane.at_px;
    double gain = 1;
    for (int step = 0; step < most_steps; ++step) {
      const auto fit = fit_at(x, y, plane, begin_px, gain);
      if (!fit) return std::nullopt;
      plane.at_px += fit->shift_px;
      gain = fit->gain;
      if (!(std::abs(plane.at_px - start) <= most_shift_px)) return std::nullopt;
      if (std::abs(fit->shift_px) <= done_px)
        return Refined{plane.at_px, fit->sd_px, fit->bend_px, fit->explained};
    }
    return std::nullopt;
  }

 private:
  struct Fit {
    double shift_px = 0, sd_px = 0, bend_px = 0, explained = 0, gain = 1;
  };

  template <typename Visit>
  void visit(int x, int y, Visit&& look) const {
    const double* fall = fall_.data() + reach_;
    for (int dy = std::max(-reach_, -y); dy <= std::min(reach_, image_.height() - 1 - y); ++dy) {
      for (int dx = std::max(-reach_, -x); dx <= std::min(reach_, image_.width() - 1 - x); ++dx) {
        look(dx, dy, fall[dx] * fall[dy]);
      }
    }
  }

  // Fits a plane to the starting values near a pixel; level if there are too few.
  Plane plane_at(int x, int y, double start) const {
    glm::dmat3 normal(0);
    glm::dvec3 right_side(0);
    int count = 0;
    visit(x, y, [&](int dx, int dy, double weight) {
      const double given = start_px_.at(x + dx, y + dy)[0];
      if (!(std::abs(given - start) <= 0.5 + steepest * (std::abs(dx) + std::abs(dy)) / 2)) return;
      const glm::dvec3 row(1, dx, dy);
      normal += weight * glm::outerProduct(row, row);
      right_side += weight * row * given;
      ++count;
    });
    constexpr int least_count = 9;
    const double determinant = glm::determinant(normal);
    if (count < least_count || !(determinant > 1e-6 * normal[0][0] * normal[0][0] * normal[0][0]))
      return {start, 0, 0};
    const glm::dvec3 plane = glm::inverse(normal) * right_side;
    if (std::abs(plane.y) > steepest || std::abs(plane.z) > 2 * steepest ||
        !(std::abs(plane.x - start) <= most_shift_px / 2))
      return {start, 0, 0};
    return {plane.x, plane.y, plane.z};
  }

  // Fits left = gain right + offset - gain right' shift by least squares.
  std::optional<Fit> fit_at(int x, int y, const Plane& plane, double begin_px, double gain) const {
    glm::dmat3 normal(0), spread(0);
    glm::dvec3 right_side(0);
    double weights = 0, squares = 0, sum = 0, off_squares = 0;
    int count = 0;
    visit(x, y, [&](int dx, int dy, double weight) {
      const double given = start_px_.at(x + dx, y + dy)[0];
      const double off_px = given - plane.of(dx, dy) + (plane.at_px - begin_px);
      const double there = x + dx - plane.of(dx, dy);
      if (!(std::abs(off_px) <= most_off_plane_px) || !(there >= 0 && there <= image_.width() - 1))
        return;
      const double value = image_.at(x + dx, y + dy)[0];
      const auto other = right_.at(there, y + dy);
      const double slope =
          0.5 * (other.by_x + left_.at(x + dx, y + dy).by_x / (gain * (1 - plane.by_x)));
      const glm::dvec3 row(other.value, 1, -slope);
      const glm::dmat3 square = glm::outerProduct(row, row);
      normal += weight * square;
      spread += weight * weight * square;
      right_side += weight * row * value;
      weights += weight;
      squares += weight * value * value;
      sum += weight * value;
      off_squares += weight * off_px * off_px;
      ++count;
    });
    constexpr int least_count = 12;
    if (count < least_count) return std::nullopt;
    std::optional<Fit> fit = solve(normal, spread, right_side, squares, sum, weights);
    if (fit) fit->bend_px = bend_share * std::sqrt(off_squares / weights);
    return fit;
  }

  static std::optional<Fit> solve(const glm::dmat3& normal, const glm::dmat3& spread,
                                  const glm::dvec3& right_side, double squares, double sum,
                                  double weights) {
    const double determinant = glm::determinant(normal);
    if (!(determinant > 1e-9 * normal[0][0] * normal[1][1] * normal[2][2])) return std::nullopt;
    const glm::dmat3 back = glm::inverse(normal);
    const glm::dvec3 found = back * right_side;
    const double gain = found.x;
    if (!(gain > 0.25 && gain < 4)) return std::nullopt;
    const double residual = std::max(0.0, squares - glm::dot(found, right_side));
    const double contrast = squares - sum * sum / weights;
    const glm::dmat3 hat = back * spread;
    const double freedom = weights - (hat[0][0] + hat[1][1] + hat[2][2]);
    if (!(freedom > 0)) return std::nullopt;
    const double variance = std::max(residual / freedom, 2 * least_noise * least_noise);
    const glm::dmat3 covariance = variance * (back * spread * back);
    const double information = 1 / back[2][2];
    const double texture = 1 - noise_slope * variance * weights / (gain * gain * information);
    if (!(texture > least_texture)) return std::nullopt;
    return Fit{.shift_px = found.z / gain,
               .sd_px = std::sqrt(std::max(0.0, covariance[2][2])) / (gain * texture),
               .explained = contrast > 0 ? std::max(0.0, 1 - residual / contrast) : 0,
               .gain = gain};
  }

  const ImageF& start_px_;
  RowSplines left_, right_;
  const ImageF& image_;
  int reach_;
  std::vector<double> fall_;
};

}  // namespace

RefinedDisparity refine(const ImageF& left, const ImageF& right, const ImageF& start_px,
                        int window_px) {
  const ImageF empty(left.width(), left.height(), 1);
  RefinedDisparity result{empty, empty, empty, empty};
  const Refinement refinement(left, right, start_px, window_px);
  tbb::parallel_for(0, left.height(), [&](int y) {
    for (int x = 0; x < left.width(); ++x) {
      const auto refined = refinement.at(x, y);
      result.disparity_px.at(x, y)[0] =
          refined ? static_cast<float>(refined->disparity_px) : no_disparity;
      result.sd_px.at(x, y)[0] = refined ? static_cast<float>(refined->sd_px) : no_disparity;
      result.bend_px.at(x, y)[0] = refined ? static_cast<float>(refined->bend_px) : no_disparity;
      result.explained.at(x, y)[0] = refined ? static_cast<float>(refined->explained) : 0;
    }
  });
  return result;
}

}  // namespace groundray
