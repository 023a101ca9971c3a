#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <numbers>
#include <vector>

#include "reconstruction/scan/organised_scan.h"

namespace groundray::testing {

constexpr double degree = std::numbers::pi / 180;

/// Beams of a spinning head, one elevation a ring.
struct BeamFan {
  int rings = 16;
  double lowest_rad = -15 * degree, highest_rad = 15 * degree;
  int columns = 360;                    ///< pulses of a ring
  double columns_per_turn = 360;        ///< may be no whole number
  double first_azimuth_rad = 0;         ///< of column 0
  std::vector<double> aside_columns{};  ///< of each ring: how far it looks aside
  int direction = 1;                    ///< -1: clockwise

  double elevation_rad(int ring) const {
    return rings < 2 ? lowest_rad : lowest_rad + (highest_rad - lowest_rad) * ring / (rings - 1);
  }
  double azimuth_rad(int ring, int column) const {
    const double aside = aside_columns.empty() ? 0 : aside_columns[static_cast<std::size_t>(ring)];
    return first_azimuth_rad +
           direction * 2 * std::numbers::pi * (column + aside) / columns_per_turn;
  }
  glm::dvec3 towards(int ring, int column) const {
    const double e = elevation_rad(ring), a = azimuth_rad(ring, column);
    return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
  }
};

/// The range along a unit direction from S's origin; infinite for nothing.
using RangeOf = std::function<double(const glm::dvec3& towards)>;

/// Returns what a fan sees, a row for each beam, ring after ring.
inline ScanReturns seen(const BeamFan& fan, const RangeOf& range_m) {
  ScanReturns returns;
  for (int ring = 0; ring < fan.rings; ++ring) {
    for (int column = 0; column < fan.columns; ++column) {
      const glm::dvec3 towards = fan.towards(ring, column);
      const double r = range_m(towards);
      returns.p_S.push_back(
          std::isfinite(r) ? r * towards : glm::dvec3(std::numeric_limits<double>::quiet_NaN()));
      returns.rings.push_back(ring);
      returns.columns.push_back(column);
    }
  }
  return returns;
}

/// The range of the plane normal . p = offset_m; infinite behind and along it.
inline RangeOf plane_at(const glm::dvec3& normal, double offset_m) {
  return [=](const glm::dvec3& towards) {
    const double r = offset_m / glm::dot(normal, towards);
    return r > 0 ? r : std::numeric_limits<double>::infinity();
  };
}

/// The nearer of two.
inline RangeOf nearer(const RangeOf& a, const RangeOf& b) {
  return [=](const glm::dvec3& towards) { return std::min(a(towards), b(towards)); };
}

/// Returns the rows of `returns` that `keep` says, by their number.
template <typename Keep>
ScanReturns kept(const ScanReturns& returns, const Keep& keep) {
  ScanReturns out;
  const auto copy = [&](const auto& from, auto& to) {
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (keep(i)) to.push_back(from[i]);
    }
  };
  copy(returns.p_S, out.p_S);
  copy(returns.origins_m, out.origins_m);
  copy(returns.rings, out.rings);
  copy(returns.columns, out.columns);
  copy(returns.times_s, out.times_s);
  copy(returns.intensity, out.intensity);
  copy(returns.sd_m, out.sd_m);
  copy(returns.labels, out.labels);
  return out;
}

}  // namespace groundray::testing
