#include "reconstruction/dem/fusion/sparse_cell.h"

#include <cmath>
#include <glm/ext/scalar_constants.hpp>

#include "reconstruction/dem/fusion/curvature_profile.h"

namespace groundray {
namespace {

// Covariances relative to the neighbours' surface, m².
struct Joint {
  double sample = 0;              // variance of the ground at the sample
  std::array<double, 2> with{};   // covariance of the points' heights with it
  double aa = 0, ab = 0, bb = 0;  // covariance of the points' heights
};

// Scatter between the points of a cell, per variance of the bend: that of ground a third of a cell
// away, 0.118².
constexpr double nearby = 0.0139;

Joint joint(const std::array<SparseCell, 2>& points, const NeighbourSurface& known,
            glm::dvec2 step_m) {
  const auto tilt = [&](const SparseCell& a) {
    return a.place_m.x * known.height_x_m2 + a.place_m.y * known.height_y_m2;
  };
  // Shared biases of points, minus the bias that the neighbours' surface shares with one group.
  const auto lever = [&](const SparseCell& a) {
    return (a.group == known.group ? a.bias_m : 0) - known.bias_m;
  };
  const auto shared = [&](const SparseCell& a, const SparseCell& b) {
    const bool is_own = a.group == b.group && a.group != known.group;
    return lever(a) * lever(b) + (is_own ? a.bias_m * b.bias_m : 0);
  };
  const auto between = [&](const SparseCell& a, const SparseCell& b) {
    const glm::dvec2 p = a.place_m, q = b.place_m, u = p / step_m, v = q / step_m;
    const SurfaceBend& bend = known.bend_variance;
    return known.height_variance_m2 + tilt(a) + tilt(b) + p.x * q.x * known.xx +
           (p.x * q.y + p.y * q.x) * known.xy + p.y * q.y * known.yy +
           bend.xx * curvature_profile(u.x) * curvature_profile(v.x) +
           bend.yy * curvature_profile(u.y) * curvature_profile(v.y) +
           bend.xy * u.x * u.y * v.x * v.y + shared(a, b);
  };
  const SparseCell &a = points[0], &b = points[1];
  Joint c;
  const double height_m2 = known.height_variance_m2;
  c.sample = height_m2 + known.bias_m * known.bias_m;
  c.with = {height_m2 + tilt(a) - known.bias_m * lever(a),
            height_m2 + tilt(b) - known.bias_m * lever(b)};
  const double apart_m2 = nearby * (known.bend_variance.xx + known.bend_variance.yy);
  c.aa = between(a, a) + a.variance_m2 + apart_m2;
  c.ab = between(a, b);
  c.bb = between(b, b) + b.variance_m2 + apart_m2;
  return c;
}

// Ground at the sample if certain points are ground, and the likelihood of their heights.
struct Choice {
  double weight = 0, above_m = 0, variance_m2 = 0;
};

Choice given_one(double variance_m2, double with_m2, double sample_m2, double above_m) {
  const double gain = with_m2 / variance_m2;
  return {std::exp(-0.5 * above_m * above_m / variance_m2) /
              std::sqrt(2 * glm::pi<double>() * variance_m2),
          gain * above_m, sample_m2 - gain * with_m2};
}

Choice given_both(const Joint& c, double a_m, double b_m) {
  const double det = c.aa * c.bb - c.ab * c.ab;
  const double gain_a = (c.bb * c.with[0] - c.ab * c.with[1]) / det,
               gain_b = (c.aa * c.with[1] - c.ab * c.with[0]) / det;
  const double square = (c.bb * a_m * a_m - 2 * c.ab * a_m * b_m + c.aa * b_m * b_m) / det;
  return {std::exp(-0.5 * square) / (2 * glm::pi<double>() * std::sqrt(det)),
          gain_a * a_m + gain_b * b_m, c.sample - gain_a * c.with[0] - gain_b * c.with[1]};
}

}  // namespace

FewHeight fit_few(const std::array<SparseCell, 2>& points, int count,
                  const NeighbourSurface& neighbours, glm::dvec2 step_m,
                  double outliers_per_m) noexcept {
  const Joint c = joint(points, neighbours, step_m);
  const double a_m = points[0].above_m, b_m = points[1].above_m, out = outliers_per_m;
  std::array<Choice, 4> choices;  // bit 0: the first point is ground; bit 1: the second
  choices[0] = {count == 1 ? out : out * out, 0, c.sample};
  choices[1] = given_one(c.aa, c.with[0], c.sample, a_m);
  if (count == 2) {
    choices[1].weight *= out;
    choices[2] = given_one(c.bb, c.with[1], c.sample, b_m);
    choices[2].weight *= out;
    choices[3] = given_both(c, a_m, b_m);
  }
  double all = 0;
  for (const Choice& one : choices) all += one.weight;
  FewHeight found;
  for (Choice& one : choices) {
    one.weight /= all;
    found.above_m += one.weight * one.above_m;
  }
  for (const Choice& one : choices) {
    const double off_m = one.above_m - found.above_m;
    found.variance_m2 += one.weight * (one.variance_m2 + off_m * off_m);
  }
  found.is_ground = {choices[1].weight + choices[3].weight, choices[2].weight + choices[3].weight};
  found.is_none = choices[0].weight;
  return found;
}

}  // namespace groundray
