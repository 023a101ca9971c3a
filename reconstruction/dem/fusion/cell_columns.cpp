#include "reconstruction/dem/fusion/cell_columns.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "reconstruction/dem/fusion/curvature_profile.h"
#include "reconstruction/dem/fusion/float_lanes.h"
#include "reconstruction/dem/fusion/order_statistic.h"

namespace groundray {
namespace {

constexpr float least_sd_m = 1e-4F;  // lower limit of a point's standard deviation

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

}  // namespace groundray
