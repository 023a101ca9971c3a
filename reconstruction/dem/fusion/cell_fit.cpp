#include "reconstruction/dem/fusion/cell_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruction/dem/fusion/bent_plane.h"
#include "reconstruction/dem/fusion/float_lanes.h"

namespace groundray {
namespace {

constexpr int huber_rounds = 3, tukey_rounds = 5;
constexpr float huber_limit = 1.345F, tukey_limit = 4.685F;  // 95 % efficiency for normal errors

// Number of points with which half of a first guess's height above the neighbours is attributed to
// the crest of the cell, and half to the positions of the points.
constexpr double crest_points = 4;

// Approximate interval over which the heights of outliers are spread.
constexpr double outliers_reach_m = 2;
constexpr std::size_t few_points = 2;

}  // namespace

struct CellFit::Sums {
  struct Inverse {
    double hh = 0, hx = 0, hy = 0, xx = 0, xy = 0, yy = 0;
  };

  double w = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, yy = 0, xz = 0, yz = 0;

  // Returns the inverse of the normal equations' matrix, including the information on slopes.
  Inverse inverse(const NeighbourSurface& known) const noexcept {
    // The height is eliminated first. The information on slopes makes the remaining matrix
    // positive.
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

// Returns the k-th smallest value of points_.size, from k = 0.
float CellFit::kth_size(std::size_t k) {
  if (points_.count <= few_numbers) return kth_of_few(points_.size.data(), points_.count, k);
  const auto begin = points_.size.begin(), at = begin + static_cast<std::ptrdiff_t>(k);
  std::nth_element(begin, at, begin + static_cast<std::ptrdiff_t>(points_.count));
  return *at;
}

// Returns the height at the sample of the plane with given slopes through the median height of the
// points, which ascend.
double CellFit::median_height(const SurfacePlane& slopes) {
  FloatLanes x{}, y{};
  for (std::size_t i = 0; i < points_.padded; i += lanes) {
    x += load(&points_.x_m[i]);
    y += load(&points_.y_m[i]);
  }
  const double middle =
      0.5 * (double{points_.z_m[(points_.count - 1) / 2]} + double{points_.z_m[points_.count / 2]});
  return middle - (slopes.slope_x * double{total(x)} + slopes.slope_y * double{total(y)}) /
                      static_cast<double>(points_.count);
}

// Returns the factor by which residuals exceed their standard deviations, at least 1.
double CellFit::scale(const SurfacePlane& plane) {
  const auto h = static_cast<float>(plane.height_m), a = static_cast<float>(plane.slope_x),
             b = static_cast<float>(plane.slope_y);
  constexpr float to_sd = 1.4826F;  // from the median absolute value of normal errors
  for (std::size_t i = 0; i < points_.padded; i += lanes) {
    const FloatLanes off =
        load(&points_.z_m[i]) - h - a * load(&points_.x_m[i]) - b * load(&points_.y_m[i]);
    store(size_of(off) * load(&points_.per_sd[i]) * to_sd, &points_.size[i]);
  }
  std::fill(points_.size.data() + points_.count, points_.size.data() + points_.padded,
            std::numeric_limits<float>::infinity());
  IntLanes small{};
  for (std::size_t i = 0; i < points_.padded; i += lanes) small -= load(&points_.size[i]) <= 1.F;
  std::size_t within = 0;
  for (std::size_t i = 0; i < lanes; ++i) within += static_cast<std::size_t>(small[i]);
  return within > points_.count / 2 ? 1 : std::max(1.0, double{kth_size(points_.count / 2)});
}

template <typename Robust>
CellFit::Sums CellFit::sum(const SurfacePlane& plane, double scale, const Robust& robust) {
  const auto h = static_cast<float>(plane.height_m), a = static_cast<float>(plane.slope_x),
             b = static_cast<float>(plane.slope_y), per_scale = static_cast<float>(1 / scale);
  const float per_variance = per_scale * per_scale;
  FloatLanes w{}, x{}, y{}, z{}, xx{}, xy{}, yy{}, xz{}, yz{};
  for (std::size_t i = 0; i < points_.padded; i += lanes) {
    const FloatLanes at_x = load(&points_.x_m[i]), at_y = load(&points_.y_m[i]),
                     at_z = load(&points_.z_m[i]);
    const FloatLanes off = at_z - h - a * at_x - b * at_y;
    const FloatLanes weight = load(&points_.gain[i]) * per_variance *
                              robust(size_of(off) * load(&points_.per_sd[i]) * per_scale);
    store(weight, &points_.weight[i]);
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

// Improves `plane` until it converges, in at most `rounds` rounds; returns the last sums.
template <typename Robust>
CellFit::Sums CellFit::iterate(SurfacePlane& plane, const NeighbourSurface& neighbours,
                               double scale, int rounds, const Robust& robust) {
  constexpr double little = 5e-3;  // change in standard deviations
  Sums sums;
  for (int round = 0; round < rounds; ++round) {
    sums = sum(plane, scale, robust);
    if (!(sums.w > 0)) break;  // never true: at least half of the points are near the plane
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
  points_.unpack(points, step_m, reference);
  const auto n = static_cast<double>(points_.count);
  const bool is_weighed = outliers_per_m_ > 0 && points_.count <= few_points;
  own_crest_ = is_weighed ? 0 : n / (n + crest_points);  // fit_few accounts for the crest
  const double crest_m = own_crest_ * neighbours.crest_m;
  const SurfaceBend& bend = neighbours.bend;
  points_.unbend({bend.xx - 2 * crest_m, bend.xy, bend.yy - 2 * crest_m}, step_m);
  SurfacePlane plane = neighbours.plane;
  points_.weigh(plane, {neighbours.xx, neighbours.xy, neighbours.yy});
  if (is_weighed && neighbours.cells >= enough_neighbours)
    return fit_few_points(neighbours, step_m, reference * PackedPoint::height_step_m);
  plane.height_m = median_height(plane);
  const Sums::Inverse found =
      iterate(plane, neighbours, scale(plane), huber_rounds, [](const FloatLanes& size) {
        return huber_limit / larger(size, all_of(huber_limit));
      }).inverse(neighbours);
  if (points_.is_leaning || std::abs(rise2(plane) - rise2(neighbours.plane)) > 0.01)
    points_.weigh(plane, {found.xx, found.xy, found.yy});
  const double times = scale(plane);
  const auto tukey = [](const FloatLanes& size) {
    constexpr float per_limit2 = 1 / (tukey_limit * tukey_limit);
    const FloatLanes inside = larger(FloatLanes{}, 1 - size * size * per_limit2);
    return inside * inside;
  };
  iterate(plane, neighbours, times, tukey_rounds, tukey);
  sum(plane, times, tukey);
  return finish(plane, neighbours, step_m);
}

std::optional<CellHeight> CellFit::fit_few_points(const NeighbourSurface& neighbours,
                                                  glm::dvec2 step_m, double reference_m) const {
  const SurfacePlane& plane = neighbours.plane;
  const double base_m = plane.height_m - reference_m;
  std::array<SparseCell, few_points> few;
  for (std::size_t i = 0; i < points_.count; ++i) {
    const glm::dvec2 place_m(points_.x_m[i], points_.y_m[i]);
    // Position errors in plan act on heights by the slope; its uncertainty adds to the variance.
    const double slope_m2 = double{points_.across_m2[i]} * (neighbours.xx + neighbours.yy);
    few[i] = {
        place_m,
        double{points_.z_m[i]} - base_m - plane.slope_x * place_m.x - plane.slope_y * place_m.y,
        double{points_.variance_m2[i]} + slope_m2, points_.bias_m[i],
        points_.names[points_.group_of[i]]};
  }
  const FewHeight got =
      fit_few(few, static_cast<int>(points_.count), neighbours, step_m, outliers_per_m_);
  if (got.is_none > 0.5) return std::nullopt;
  CellHeight found{.plane = plane,
                   .variance_m2 = got.variance_m2,
                   .chi2 = std::numeric_limits<double>::quiet_NaN()};
  found.plane.height_m = base_m + got.above_m;
  const bool is_first = got.is_ground[0] >= got.is_ground[1];
  for (std::size_t i = 0; i < points_.count; ++i) {
    if (got.is_ground[i] < 0.5 && is_first != (i == 0)) continue;  // likelier one counts
    ++((points_.names[points_.group_of[i]] & 1U) == 0 ? found.lidar : found.stereo);
  }
  return found;
}

// Counts the points with weight, and sets chi2 to the sum of their squared residuals, each divided
// by its expected value.
void CellFit::compare(const SurfacePlane& plane, double bias_m2, CellHeight& found) {
  const auto shared_m2 = static_cast<float>(bias_m2);
  std::uint32_t stereo = 0, all = 0;
  for (std::size_t i = 0; i < points_.count; ++i) {
    // The estimate contains a group's bias in proportion to the group's weight, so that part of it
    // cancels in the residual.
    const std::uint32_t group = points_.group_of[i];
    const float bias = points_.bias_m[i];
    points_.size[i] =
        std::max(0.F, bias * bias - 2 * bias * static_cast<float>(bias_sum_m_[group]) + shared_m2);
    const std::uint32_t counts = points_.weight[i] > 0 ? 1 : 0;
    all += counts;
    stereo += counts & points_.names[group];
  }
  found.stereo = stereo;
  found.lidar = all - stereo;
  const auto h = static_cast<float>(plane.height_m), a = static_cast<float>(plane.slope_x),
             b = static_cast<float>(plane.slope_y);
  FloatLanes chi2{};
  for (std::size_t i = 0; i < points_.padded; i += lanes) {
    const FloatLanes off =
        load(&points_.z_m[i]) - h - a * load(&points_.x_m[i]) - b * load(&points_.y_m[i]);
    const FloatLanes term = off * off / (load(&points_.variance_m2[i]) + load(&points_.size[i]));
    chi2 += load(&points_.weight[i]) > 0 ? term : FloatLanes{};
  }
  found.chi2 = double{total(chi2)};
}

// Sensitivities of the height at the sample; points_.size is its derivative by the height of each
// point.
struct CellFit::Levers {
  double noise_m2 = 0, bias_m2 = 0;
  double bend_x = 0, bend_y = 0, bend_xy = 0;  // by second differences of the ground
};

// `per_term`: covariances of the height with the terms of the bent plane.
CellFit::Levers CellFit::levers(const QuadricTerms& per_term, glm::dvec2 step_m) {
  Levers found;
  const glm::vec2 cells_per_m(1.0 / step_m);
  std::array<float, 6> m;
  for (std::size_t k = 0; k < m.size(); ++k) m[k] = static_cast<float>(per_term[k]);
  FloatLanes noise{}, bend_x{}, bend_y{}, bend_xy{};
  for (std::size_t i = 0; i < points_.padded; i += lanes) {
    const std::array<FloatLanes, 6> by = bent_plane_functions(points_, i, cells_per_m);
    FloatLanes lever = m[0] * by[0];
    for (std::size_t k = 1; k < by.size(); ++k) lever += m[k] * by[k];
    lever *= load(&points_.weight[i]);
    noise += lever * lever * load(&points_.variance_m2[i]);
    bend_x += lever * by[3];
    bend_xy += lever * by[4];
    bend_y += lever * by[5];
    store(lever, &points_.size[i]);
  }
  found.noise_m2 = double{total(noise)};
  found.bend_x = double{total(bend_x)};
  found.bend_y = double{total(bend_y)};
  found.bend_xy = double{total(bend_xy)};
  bias_sum_m_.assign(points_.names.size(), 0);
  for (std::size_t i = 0; i < points_.count; ++i)
    bias_sum_m_[points_.group_of[i]] += double{points_.size[i] * points_.bias_m[i]};
  for (const double sum_m : bias_sum_m_) found.bias_m2 += sum_m * sum_m;
  return found;
}

CellHeight CellFit::finish(const SurfacePlane& plane, const NeighbourSurface& neighbours,
                           glm::dvec2 step_m) {
  const SurfaceBend& bend = neighbours.bend_variance;
  const bool is_dense = has_points_throughout(points_, step_m);
  const BentPlane bent =
      fit_bent_plane(points_, plane, neighbours, is_dense ? bend : SurfaceBend{}, step_m);
  const QuadricTerms& t = bent.terms;
  points_.unbend({t[3], t[4], t[5]}, step_m);
  CellHeight found{.plane = {plane.height_m + t[0], plane.slope_x + t[1] / step_m.x,
                             plane.slope_y + t[2] / step_m.y}};
  const QuadricTerms& m = bent.covariance[0];
  const Levers by = levers(m, step_m);
  compare(found.plane, by.bias_m2, found);
  const double inside = found.lidar + found.stereo, freedom = inside - bent.fitted;
  found.chi2 =
      inside > 1 && freedom > 0.1 ? found.chi2 / freedom : std::numeric_limits<double>::quiet_NaN();
  const double lean_x = m[1] / step_m.x, lean_y = m[2] / step_m.y;
  const double lent_m2 = lean_x * lean_x * neighbours.information_xx +
                         2 * lean_x * lean_y * neighbours.information_xy +
                         lean_y * lean_y * neighbours.information_yy;
  const double bend_m2 = by.bend_x * by.bend_x * bend.xx + by.bend_y * by.bend_y * bend.yy +
                         by.bend_xy * by.bend_xy * bend.xy;
  // Without points throughout the cell only the neighbours show how far the ground is off a plane.
  const double ground_m2 =
      is_dense ? scatter_m2(points_, found.plane, bent.fitted, neighbours.within_m2, step_m)
               : neighbours.within_m2;
  // The correction by the crest adds the points' noise a second time, but not the bias of groups,
  // which the neighbours share.
  const double again = 1 + 2 * own_crest_ * neighbours.crest_share * (by.bend_x + by.bend_y);
  // The ground about the plane is part of the misfit, too: on the safe side, but of the noise of
  // many points hardly anything is left to be multiplied.
  const double misfit = found.chi2 > 1 ? found.chi2 : 1.0;
  found.variance_m2 =
      again * again * by.noise_m2 * misfit + by.bias_m2 + lent_m2 + bend_m2 + ground_m2;
  return found;
}

}  // namespace groundray
