#include "reconstruction/dem/cell_fit.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "reconstruction/dem/float_lanes.h"
#include "reconstruction/dem/order_statistic.h"

namespace groundray {
namespace {

constexpr float least_sd_m = 1e-4F;  // what is said to be nearer counts as this
constexpr int huber_rounds = 3, tukey_rounds = 5;
constexpr float huber_limit = 1.345F, tukey_limit = 4.685F;  // 95 % efficient on normal errors

// By how much of the sd of neighbours about their plane the ground at a sample may differ from the
// plane through its own cell, and more for each cell that the middle of its points is off. By trial
// on rolling ground.
constexpr double roughness_share = 0.1, roughness_off = 0.3;

constexpr std::uint32_t no_group = std::numeric_limits<std::uint32_t>::max();

double rise2(const SurfacePlane& plane) {
  return plane.slope_x * plane.slope_x + plane.slope_y * plane.slope_y;
}

struct Inverse {
  double hh = 0, hx = 0, hy = 0, xx = 0, xy = 0, yy = 0;
};

}  // namespace

struct CellFit::Sums {
  double w = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, yy = 0, xz = 0, yz = 0;

  // Inverse of the normal equations' matrix, with what is known of the slopes added.
  Inverse inverse(const NeighbourPlane& known) const noexcept {
    // The height is eliminated first: what is left is positive by what is known.
    const double mean_x = x / w, mean_y = y / w;
    const double a = std::max(0.0, xx - x * mean_x) + known.information_xx;
    const double b = xy - x * mean_y + known.information_xy;
    const double c = std::max(0.0, yy - y * mean_y) + known.information_yy;
    const double per = 1 / (a * c - b * b);
    Inverse m{.xx = c * per, .xy = -b * per, .yy = a * per};
    m.hx = -(m.xx * mean_x + m.xy * mean_y);
    m.hy = -(m.xy * mean_x + m.yy * mean_y);
    m.hh = 1 / w - mean_x * m.hx - mean_y * m.hy;
    return m;
  }

  SurfacePlane solve(const NeighbourPlane& known) const noexcept {
    const Inverse m = inverse(known);
    const SurfacePlane& p = known.plane;
    const double right_x = xz + known.information_xx * p.slope_x + known.information_xy * p.slope_y;
    const double right_y = yz + known.information_xy * p.slope_x + known.information_yy * p.slope_y;
    return {m.hh * z + m.hx * right_x + m.hy * right_y, m.hx * z + m.xx * right_x + m.xy * right_y,
            m.hy * z + m.xy * right_x + m.yy * right_y};
  }
};

void CellFit::unpack(std::span<const PackedPoint> points, glm::dvec2 step_m,
                     std::int32_t reference) {
  count_ = points.size();
  padded_ = whole_lanes(count_);
  for (auto* const column : {&x_m_, &y_m_, &z_m_, &noise_m2_, &across_m2_, &bias_m_, &variance_m2_,
                             &gain_, &per_sd_, &weight_, &size_}) {
    if (column->size() < padded_) column->resize(std::max(few_numbers, 2 * padded_));
    std::fill(column->begin() + static_cast<std::ptrdiff_t>(padded_ - lanes),
              column->begin() + static_cast<std::ptrdiff_t>(padded_), 0.F);
  }
  for (std::size_t i = count_; i < padded_; ++i) noise_m2_[i] = 1;
  const auto step_x = static_cast<float>(step_m.x), step_y = static_cast<float>(step_m.y);
  for (std::size_t i = 0; i < count_; ++i) {
    const PackedPoint& p = points[i];
    x_m_[i] = PackedPoint::from_sample(p.x) * step_x;
    y_m_[i] = PackedPoint::from_sample(p.y) * step_y;
    z_m_[i] = static_cast<float>(static_cast<double>(std::int64_t{p.height} - reference) *
                                 PackedPoint::height_step_m);
    const float sd = std::max(least_sd_m, unpacked_sd(p.sd)), across = unpacked_sd(p.across);
    noise_m2_[i] = sd * sd;
    across_m2_[i] = across * across;
    bias_m_[i] = unpacked_sd(p.bias);
  }
}

// In the order in which groups come up: a table that is never more than half full.
void CellFit::number_groups(std::span<const PackedPoint> points) {
  const std::size_t mask = std::bit_ceil(2 * count_) - 1;
  if (table_.size() <= mask) table_.resize(mask + 1);
  std::fill_n(table_.begin(), mask + 1, no_group);
  if (group_.size() < count_) group_.resize(2 * padded_);
  names_.clear();
  for (std::size_t i = 0; i < count_; ++i) {
    const std::uint32_t name = points[i].group;
    std::size_t at = (name * 2654435769U >> 12U) & mask;
    while (table_[at] != no_group && names_[table_[at]] != name) at = (at + 1) & mask;
    if (table_[at] == no_group) {
      table_[at] = static_cast<std::uint32_t>(names_.size());
      names_.push_back(name);
    }
    group_[i] = table_[at];
  }
}

// Sets variances and weights for the slope of `plane`.
void CellFit::weigh(const SurfacePlane& plane) {
  const auto rise_squared = static_cast<float>(rise2(plane));
  for (std::size_t i = 0; i < padded_; i += lanes) {
    const FloatLanes variance = load(&noise_m2_[i]) + rise_squared * load(&across_m2_[i]);
    const FloatLanes bias = load(&bias_m_[i]);
    store(variance, &variance_m2_[i]);
    store(1 / variance, &gain_[i]);
    store(1 / (variance + bias * bias), &per_sd_[i]);
  }
  for (float& per_sd : std::span(per_sd_).first(padded_)) per_sd = std::sqrt(per_sd);
  for (std::size_t i = count_; i < padded_; ++i) gain_[i] = 0;
  share_.assign(names_.size(), 0);
  for (std::size_t i = 0; i < count_; ++i)
    share_[group_[i]] += double{bias_m_[i] * bias_m_[i] * gain_[i]};
  for (double& share : share_) share = 1 / (1 + share);
  for (std::size_t i = 0; i < count_; ++i) gain_[i] *= static_cast<float>(share_[group_[i]]);
}

// The k-th least of size_.
float CellFit::kth_size(std::size_t k) {
  if (count_ <= few_numbers) return kth_of_few(size_.data(), count_, k);
  const auto begin = size_.begin(), at = begin + static_cast<std::ptrdiff_t>(k);
  std::nth_element(begin, at, begin + static_cast<std::ptrdiff_t>(count_));
  return *at;
}

// The height at the sample of a plane through the points' middle: points ascend.
double CellFit::median_height(const SurfacePlane& slopes) {
  FloatLanes x{}, y{};
  for (std::size_t i = 0; i < padded_; i += lanes) {
    x += load(&x_m_[i]);
    y += load(&y_m_[i]);
  }
  const double middle = 0.5 * (double{z_m_[(count_ - 1) / 2]} + double{z_m_[count_ / 2]});
  return middle - (slopes.slope_x * double{total(x)} + slopes.slope_y * double{total(y)}) /
                      static_cast<double>(count_);
}

// By how much residuals exceed their sd; 1 if they do not.
double CellFit::scale(const SurfacePlane& plane) {
  const auto h = static_cast<float>(plane.height_m), a = static_cast<float>(plane.slope_x),
             b = static_cast<float>(plane.slope_y);
  constexpr float to_sd = 1.4826F;  // from the median size of normal errors
  for (std::size_t i = 0; i < padded_; i += lanes) {
    const FloatLanes off = load(&z_m_[i]) - h - a * load(&x_m_[i]) - b * load(&y_m_[i]);
    store(size_of(off) * load(&per_sd_[i]) * to_sd, &size_[i]);
  }
  std::fill(size_.data() + count_, size_.data() + padded_, std::numeric_limits<float>::infinity());
  IntLanes small{};
  for (std::size_t i = 0; i < padded_; i += lanes) small -= load(&size_[i]) <= 1.F;
  std::size_t within = 0;
  for (std::size_t i = 0; i < lanes; ++i) within += static_cast<std::size_t>(small[i]);
  return within > count_ / 2 ? 1 : std::max(1.0, double{kth_size(count_ / 2)});
}

template <typename Robust>
CellFit::Sums CellFit::sum(const SurfacePlane& plane, double scale, const Robust& robust) {
  const auto h = static_cast<float>(plane.height_m), a = static_cast<float>(plane.slope_x),
             b = static_cast<float>(plane.slope_y), per_scale = static_cast<float>(1 / scale);
  const float per_variance = per_scale * per_scale;
  FloatLanes w{}, x{}, y{}, z{}, xx{}, xy{}, yy{}, xz{}, yz{};
  for (std::size_t i = 0; i < padded_; i += lanes) {
    const FloatLanes at_x = load(&x_m_[i]), at_y = load(&y_m_[i]), at_z = load(&z_m_[i]);
    const FloatLanes off = at_z - h - a * at_x - b * at_y;
    const FloatLanes weight =
        load(&gain_[i]) * per_variance * robust(size_of(off) * load(&per_sd_[i]) * per_scale);
    store(weight, &weight_[i]);
    const FloatLanes wx = weight * at_x, wy = weight * at_y;
    w += weight;
    x += wx;
    y += wy;
    z += weight * at_z;
    xx += wx * at_x;
    xy += wx * at_y;
    yy += wy * at_y;
    xz += wx * at_z;
    yz += wy * at_z;
  }
  return {total(w),  total(x),  total(y),  total(z), total(xx),
          total(xy), total(yy), total(xz), total(yz)};
}

// Improves `plane` until it does not change, but no more than `rounds` times.
template <typename Robust>
void CellFit::iterate(SurfacePlane& plane, const NeighbourPlane& neighbours, double scale,
                      int rounds, const Robust& robust) {
  constexpr double little = 5e-3;  // of its sd
  for (int round = 0; round < rounds; ++round) {
    const Sums sums = sum(plane, scale, robust);
    if (!(sums.w > 0)) return;  // not so: at least half of the points are near
    const SurfacePlane next = sums.solve(neighbours);
    const double h = next.height_m - plane.height_m, a = next.slope_x - plane.slope_x,
                 b = next.slope_y - plane.slope_y;
    plane = next;
    if (sums.w * h * h + sums.xx * a * a + sums.yy * b * b < little * little) return;
  }
}

CellHeight CellFit::operator()(std::span<const PackedPoint> points,
                               const NeighbourPlane& neighbours, glm::dvec2 step_m,
                               std::int32_t reference) {
  unpack(points, step_m, reference);
  number_groups(points);
  SurfacePlane plane = neighbours.plane;
  weigh(plane);
  plane.height_m = median_height(plane);
  iterate(plane, neighbours, scale(plane), huber_rounds,
          [](const FloatLanes& size) { return huber_limit / larger(size, all_of(huber_limit)); });
  if (std::abs(rise2(plane) - rise2(neighbours.plane)) > 0.01) weigh(plane);
  const double times = scale(plane);
  const auto tukey = [](const FloatLanes& size) {
    constexpr float per_limit2 = 1 / (tukey_limit * tukey_limit);
    const FloatLanes inside = larger(FloatLanes{}, 1 - size * size * per_limit2);
    return inside * inside;
  };
  iterate(plane, neighbours, times, tukey_rounds, tukey);
  return finish(plane, sum(plane, times, tukey), neighbours, step_m);
}

// Counts the points that weigh something, and sets chi2 to the sum of their squared residuals, each
// over what is to be expected of it.
void CellFit::compare(const SurfacePlane& plane, double bias_m2, CellHeight& found) const {
  found.chi2 = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    if (!(weight_[i] > 0)) continue;
    const double residual_m = double{z_m_[i]} - plane.height_m - plane.slope_x * double{x_m_[i]} -
                              plane.slope_y * double{y_m_[i]};
    // What is common to a group is in the estimate too, as far as the group is.
    const double bias = bias_m_[i];
    const double expected_m2 =
        double{variance_m2_[i]} +
        std::max(0.0, bias * bias - 2 * bias * bias_sum_m_[group_[i]] + bias_m2);
    found.chi2 += residual_m * residual_m / expected_m2;
    ++((names_[group_[i]] & 1U) == 0 ? found.lidar : found.stereo);
  }
}

CellHeight CellFit::finish(const SurfacePlane& plane, const Sums& sums,
                           const NeighbourPlane& neighbours, glm::dvec2 step_m) {
  CellHeight found{.plane = plane};
  const Inverse m = sums.inverse(neighbours);
  // By how much the height at the sample rises with each point's.
  const auto lever_h = static_cast<float>(m.hh), lever_x = static_cast<float>(m.hx),
             lever_y = static_cast<float>(m.hy);
  FloatLanes noise_lanes{};
  for (std::size_t i = 0; i < padded_; i += lanes) {
    const FloatLanes lever =
        load(&weight_[i]) * (lever_h + lever_x * load(&x_m_[i]) + lever_y * load(&y_m_[i]));
    noise_lanes += lever * lever * load(&variance_m2_[i]);
    store(lever, &size_[i]);
  }
  const double noise_m2 = total(noise_lanes);
  bias_sum_m_.assign(names_.size(), 0);
  for (std::size_t i = 0; i < count_; ++i) bias_sum_m_[group_[i]] += double{size_[i] * bias_m_[i]};
  double bias_m2 = 0;
  for (const double sum_m : bias_sum_m_) bias_m2 += sum_m * sum_m;

  compare(plane, bias_m2, found);
  const double inside = found.lidar + found.stereo;
  const double known = m.xx * neighbours.information_xx + 2 * m.xy * neighbours.information_xy +
                       m.yy * neighbours.information_yy;
  const double freedom = inside - 3 + known;
  found.chi2 =
      inside > 1 && freedom > 0.1 ? found.chi2 / freedom : std::numeric_limits<double>::quiet_NaN();
  const double lent_m2 = m.hx * m.hx * neighbours.information_xx +
                         2 * m.hx * m.hy * neighbours.information_xy +
                         m.hy * m.hy * neighbours.information_yy;
  const double off = std::hypot(sums.x / step_m.x, sums.y / step_m.y) / sums.w;
  const double rough_m = neighbours.scatter_m * std::hypot(roughness_share, roughness_off * off);
  found.variance_m2 =
      noise_m2 * (found.chi2 > 1 ? found.chi2 : 1.0) + bias_m2 + lent_m2 + rough_m * rough_m;
  return found;
}

}  // namespace groundray
