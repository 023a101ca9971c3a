#include "reconstruction/dem/neighbour_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "reconstruction/dem/float_lanes.h"
#include "reconstruction/dem/order_statistic.h"

namespace groundray {
namespace {

constexpr int reach = 2;
constexpr std::size_t across = 5;
constexpr std::size_t window = across * across;
constexpr std::size_t padded = 32;  // a whole number of vectors

// How much of the scatter about the plane, which is that of cells 1 and 2 apart, is to be expected
// of the cell's own slope times a cell's breadth. By trial on rolling ground.
constexpr double slope_share = 0.3;

using Few = std::array<float, padded>;

// Cells of the window, row by row; those without ground, and beyond the window, weigh nothing.
struct Neighbours {
  int count = 0;
  Few is_there{}, x{}, y{}, z{}, variance{}, residual{}, weight{};
};

// Heights are above base_m, which becomes the first one.
Neighbours gather(const GroundGuess* guess, std::ptrdiff_t stride, glm::dvec2 step_m,
                  double& base_m) noexcept {
  Neighbours near;
  const auto step_x = static_cast<float>(step_m.x), step_y = static_cast<float>(step_m.y);
  std::size_t i = 0;
  for (int row = -reach; row <= reach; ++row) {
    for (int column = -reach; column <= reach; ++column, ++i) {
      const GroundGuess& one = guess[row * stride + column];
      near.variance[i] = 1;
      if ((row == 0 && column == 0) || std::isnan(one.height_m)) continue;
      if (near.count++ == 0) base_m = one.height_m;
      near.is_there[i] = 1;
      near.x[i] = static_cast<float>(column) * step_x + one.x_m;
      near.y[i] = static_cast<float>(row) * step_y + one.y_m;
      near.z[i] = static_cast<float>(one.height_m - base_m);
      near.variance[i] = one.variance_m2;
    }
  }
  std::fill(near.variance.begin() + window, near.variance.end(), 1.F);
  return near;
}

double middle(Few& values, std::size_t count) noexcept {
  return double{kth_of_few(values.data(), count, count / 2)};
}

// The median slope between cells two or four apart along columns or rows; 0 if there are but few.
double median_slope(const Neighbours& near, const Few& place, std::size_t along,
                    std::size_t beside) noexcept {
  constexpr std::array<std::array<std::size_t, 2>, 4> pairs{{{0, 2}, {1, 3}, {2, 4}, {0, 4}}};
  Few slopes;
  std::size_t count = 0;
  for (std::size_t line = 0; line < across; ++line) {
    for (const auto& pair : pairs) {
      const std::size_t i = line * beside + pair[0] * along, j = line * beside + pair[1] * along;
      slopes[count] = (near.z[j] - near.z[i]) / (place[j] - place[i]);
      count += near.is_there[i] * near.is_there[j] > 0 ? 1 : 0;
    }
  }
  return count < 3 ? 0 : middle(slopes, count);
}

struct Sums {
  double w = 0, x = 0, y = 0, z = 0;
  double xx = 0, xy = 0, yy = 0, xz = 0, yz = 0;
};

Sums sum(const Neighbours& near) noexcept {
  FloatLanes w{}, x{}, y{}, z{}, xx{}, xy{}, yy{}, xz{}, yz{};
  for (std::size_t i = 0; i < padded; i += lanes) {
    const FloatLanes at_x = load(&near.x[i]), at_y = load(&near.y[i]), at_z = load(&near.z[i]);
    const FloatLanes weight = load(&near.weight[i]), wx = weight * at_x, wy = weight * at_y;
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

// Sets `plane` to the fit of least weighted squares; slopes are held towards 0 by `hold`. Returns
// the sums about the weighted mean.
Sums fit(const Neighbours& near, double hold, SurfacePlane& plane) noexcept {
  Sums s = sum(near);
  s.x /= s.w;
  s.y /= s.w;
  s.z /= s.w;
  s.xx = std::max(0.0, s.xx - s.w * s.x * s.x);
  s.xy -= s.w * s.x * s.y;
  s.yy = std::max(0.0, s.yy - s.w * s.y * s.y);
  s.xz -= s.w * s.x * s.z;
  s.yz -= s.w * s.y * s.z;
  const double xx = s.xx + hold, yy = s.yy + hold;
  const double inverse = 1 / (xx * yy - s.xy * s.xy);
  plane.slope_x = (yy * s.xz - s.xy * s.yz) * inverse;
  plane.slope_y = (xx * s.yz - s.xy * s.xz) * inverse;
  plane.height_m = s.z - plane.slope_x * s.x - plane.slope_y * s.y;
  return s;
}

void set_residuals(Neighbours& near, const SurfacePlane& plane) noexcept {
  const auto h = static_cast<float>(plane.height_m), a = static_cast<float>(plane.slope_x),
             b = static_cast<float>(plane.slope_y);
  for (std::size_t i = 0; i < padded; i += lanes)
    store(load(&near.z[i]) - h - a * load(&near.x[i]) - b * load(&near.y[i]), &near.residual[i]);
}

void set_weights(Neighbours& near, double excess_m2) noexcept {
  constexpr float cauchy = 1 / (2.385F * 2.385F);
  const auto excess = static_cast<float>(excess_m2);
  for (std::size_t i = 0; i < padded; i += lanes) {
    const FloatLanes off = load(&near.residual[i]);
    const FloatLanes variance = load(&near.variance[i]) + excess;
    store(load(&near.is_there[i]) / (variance + cauchy * off * off), &near.weight[i]);
  }
}

double mean_variance(const Neighbours& near) noexcept {
  FloatLanes sum{};
  for (std::size_t i = 0; i < padded; i += lanes)
    sum += load(&near.is_there[i]) * load(&near.variance[i]);
  return double{total(sum)} / near.count;
}

// The residuals of the cells that there are.
std::size_t residuals(const Neighbours& near, Few& found) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < window; ++i) {
    found[count] = near.residual[i];
    count += near.is_there[i] > 0 ? 1 : 0;
  }
  return count;
}

// The variance about the plane that the cells' own does not explain: by the median, which a few
// wrong cells do not move.
double excess_variance(const Neighbours& near, double mean_variance_m2) noexcept {
  Few sizes;
  const std::size_t count = residuals(near, sizes);
  for (float& size : sizes) size = std::abs(size);
  const double sd = 1.4826 * middle(sizes, count);
  return std::max(0.0, sd * sd - mean_variance_m2);
}

void start(Neighbours& near, SurfacePlane& plane) noexcept {
  plane = {0, median_slope(near, near.x, 1, across), median_slope(near, near.y, across, 1)};
  set_residuals(near, plane);
  Few found;
  const std::size_t count = residuals(near, found);
  plane.height_m = middle(found, count);
  set_residuals(near, plane);
}

void set_slopes(NeighbourPlane& found, const Sums& sums, double hold, double spread) noexcept {
  const double xx = sums.xx + hold, yy = sums.yy + hold;
  const double inverse = 1 / (xx * yy - sums.xy * sums.xy);
  found.xx = yy * inverse + spread;
  found.xy = -sums.xy * inverse;
  found.yy = xx * inverse + spread;
  const double back = 1 / (found.xx * found.yy - found.xy * found.xy);
  found.information_xx = found.yy * back;
  found.information_xy = -found.xy * back;
  found.information_yy = found.xx * back;
}

}  // namespace

NeighbourPlane neighbour_plane(const GroundGuess* guess, std::ptrdiff_t stride, glm::dvec2 step_m,
                               double slope_sd) noexcept {
  NeighbourPlane found;
  double base_m = 0;
  Neighbours near = gather(guess, stride, step_m, base_m);
  found.cells = near.count;
  const double hold = 1 / (slope_sd * slope_sd);
  if (near.count == 0) {
    set_slopes(found, {}, hold, 0);
    return found;
  }
  const double noise = mean_variance(near);
  start(near, found.plane);
  const double at_start = excess_variance(near, noise);
  Sums sums;
  for (int round = 0; round < 3; ++round) {
    set_weights(near, at_start);
    sums = fit(near, hold, found.plane);
    set_residuals(near, found.plane);
  }
  const double excess = excess_variance(near, noise);
  found.plane.height_m += base_m;
  const double cell_m2 = std::abs(step_m.x * step_m.y);
  set_slopes(found, sums, hold, slope_share * slope_share * excess / cell_m2);
  found.scatter_m = std::sqrt(excess);
  found.height_variance_m2 = 1 / sums.w + sums.x * sums.x * found.xx +
                             2 * sums.x * sums.y * found.xy + sums.y * sums.y * found.yy + excess;
  return found;
}

}  // namespace groundray
