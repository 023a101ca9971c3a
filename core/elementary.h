#pragma once

// Elementary functions of packs of numbers, which make no calls, and of + - * / and square roots
// alone (and floor, which is exact), so that all machines compute the same bits. core/math.h has
// functions of single numbers: a sine and a cosine take 11.7 ns in the C library, on_circle 3 ns in
// a pack.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/pack.h"

namespace groundray {

/// Returns the point of the unit circle at a fraction of a turn: (cos, sin) of 2 pi `turn`, to
/// 2.3e-16.
/// @param turn  -1/8 to 1.
template <typename Real>
Vec2<Real> on_circle(const Real& turn) noexcept {
  using std::floor;
  // Taylor series about the nearest multiple of a quarter turn, whose difference is exact.
  const Real quarter = floor(turn * 4.0 + 0.5);
  const Real x = (turn * 4.0 - quarter) * (std::numbers::pi / 2), xx = x * x;
  Real sine = xx * (-1.0 / 1307674368000) + 1.0 / 6227020800;
  sine = sine * xx - 1.0 / 39916800;
  sine = sine * xx + 1.0 / 362880;
  sine = sine * xx - 1.0 / 5040;
  sine = sine * xx + 1.0 / 120;
  sine = sine * xx - 1.0 / 6;
  sine = x + x * xx * sine;
  Real cosine = xx * (1.0 / 20922789888000) - 1.0 / 87178291200;
  cosine = cosine * xx + 1.0 / 479001600;
  cosine = cosine * xx - 1.0 / 3628800;
  cosine = cosine * xx + 1.0 / 40320;
  cosine = cosine * xx - 1.0 / 720;
  cosine = cosine * xx + 1.0 / 24;
  cosine = cosine * xx - 1.0 / 2;
  cosine = cosine * xx + 1.0;
  const auto is_odd = quarter == 1.0 || quarter == 3.0;
  const Real along = select(is_odd, sine, cosine), up = select(is_odd, cosine, sine);
  return {select(quarter == 1.0 || quarter == 2.0, -along, along),
          select(quarter == 2.0 || quarter == 3.0, -up, up)};
}

/// Returns the angle in [0, pi / 2] of a cosine in [0, 1], rad, to 3e-16.
template <typename Real>
Real angle_of_cosine(const Real& cosine) noexcept {
  using std::sqrt;
  const auto is_small = cosine > 0.5;  // then by the sine of half the angle
  const Real zz = select(is_small, (1.0 - cosine) * 0.5, cosine * cosine);
  const Real z = select(is_small, sqrt(zz), cosine);
  // asin(z) / z in powers of z^2 from 0 to 1/4: interpolated at 13 Chebyshev nodes, to 2e-17.
  Real series = zz * 0.031879621400812845 - 0.016187392271599137;
  series = series * zz + 0.019513468251252171;
  series = series * zz + 0.0065293020047365678;
  series = series * zz + 0.012170138592391726;
  series = series * zz + 0.01388484282640208;
  series = series * zz + 0.017359779641349979;
  series = series * zz + 0.022371749733164054;
  series = series * zz + 0.030381959697685139;
  series = series * zz + 0.044642856805998936;
  series = series * zz + 0.075000000003852013;
  series = series * zz + 0.16666666666664942;
  const Real arc = z + z * (series * zz);
  return select(is_small, 2.0 * arc, std::numbers::pi / 2 - arc);
}

/// Returns the angle in [0, pi / 2] of a sine and a cosine, or of multiples of them, neither
/// negative, rad, to 3e-16 of itself; NaN if both are 0.
template <typename Real>
Real angle_of(const Real& sine, const Real& cosine) noexcept {
  using std::max;
  using std::min;
  const Real less = min(sine, cosine), more = max(sine, cosine);
  const auto turns = less > (std::numbers::sqrt2 - 1) * more;  // by pi / 4, so that x is small
  const Real x = select(turns, less - more, less) / select(turns, less + more, more);
  // atan(x) / x in powers of x^2 from 0 to tan^2(pi / 8): interpolated at 12 Chebyshev nodes, to
  // 1e-18.
  const Real xx = x * x;
  Real series = xx * -0.017805397205419446 + 0.037965257453865933;
  series = series * xx - 0.05035102456601552;
  series = series * xx + 0.058468782973308722;
  series = series * xx - 0.066629518136291907;
  series = series * xx + 0.076920453309022252;
  series = series * xx - 0.090908968090640266;
  series = series * xx + 0.11111110744919658;
  series = series * xx - 0.14285714279250245;
  series = series * xx + 0.19999999999940893;
  series = series * xx - 0.33333333333333121;
  const Real turned = x + x * (series * xx);
  const Real angle = select(turns, std::numbers::pi / 4 + turned, turned);
  return select(sine > cosine, std::numbers::pi / 2 - angle, angle);
}

}  // namespace groundray
