#include "reconstruction/dem/cell_fit.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "reconstruction/dem/cell_bend.h"
#include "reconstruction/dem/few_points.h"
#include "reconstruction/dem/float_lanes.h"
#include "reconstruction/dem/order_statistic.h"

namespace groundray {
namespace {

constexpr float least_sd_m = 1e-4F;  // what is said to be nearer counts as this
constexpr int huber_rounds = 3, tukey_rounds = 5;
constexpr float huber_limit = 1.345F, tukey_limit = 4.685F;  // 95 % efficient on normal errors

// Of a guess from so many points half is the crest of the cell, and half where they happen to lie.
constexpr double crest_points = 4;

// Heights of outliers are spread over so much, more or less.
constexpr double outliers_reach_m = 2;
constexpr std::size_t few_points = 2;
constexpr int enough_neighbours = 5;
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
  Inverse inverse(const NeighbourSurface& known) const noexcept {
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

  SurfacePlane solve(const NeighbourSurface& known) const noexcept {
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
  for (auto* const column :
       {&x_m_, &y_m_, &z_m_, &noise_m2_, &across_m2_, &lean_x_, &lean_y_, &level_bias_m_,
        &leaning_bias_m_, &bias_m_, &variance_m2_, &gain_, &per_sd_, &weight_, &size_}) {
    if (column->size() < padded_) column->resize(std::max(few_numbers, 2 * padded_));
    std::fill(column->begin() + static_cast<std::ptrdiff_t>(padded_ - lanes),
              column->begin() + static_cast<std::ptrdiff_t>(padded_), 0.F);
  }
  for (std::size_t i = count_; i < padded_; ++i) noise_m2_[i] = 1;
  const auto step_x = static_cast<float>(step_m.x), step_y = static_cast<float>(step_m.y);
  std::uint32_t leans = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const PackedPoint& p = points[i];
    x_m_[i] = PackedPoint::from_sample(p.x) * step_x;
    y_m_[i] = PackedPoint::from_sample(p.y) * step_y;
    z_m_[i] = static_cast<float>(static_cast<double>(std::int64_t{p.height} - reference) *
                                 PackedPoint::height_step_m);
    const float sd = std::max(least_sd_m, unpacked_sd(p.sd)), across = unpacked_sd(p.across);
    noise_m2_[i] = sd * sd;
    across_m2_[i] = across * across;
    level_bias_m_[i] = unpacked_sd(p.bias);
    leaning_bias_m_[i] = p.origin() == PointOrigin::Stereo ? level_bias_m_[i] : 0;
    lean_x_[i] = unpacked_lean(p.lean_x);
    lean_y_[i] = unpacked_lean(p.lean_y);
    leans |= std::uint32_t{p.lean_x} | p.lean_y;
  }
  is_leaning_ = leans != 0;
}

// Leaves of heights what is above the bend of the neighbours' surface and the cell's crest.
void CellFit::unbend(const NeighbourSurface& neighbours, glm::dvec2 step_m) {
  const auto n = static_cast<double>(count_);
  const bool is_weighed = outliers_per_m_ > 0 && count_ <= few_points;  // the crest with the rest
  own_crest_ = is_weighed ? 0 : n / (n + crest_points);
  const double crest_m = own_crest_ * neighbours.crest_m;
  const auto xx = static_cast<float>(neighbours.bend.xx - 2 * crest_m),
             yy = static_cast<float>(neighbours.bend.yy - 2 * crest_m),
             xy = static_cast<float>(neighbours.bend.xy);
  const auto per_x = static_cast<float>(1 / step_m.x), per_y = static_cast<float>(1 / step_m.y);
  for (std::size_t i = 0; i < padded_; i += lanes) {
    const FloatLanes u = load(&x_m_[i]) * per_x, v = load(&y_m_[i]) * per_y;
    const FloatLanes bend = xx * cell_bend(u) + yy * cell_bend(v) + xy * u * v;
    store(load(&z_m_[i]) - bend, &z_m_[i]);
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

// Sets variances and biases of distances from ground with the slope of `plane`.
void CellFit::tilt(const SurfacePlane& plane, const SlopeSpread& spread) {
  const auto a = static_cast<float>(plane.slope_x), b = static_cast<float>(plane.slope_y),
             rise_squared = static_cast<float>(rise2(plane));
  if (!is_leaning_) {
    for (std::size_t i = 0; i < padded_; i += lanes)
      store(load(&noise_m2_[i]) + rise_squared * load(&across_m2_[i]), &variance_m2_[i]);
    std::copy_n(level_bias_m_.begin(), padded_, bias_m_.begin());
    return;
  }
  const auto xx = static_cast<float>(spread.xx), xy = static_cast<float>(spread.xy),
             yy = static_cast<float>(spread.yy);
  for (std::size_t i = 0; i < padded_; i += lanes) {
    const FloatLanes x = load(&lean_x_[i]), y = load(&lean_y_[i]);
    const FloatLanes along = a * x + b * y, unknown = xx * x * x + 2 * xy * x * y + yy * y * y;
    const FloatLanes bias = load(&leaning_bias_m_[i]);
    const FloatLanes tilt = larger(1 - along, least_tilt(x, y));
    const FloatLanes off = load(&level_bias_m_[i]) - bias * (1 - tilt);
    store(load(&noise_m2_[i]) * (tilt * tilt + unknown) + rise_squared * load(&across_m2_[i]),
          &variance_m2_[i]);
    store(off, &bias_m_[i]);
    store(off * off + bias * bias * unknown, &size_[i]);
  }
  for (std::size_t i = 0; i < padded_; ++i)
    bias_m_[i] = std::copysign(std::sqrt(size_[i]), bias_m_[i]);
}

// Sets variances and weights for ground with the slope of `plane`.
void CellFit::weigh(const SurfacePlane& plane, const SlopeSpread& spread) {
  tilt(plane, spread);
  for (std::size_t i = 0; i < padded_; i += lanes) {
    const FloatLanes variance = load(&variance_m2_[i]), bias = load(&bias_m_[i]);
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

// Improves `plane` until it does not change, but no more than `rounds` times; returns the last
// sums.
template <typename Robust>
CellFit::Sums CellFit::iterate(SurfacePlane& plane, const NeighbourSurface& neighbours,
                               double scale, int rounds, const Robust& robust) {
  constexpr double little = 5e-3;  // of its sd
  Sums sums;
  for (int round = 0; round < rounds; ++round) {
    sums = sum(plane, scale, robust);
    if (!(sums.w > 0)) break;  // not so: at least half of the points are near
    const SurfacePlane next = sums.solve(neighbours);
    const double h = next.height_m - plane.height_m, a = next.slope_x - plane.slope_x,
                 b = next.slope_y - plane.slope_y;
    plane = next;
    if (sums.w * h * h + sums.xx * a * a + sums.yy * b * b < little * little) break;
  }
  return sums;
}

CellFit::CellFit(double outlier_share) noexcept
    : outliers_per_m_(outlier_share / outliers_reach_m) {}

std::optional<CellHeight> CellFit::operator()(std::span<const PackedPoint> points,
                                              const NeighbourSurface& neighbours, glm::dvec2 step_m,
                                              std::int32_t reference) {
  unpack(points, step_m, reference);
  number_groups(points);
  unbend(neighbours, step_m);
  SurfacePlane plane = neighbours.plane;
  weigh(plane, {neighbours.xx, neighbours.xy, neighbours.yy});
  if (outliers_per_m_ > 0 && count_ <= few_points && neighbours.cells >= enough_neighbours)
    return fit_few_points(neighbours, step_m, reference * PackedPoint::height_step_m);
  plane.height_m = median_height(plane);
  const Inverse found =
      iterate(plane, neighbours, scale(plane), huber_rounds, [](const FloatLanes& size) {
        return huber_limit / larger(size, all_of(huber_limit));
      }).inverse(neighbours);
  if (is_leaning_ || std::abs(rise2(plane) - rise2(neighbours.plane)) > 0.01)
    weigh(plane, {found.xx, found.xy, found.yy});
  const double times = scale(plane);
  const auto tukey = [](const FloatLanes& size) {
    constexpr float per_limit2 = 1 / (tukey_limit * tukey_limit);
    const FloatLanes inside = larger(FloatLanes{}, 1 - size * size * per_limit2);
    return inside * inside;
  };
  iterate(plane, neighbours, times, tukey_rounds, tukey);
  return finish(plane, sum(plane, times, tukey), neighbours, step_m);
}

std::optional<CellHeight> CellFit::fit_few_points(const NeighbourSurface& neighbours,
                                                  glm::dvec2 step_m, double reference_m) const {
  const SurfacePlane& plane = neighbours.plane;
  const double base_m = plane.height_m - reference_m;
  std::array<FewPoint, few_points> few;
  for (std::size_t i = 0; i < count_; ++i) {
    const glm::dvec2 place_m(x_m_[i], y_m_[i]);
    // Where slopes are known but roughly, so is what places that are off do to heights.
    const double slope_m2 = double{across_m2_[i]} * (neighbours.xx + neighbours.yy);
    few[i] = {place_m,
              double{z_m_[i]} - base_m - plane.slope_x * place_m.x - plane.slope_y * place_m.y,
              double{variance_m2_[i]} + slope_m2, bias_m_[i], names_[group_[i]]};
  }
  const FewHeight got = fit_few(few, static_cast<int>(count_), neighbours, step_m, outliers_per_m_);
  if (got.is_none > 0.5) return std::nullopt;
  CellHeight found{.plane = plane,
                   .variance_m2 = got.variance_m2,
                   .chi2 = std::numeric_limits<double>::quiet_NaN()};
  found.plane.height_m = base_m + got.above_m;
  const bool is_first = got.is_ground[0] >= got.is_ground[1];
  for (std::size_t i = 0; i < count_; ++i) {
    if (got.is_ground[i] < 0.5 && is_first != (i == 0)) continue;  // the likelier one counts
    ++((names_[group_[i]] & 1U) == 0 ? found.lidar : found.stereo);
  }
  return found;
}

// Counts the points that weigh something, and sets chi2 to the sum of their squared residuals, each
// over what is to be expected of it.
void CellFit::compare(const SurfacePlane& plane, double bias_m2, CellHeight& found) {
  const auto shared_m2 = static_cast<float>(bias_m2);
  std::uint32_t stereo = 0, all = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    // What is common to a group is in the estimate too, as far as the group is.
    const std::uint32_t group = group_[i];
    const float bias = bias_m_[i];
    size_[i] =
        std::max(0.F, bias * bias - 2 * bias * static_cast<float>(bias_sum_m_[group]) + shared_m2);
    const std::uint32_t counts = weight_[i] > 0 ? 1 : 0;
    all += counts;
    stereo += counts & names_[group];
  }
  found.stereo = stereo;
  found.lidar = all - stereo;
  const auto h = static_cast<float>(plane.height_m), a = static_cast<float>(plane.slope_x),
             b = static_cast<float>(plane.slope_y);
  FloatLanes chi2{};
  for (std::size_t i = 0; i < padded_; i += lanes) {
    const FloatLanes off = load(&z_m_[i]) - h - a * load(&x_m_[i]) - b * load(&y_m_[i]);
    const FloatLanes term = off * off / (load(&variance_m2_[i]) + load(&size_[i]));
    chi2 += load(&weight_[i]) > 0 ? term : FloatLanes{};
  }
  found.chi2 = double{total(chi2)};
}

// How the height at the sample depends on points: it rises by size_ with each one's.
struct CellFit::Levers {
  Inverse inverse;
  double noise_m2 = 0, bias_m2 = 0;
  double bend_x = 0, bend_y = 0, bend_xy = 0;  // with second differences of the ground
};

CellFit::Levers CellFit::levers(const Sums& sums, const NeighbourSurface& neighbours,
                                glm::dvec2 step_m) {
  Levers found{.inverse = sums.inverse(neighbours)};
  const Inverse& m = found.inverse;
  const auto lever_h = static_cast<float>(m.hh), lever_x = static_cast<float>(m.hx),
             lever_y = static_cast<float>(m.hy);
  const auto per_x = static_cast<float>(1 / step_m.x), per_y = static_cast<float>(1 / step_m.y);
  FloatLanes noise{}, bend_x{}, bend_y{}, bend_xy{};
  for (std::size_t i = 0; i < padded_; i += lanes) {
    const FloatLanes x = load(&x_m_[i]), y = load(&y_m_[i]), u = x * per_x, v = y * per_y;
    const FloatLanes lever = load(&weight_[i]) * (lever_h + lever_x * x + lever_y * y);
    noise += lever * lever * load(&variance_m2_[i]);
    bend_x += lever * cell_bend(u);
    bend_y += lever * cell_bend(v);
    bend_xy += lever * u * v;
    store(lever, &size_[i]);
  }
  found.noise_m2 = double{total(noise)};
  found.bend_x = double{total(bend_x)};
  found.bend_y = double{total(bend_y)};
  found.bend_xy = double{total(bend_xy)};
  bias_sum_m_.assign(names_.size(), 0);
  for (std::size_t i = 0; i < count_; ++i) bias_sum_m_[group_[i]] += double{size_[i] * bias_m_[i]};
  for (const double sum_m : bias_sum_m_) found.bias_m2 += sum_m * sum_m;
  return found;
}

CellHeight CellFit::finish(const SurfacePlane& plane, const Sums& sums,
                           const NeighbourSurface& neighbours, glm::dvec2 step_m) {
  CellHeight found{.plane = plane};
  const Levers by = levers(sums, neighbours, step_m);
  const Inverse& m = by.inverse;
  compare(plane, by.bias_m2, found);
  const double inside = found.lidar + found.stereo;
  const double known = m.xx * neighbours.information_xx + 2 * m.xy * neighbours.information_xy +
                       m.yy * neighbours.information_yy;
  const double freedom = inside - 3 + known;
  found.chi2 =
      inside > 1 && freedom > 0.1 ? found.chi2 / freedom : std::numeric_limits<double>::quiet_NaN();
  const double lent_m2 = m.hx * m.hx * neighbours.information_xx +
                         2 * m.hx * m.hy * neighbours.information_xy +
                         m.hy * m.hy * neighbours.information_yy;
  const SurfaceBend& bend = neighbours.bend_variance;
  const double bend_m2 = by.bend_x * by.bend_x * bend.xx + by.bend_y * by.bend_y * bend.yy +
                         by.bend_xy * by.bend_xy * bend.xy;
  // The crest was added to the height: the same noise once more, but not what groups have in
  // common, which neighbours have too.
  const double again = 1 + 2 * own_crest_ * neighbours.crest_share * (by.bend_x + by.bend_y);
  const double misfit = found.chi2 > 1 ? found.chi2 : 1.0;
  found.variance_m2 = again * again * by.noise_m2 * misfit + by.bias_m2 + lent_m2 + bend_m2;
  return found;
}

}  // namespace groundray
