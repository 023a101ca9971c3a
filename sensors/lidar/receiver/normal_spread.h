#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/math.h"

namespace groundray {

/// Returns the standard deviation of a normal number of mean 0 and standard deviation `deviation`
/// after clamping to [lowest, highest]; all in the same unit.
inline double clamped_normal_deviation(double deviation, double lowest, double highest) noexcept {
  constexpr double unmet_sigmas = 8;     // an end this far away has no effect: 1e-15
  constexpr double widest_spread = 1e4;  // in interval lengths: beyond it only the two ends matter
  const auto density = [](double z) {
    return math::exp(-0.5 * z * z) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
  };
  const auto share_below = [](double z) { return 0.5 * math::erfc(-z / std::numbers::sqrt2); };
  if (!(highest > lowest)) return 0;
  if (-lowest >= unmet_sigmas * deviation && highest >= unmet_sigmas * deviation) return deviation;
  const double sigma = std::min(deviation, widest_spread * (highest - lowest));
  const double low = lowest / sigma, high = highest / sigma;
  const double below = share_below(low), above = share_below(-high);
  const double mean = low * below + high * above + density(low) - density(high);
  const double square = low * low * below + high * high * above + (1 - below - above) +
                        low * density(low) - high * density(high);
  return sigma * std::sqrt(std::max(square - mean * mean, 0.0));
}

/// Node of a symmetric quadrature rule: its position on one side of 0, and its weight. The mirrored
/// node has the same weight.
struct QuadratureNode {
  double position = 0, weight = 0;
};
/// Gauss-Legendre rule of 16 points: Abramowitz and Stegun, Handbook of Mathematical Functions
/// (1964), table 25.4.
inline constexpr std::array legendre_16{QuadratureNode{0.095012509837637440, 0.189450610455068496},
                                        QuadratureNode{0.281603550779258913, 0.182603415044923589},
                                        QuadratureNode{0.458016777657227386, 0.169156519395002538},
                                        QuadratureNode{0.617876244402643748, 0.149595988816576732},
                                        QuadratureNode{0.755404408355003034, 0.124628971255533872},
                                        QuadratureNode{0.865631202387831744, 0.095158511682492785},
                                        QuadratureNode{0.944575023073232576, 0.062253523938647893},
                                        QuadratureNode{0.989400934991649933, 0.027152459411754095}};
/// Rule of 5 points for means over the standard normal distribution. The point at 0 has the rest of
/// the weight; positions sqrt(5 -+ sqrt(10)), weights (7 +- 2 sqrt(10)) / 60 (table 25.10).
inline constexpr std::array hermite_5{QuadratureNode{1.355626179974266, 0.2220759220056126},
                                      QuadratureNode{2.856970013872806, 0.01125741132772069}};

/// Returns the standard deviation of value(z) over those standard normal numbers z that exceed
/// `least`, by quadrature. The relative error is 1e-3 for a smooth `value`, and 2 % for one with
/// the singularity of a square root near `least`.
template <typename Value>
double deviation_above(double least, const Value& value) noexcept {
  constexpr double reach = 5;  // the density falls by exp(-reach^2 / 2)
  const bool is_whole = least <= -reach;
  const double low = std::max(least, -reach);
  const double high = math::hypot(std::max(low, 0.0), reach);
  const double middle = is_whole ? 0 : 0.5 * (low + high), half = 0.5 * (high - low);
  const double origin = value(middle);  // so that only differences are squared
  double weights = 0, sum = 0, squares = 0;
  const auto add = [&](double z, double weight) {
    const double offset = value(z) - origin;
    weights += weight;
    sum += weight * offset;
    squares += weight * offset * offset;
  };
  if (is_whole) {
    for (const QuadratureNode& node : hermite_5) {
      for (const double z : {-node.position, node.position}) add(z, node.weight);
    }
    weights = 1;
  } else {
    for (const QuadratureNode& node : legendre_16) {
      for (const double z : {middle - half * node.position, middle + half * node.position})
        add(z, node.weight * math::exp(0.5 * (middle * middle - z * z)));
    }
  }
  const double mean = sum / weights;
  return std::sqrt(std::max(squares / weights - mean * mean, 0.0));
}

}  // namespace groundray
