#include "reconstruction/dem/fusion/cell_columns.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/ext/scalar_constants.hpp>

#include "core/math.h"
#include "reconstruction/dem/fusion/float_lanes.h"

namespace groundray {
namespace {

constexpr float least_sd_m = 1e-4F;  // lower limit of a point's standard deviation

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
  return {math::exp(-0.5 * above_m * above_m / variance_m2) /
              std::sqrt(2 * glm::pi<double>() * variance_m2),
          gain * above_m, sample_m2 - gain * with_m2};
}

Choice given_both(const Joint& c, double a_m, double b_m) {
  const double det = c.aa * c.bb - c.ab * c.ab;
  const double gain_a = (c.bb * c.with[0] - c.ab * c.with[1]) / det,
               gain_b = (c.aa * c.with[1] - c.ab * c.with[0]) / det;
  const double square = (c.bb * a_m * a_m - 2 * c.ab * a_m * b_m + c.aa * b_m * b_m) / det;
  return {math::exp(-0.5 * square) / (2 * glm::pi<double>() * std::sqrt(det)),
          gain_a * a_m + gain_b * b_m, c.sample - gain_a * c.with[0] - gain_b * c.with[1]};
}

}  // namespace

void CellColumns::unpack(std::span<const PackedPoint> points, glm::dvec2 step_m,
                         std::int32_t reference) {
  count = points.size();
  padded = whole_lanes(count);
  for (auto* const column :
       {&x_m, &y_m, &z_m, &noise_m2, &across_m2, &lean_x, &lean_y, &level_bias_m, &leaning_bias_m,
        &bias_m, &variance_m2, &gain, &per_sd, &weight, &size}) {
    if (column->size() < padded) column->resize(std::max(few_numbers, 2 * padded));
    std::fill(column->begin() + static_cast<std::ptrdiff_t>(padded - lanes),
              column->begin() + static_cast<std::ptrdiff_t>(padded), 0.F);
  }
  for (std::size_t i = count; i < padded; ++i) noise_m2[i] = 1;
  const auto step_x = static_cast<float>(step_m.x), step_y = static_cast<float>(step_m.y);
  std::uint32_t leans = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const PackedPoint& p = points[i];
    x_m[i] = PackedPoint::from_sample(p.x) * step_x;
    y_m[i] = PackedPoint::from_sample(p.y) * step_y;
    z_m[i] = static_cast<float>(static_cast<double>(std::int64_t{p.height} - reference) *
                                PackedPoint::height_step_m);
    const float sd = std::max(least_sd_m, unpacked_sd(p.sd)), across = unpacked_sd(p.across);
    noise_m2[i] = sd * sd;
    across_m2[i] = across * across;
    level_bias_m[i] = unpacked_sd(p.bias);
    leaning_bias_m[i] = p.origin() == PointOrigin::Stereo ? level_bias_m[i] : 0;
    lean_x[i] = unpacked_lean(p.lean_x);
    lean_y[i] = unpacked_lean(p.lean_y);
    leans |= std::uint32_t{p.lean_x} | p.lean_y;
  }
  is_leaning = leans != 0;
  number_groups(points);
}

// Numbers groups in the order of their first points, by a hash table that is at most half full.
void CellColumns::number_groups(std::span<const PackedPoint> points) {
  const std::size_t mask = std::bit_ceil(2 * count) - 1;
  if (table_.size() <= mask) table_.resize(mask + 1);
  std::fill_n(table_.begin(), mask + 1, no_group);
  if (group_of.size() < count) group_of.resize(2 * padded);
  names.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t name = points[i].group;
    std::size_t at = (name * 2654435769U >> 12U) & mask;
    while (table_[at] != no_group && names[table_[at]] != name) at = (at + 1) & mask;
    if (table_[at] == no_group) {
      table_[at] = static_cast<std::uint32_t>(names.size());
      names.push_back(name);
    }
    group_of[i] = table_[at];
  }
}

void CellColumns::unbend(const SurfaceBend& bend, glm::dvec2 step_m) {
  const auto xx = static_cast<float>(bend.xx), yy = static_cast<float>(bend.yy),
             xy = static_cast<float>(bend.xy);
  const auto per_x = static_cast<float>(1 / step_m.x), per_y = static_cast<float>(1 / step_m.y);
  for (std::size_t i = 0; i < padded; i += lanes) {
    const FloatLanes u = load(&x_m[i]) * per_x, v = load(&y_m[i]) * per_y;
    const FloatLanes above = xx * curvature_profile(u) + yy * curvature_profile(v) + xy * u * v;
    store(load(&z_m[i]) - above, &z_m[i]);
  }
}

// Sets the variances and biases of the points' distances from ground with the slope of `plane`.
void CellColumns::tilt(const SurfacePlane& plane, const SlopeSpread& spread) {
  const auto a = static_cast<float>(plane.slope_x), b = static_cast<float>(plane.slope_y),
             rise_squared = static_cast<float>(rise2(plane));
  if (!is_leaning) {
    for (std::size_t i = 0; i < padded; i += lanes)
      store(load(&noise_m2[i]) + rise_squared * load(&across_m2[i]), &variance_m2[i]);
    std::copy_n(level_bias_m.begin(), padded, bias_m.begin());
    return;
  }
  const auto xx = static_cast<float>(spread.xx), xy = static_cast<float>(spread.xy),
             yy = static_cast<float>(spread.yy);
  for (std::size_t i = 0; i < padded; i += lanes) {
    const FloatLanes x = load(&lean_x[i]), y = load(&lean_y[i]);
    const FloatLanes along = a * x + b * y, unknown = xx * x * x + 2 * xy * x * y + yy * y * y;
    const FloatLanes bias = load(&leaning_bias_m[i]);
    const FloatLanes tilt = larger(1 - along, least_tilt(x, y));
    const FloatLanes off = load(&level_bias_m[i]) - bias * (1 - tilt);
    store(load(&noise_m2[i]) * (tilt * tilt + unknown) + rise_squared * load(&across_m2[i]),
          &variance_m2[i]);
    store(off, &bias_m[i]);
    store(off * off + bias * bias * unknown, &size[i]);
  }
  for (std::size_t i = 0; i < padded; ++i) bias_m[i] = std::copysign(std::sqrt(size[i]), bias_m[i]);
}

void CellColumns::weigh(const SurfacePlane& plane, const SlopeSpread& spread) {
  tilt(plane, spread);
  for (std::size_t i = 0; i < padded; i += lanes) {
    const FloatLanes variance = load(&variance_m2[i]), bias = load(&bias_m[i]);
    store(1 / variance, &gain[i]);
    store(1 / (variance + bias * bias), &per_sd[i]);
  }
  for (float& one : std::span(per_sd).first(padded)) one = std::sqrt(one);
  for (std::size_t i = count; i < padded; ++i) gain[i] = 0;
  shares_.assign(names.size(), 0);
  for (std::size_t i = 0; i < count; ++i)
    shares_[group_of[i]] += double{bias_m[i] * bias_m[i] * gain[i]};
  for (double& share : shares_) share = 1 / (1 + share);
  for (std::size_t i = 0; i < count; ++i) gain[i] *= static_cast<float>(shares_[group_of[i]]);
}

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
