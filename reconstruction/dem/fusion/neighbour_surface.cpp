#include "reconstruction/dem/fusion/neighbour_surface.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "reconstruction/dem/fusion/float_lanes.h"

namespace groundray {
namespace {

constexpr int window_reach = 2;
constexpr std::size_t window_side = 5;
constexpr std::size_t window = window_side * window_side;

// Prior variance of second differences per variance of the scatter about a plane: a surface that
// bends by d scatters by 0.84 d about its plane.
constexpr double bend_share = 1.5;
// Variances by which a cell's second differences and slope deviate from those of the surface, per
// variance of its height. That of the slope across the cell is multiplied by the ratio of the sd
// about second-degree surfaces to that about planes: ground that the former fit well is smooth
// between samples, too. Found by trial on rolling ground, fractals, a real valley and triangles,
// with 1 to 100 points per cell.
constexpr double bend_rest = 1.15, slope_rest = 1.8;
// Likewise, the variance of the ground within a cell about a bent plane. Dense scans of rough
// ground (fractals, rolling ground in triangles of two cells) show 0.006 to 0.008 without their
// noise.
constexpr double within_rest = 0.0085;

// In fewer cells, the scatter about a plane is too uncertain: that about the first guess is used,
// which is often several times as large. It counts little where others are near; both numbers were
// found by trial with dense and sparse rings.
constexpr int cells_for_plane = 8;
constexpr double guess_share = 0.05;

// Cells of the window in row order. The centre, cells without ground and padding have no weight.
struct Neighbours {
  int count = 0;
  double base_m = 0;  // reference of heights
  QuadricPlaces places;
  QuadricColumn is_there{}, variance{}, place_m2{}, lean_x{}, lean_y{}, residual{};
};

Neighbours gather(const GroundGuess* guess, std::ptrdiff_t stride, glm::dvec2 step_m) noexcept {
  Neighbours near;
  const auto per_x = static_cast<float>(1 / step_m.x), per_y = static_cast<float>(1 / step_m.y);
  std::size_t i = 0;
  for (int row = -window_reach; row <= window_reach; ++row) {
    for (int column = -window_reach; column <= window_reach; ++column, ++i) {
      const GroundGuess& one = guess[row * stride + column];
      near.variance[i] = 1;
      if ((row == 0 && column == 0) || std::isnan(one.height_m)) continue;
      if (near.count++ == 0) near.base_m = one.height_m;
      near.is_there[i] = 1;
      near.places.u[i] = static_cast<float>(column) + one.x_m * per_x;
      near.places.v[i] = static_cast<float>(row) + one.y_m * per_y;
      near.places.z[i] = static_cast<float>(one.height_m - near.base_m);
      near.variance[i] = one.variance_m2;
      near.place_m2[i] = one.across_m2;
      near.lean_x[i] = one.lean_x;
      near.lean_y[i] = one.lean_y;
    }
  }
  std::fill(near.variance.begin() + window, near.variance.end(), 1.F);
  return near;
}

// Converts variances of heights to variances of distances from a slope, including position errors
// in plan.
void add_places(Neighbours& near, const QuadricTerms& t, glm::dvec2 step_m) noexcept {
  const double a = t[1] / step_m.x, b = t[2] / step_m.y;
  const auto rise2 = static_cast<float>(a * a + b * b);
  const auto slope_x = static_cast<float>(a), slope_y = static_cast<float>(b);
  for (std::size_t i = 0; i < quadric_places; i += lanes) {
    const FloatLanes x = load(&near.lean_x[i]), y = load(&near.lean_y[i]);
    const FloatLanes tilt = larger(1 - slope_x * x - slope_y * y, least_tilt(x, y));
    store(load(&near.variance[i]) * tilt * tilt + rise2 * load(&near.place_m2[i]),
          &near.variance[i]);
  }
}

double middle(QuadricColumn& values, std::size_t count) noexcept {
  return double{kth_of_few(values.data(), count, count / 2)};
}

// Returns the median slope between cells two or four apart along columns or rows; 0 for fewer than
// two pairs.
double median_slope(const Neighbours& near, const QuadricColumn& place, std::size_t along,
                    std::size_t beside) noexcept {
  constexpr std::array<std::array<std::size_t, 2>, 4> pairs{{{0, 2}, {1, 3}, {2, 4}, {0, 4}}};
  QuadricColumn slopes;
  std::size_t count = 0;
  for (std::size_t line = 0; line < window_side; ++line) {
    for (const auto& pair : pairs) {
      const std::size_t i = line * beside + pair[0] * along, j = line * beside + pair[1] * along;
      slopes[count] = (near.places.z[j] - near.places.z[i]) / (place[j] - place[i]);
      count += near.is_there[i] * near.is_there[j] > 0 ? 1 : 0;
    }
  }
  return count < 2 ? 0 : middle(slopes, count);
}

void set_weights(Neighbours& near, double excess_m2) noexcept {
  constexpr float cauchy = 1 / (2.385F * 2.385F);
  const auto excess = static_cast<float>(excess_m2);
  for (std::size_t i = 0; i < quadric_places; i += lanes) {
    const FloatLanes off = load(&near.residual[i]);
    const FloatLanes variance = load(&near.variance[i]) + excess;
    store(load(&near.is_there[i]) / (variance + cauchy * off * off), &near.places.weight[i]);
  }
}

double mean_variance(const Neighbours& near) noexcept {
  FloatLanes sum{};
  for (std::size_t i = 0; i < quadric_places; i += lanes)
    sum += load(&near.is_there[i]) * load(&near.variance[i]);
  return double{total(sum)} / near.count;
}

// Collects the residuals of the cells with ground; returns their number.
std::size_t residuals(const Neighbours& near, QuadricColumn& found) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < window; ++i) {
    found[count] = near.residual[i];
    count += near.is_there[i] > 0 ? 1 : 0;
  }
  return count;
}

// Variance of residuals in excess of noise, and the variance of that estimate.
struct Excess {
  double m2 = 0, m4 = 0;
};

// Estimates the excess as the mean of each squared residual minus the cell's noise. Cells with much
// noise have less weight, because they would otherwise dominate. Squares are limited to 4
// variances, as estimated from the median size, so that neither a few wrong cells nor the shape of
// the ground have much effect.
// @see Huber, Ronchetti, Robust statistics (2009), section 6.4: proposal 2
// @param freedom  degrees of freedom of the residuals: cells minus fitted terms.
Excess excess(const Neighbours& near, double noise_m2, double freedom) noexcept {
  constexpr float most = 4;
  constexpr float whole = 1 / 0.9205F;  // the limit leaves 0.92 of the variance of normal residuals
  QuadricColumn sizes;
  const std::size_t count = residuals(near, sizes);
  for (float& size : sizes) size = std::abs(size);
  const double sd = 1.4826 * middle(sizes, count), lost = near.count / freedom;
  const auto start = static_cast<float>(std::max(0.0, lost * sd * sd - noise_m2));
  const auto noise = static_cast<float>(noise_m2), times = static_cast<float>(lost);
  FloatLanes sum{}, all{}, spread{};
  for (std::size_t i = 0; i < quadric_places; i += lanes) {
    const FloatLanes off = load(&near.residual[i]), own = load(&near.variance[i]);
    const FloatLanes expected = own + start, square = smaller(times * off * off, most * expected);
    const FloatLanes root = noise * load(&near.is_there[i]) / (own + noise);
    // At most 1, so that squares of weights stay within the range of float.
    const FloatLanes weight = root * root;
    sum += weight * (whole * square - own);
    all += weight;
    spread += weight * weight * expected * expected;
  }
  const double per = 1 / double{total(all)};
  return {per * double{total(sum)}, 2 * lost * per * per * double{total(spread)}};
}

QuadricTerms start(Neighbours& near) noexcept {
  QuadricTerms plane{0, median_slope(near, near.places.u, 1, window_side),
                     median_slope(near, near.places.v, window_side, 1)};
  set_residuals(near.places, plane, near.residual);
  QuadricColumn found;
  const std::size_t count = residuals(near, found);
  plane[0] = middle(found, count);
  set_residuals(near.places, plane, near.residual);
  return plane;
}

// Subtracts a plane from the heights, so that the prior refers to the remainder.
void remove_plane(Neighbours& near, const QuadricTerms& plane) noexcept {
  set_residuals(near.places, {plane[0], plane[1], plane[2]}, near.places.z);
}

void add_plane(QuadricTerms& to, const QuadricTerms& plane) noexcept {
  for (std::size_t i = 0; i < 3; ++i) to[i] += plane[i];
}

// Returns the prior information on the terms.
QuadricTerms hold_of(glm::dvec2 step_m, double slope_sd, double plane_m2) noexcept {
  constexpr double least_m2 = 1e-12;
  const glm::dvec2 slope = slope_sd * step_m;
  const double bend = 1 / (bend_share * plane_m2 + least_m2);
  return {0, 1 / (slope.x * slope.x), 1 / (slope.y * slope.y), bend, 2 * bend, bend};
}

void set_slopes(NeighbourSurface& found, double xx, double xy, double yy) noexcept {
  found.xx = xx;
  found.xy = xy;
  found.yy = yy;
  const double back = 1 / (xx * yy - xy * xy);
  found.information_xx = yy * back;
  found.information_xy = -xy * back;
  found.information_yy = xx * back;
}

// Sets slopes. Position errors in plan flatten the fit if cells lie along a line, which makes the
// slopes less certain.
void set_slopes(NeighbourSurface& found, const Neighbours& near, const QuadricMatrix& covariance,
                glm::dvec2 step_m, double slope_sd, double spread_m2) noexcept {
  FloatLanes off{};
  for (std::size_t i = 0; i < quadric_places; i += lanes)
    off += load(&near.places.weight[i]) * load(&near.place_m2[i]);
  const double places = double{total(off)};
  const double x2 = step_m.x * step_m.x, y2 = step_m.y * step_m.y;
  const double cxx = covariance[1][1] / x2, cxy = covariance[1][2] / (step_m.x * step_m.y),
               cyy = covariance[2][2] / y2;
  // Fraction by which slopes are flattened.
  const double most = std::max(1.0, places * (cxx + cyy)), share = places / most * slope_sd;
  set_slopes(found, cxx + spread_m2 / x2 + share * share * (cxx * cxx + cxy * cxy),
             cxy + share * share * cxy * (cxx + cyy),
             cyy + spread_m2 / y2 + share * share * (cyy * cyy + cxy * cxy));
}

// Returns the group of more than half of the cells, by majority vote. Without a majority, the
// result is any group or none.
// @see Boyer, Moore, MJRTY: a fast majority vote algorithm (1991)
std::uint32_t most_common_group(const GroundGuess* guess, std::ptrdiff_t stride) noexcept {
  std::uint32_t group = no_group;
  int votes = 0;
  for (int row = -window_reach; row <= window_reach; ++row) {
    for (int column = -window_reach; column <= window_reach; ++column) {
      const GroundGuess& one = guess[row * stride + column];
      if ((row == 0 && column == 0) || std::isnan(one.height_m)) continue;
      if (votes == 0) group = one.group;
      votes += one.group == group ? 1 : -1;
    }
  }
  return votes > 0 ? group : no_group;
}

// Sets the bias by the group's fraction of the weight. The bias of a stereo pair lies along its
// lines of sight.
void set_bias(NeighbourSurface& found, const GroundGuess* guess, std::ptrdiff_t stride,
              const Neighbours& near) noexcept {
  found.group = most_common_group(guess, stride);
  if (found.group == no_group) return;
  const bool is_stereo = (found.group & 1U) != 0;
  double sum_m = 0, all = 0;
  std::size_t i = 0;
  for (int row = -window_reach; row <= window_reach; ++row) {
    for (int column = -window_reach; column <= window_reach; ++column, ++i) {
      const GroundGuess& one = guess[row * stride + column];
      const double weight = near.places.weight[i];
      all += weight;
      if (one.group != found.group) continue;
      const double along = found.plane.slope_x * one.lean_x + found.plane.slope_y * one.lean_y;
      sum_m += weight * one.bias_m * (is_stereo ? 1 - along : 1);
    }
  }
  found.bias_m = sum_m / all;
}

void set_crest(NeighbourSurface& found, const GroundGuess& own, const Neighbours& near,
               const QuadricTerms& t, double variance_m2, double rough_m2,
               glm::dvec2 step_m) noexcept {
  constexpr double farthest = 3;  // in sd; beyond, it is another surface or an outlier
  constexpr double believed = 0.8;
  if (std::isnan(own.height_m)) return;
  const double above_m =
      own.height_m - near.base_m - height_at(t, own.x_m / step_m.x, own.y_m / step_m.y);
  const double expected_m2 = rough_m2 + double{own.variance_m2} + variance_m2;
  if (above_m * above_m > farthest * farthest * expected_m2) return;
  found.crest_share = believed * rough_m2 / expected_m2;
  found.crest_m = found.crest_share * above_m;
}

}  // namespace

NeighbourSketch sketch_neighbours(const GroundGuess* guess, std::ptrdiff_t stride,
                                  glm::dvec2 step_m, double slope_sd) noexcept {
  NeighbourSketch found;
  Neighbours near = gather(guess, stride, step_m);
  found.cells = near.count;
  if (near.count == 0) return found;
  const QuadricTerms plane = start(near);
  add_places(near, plane, step_m);
  const double noise_m2 = mean_variance(near);
  double plane_m2 = std::max(0.0, excess(near, noise_m2, near.count).m2);
  set_weights(near, plane_m2);
  remove_plane(near, plane);
  QuadricFit fit;
  if (near.count >= cells_for_plane) {
    fit = fit_quadric(near.places, hold_of(step_m, slope_sd, 0));
    set_residuals(near.places, fit.terms, near.residual);
    plane_m2 = std::max(0.0, excess(near, noise_m2, near.count - 3).m2);
    set_weights(near, plane_m2);
  }
  const QuadricTerms hold = hold_of(step_m, slope_sd, plane_m2);
  fit = fit_quadric(near.places, hold);
  set_residuals(near.places, fit.terms, near.residual);
  add_plane(fit.terms, plane);
  const QuadricMatrix covariance = fit.covariance();
  double freedom = near.count - static_cast<double>(hold.size());
  for (std::size_t i = 0; i < hold.size(); ++i) {
    freedom += hold[i] * covariance[i][i];
    found.terms[i] = static_cast<float>(fit.terms[i]);
  }
  found.plane_m2 = static_cast<float>(plane_m2);
  found.plane_counts = static_cast<float>((near.count < cells_for_plane ? guess_share : 1) *
                                          std::max(0, near.count - 3));
  if (freedom < 1) return found;
  found.freedom = static_cast<float>(freedom);
  const Excess rough = excess(near, noise_m2, freedom);
  found.rough_m2 = static_cast<float>(rough.m2);
  found.rough_m4 = static_cast<float>(rough.m4);
  return found;
}

NeighbourSurface neighbour_surface(const GroundGuess* guess, std::ptrdiff_t stride,
                                   glm::dvec2 step_m, double slope_sd,
                                   const NeighbourSketch& sketch,
                                   const GroundScatter& scatter) noexcept {
  NeighbourSurface found;
  found.cells = sketch.cells;
  if (sketch.cells == 0) {
    set_slopes(found, slope_sd * slope_sd, 0, slope_sd * slope_sd);
    return found;
  }
  Neighbours near = gather(guess, stride, step_m);
  QuadricTerms sketched;
  std::copy(sketch.terms.begin(), sketch.terms.end(), sketched.begin());
  add_places(near, sketched, step_m);
  set_residuals(near.places, sketched, near.residual);
  const double rough_m2 = scatter.quadric_m2;
  set_weights(near, rough_m2);
  remove_plane(near, sketched);
  QuadricFit fit = fit_quadric(near.places, hold_of(step_m, slope_sd, scatter.plane_m2));
  add_plane(fit.terms, sketched);
  const QuadricTerms& t = fit.terms;
  const QuadricMatrix c = fit.covariance();
  found.plane = {t[0] + near.base_m, t[1] / step_m.x, t[2] / step_m.y};
  found.bend = {t[3], t[4], t[5]};
  found.height_variance_m2 = c[0][0] + rough_m2;
  found.height_x_m2 = c[0][1] / step_m.x;
  found.height_y_m2 = c[0][2] / step_m.y;
  const double falls = scatter.plane_m2 > rough_m2 ? std::sqrt(rough_m2 / scatter.plane_m2) : 1;
  set_slopes(found, near, c, step_m, slope_sd, slope_rest * falls * rough_m2);
  const double rest_m2 = bend_rest * rough_m2;
  found.bend_variance = {c[3][3] + rest_m2, c[4][4] + 0.5 * rest_m2, c[5][5] + rest_m2};
  found.within_m2 = within_rest * rough_m2;
  found.scatter_m = double{std::sqrt(std::max(0.F, sketch.rough_m2))};
  set_bias(found, guess, stride, near);
  set_crest(found, *guess, near, t, c[0][0], rough_m2, step_m);
  return found;
}

}  // namespace groundray
