#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <numbers>
#include <vector>

#include "reconstruction/mesh/scan/organised_scan.h"

namespace groundray::testing {

constexpr double degree = std::numbers::pi / 180;

/// Beams of a spinning head with one elevation per ring.
struct BeamFan {
  int rings = 16;
  double lowest_rad = -15 * degree, highest_rad = 15 * degree;
  int columns = 360;                    ///< pulses per ring
  double columns_per_turn = 360;        ///< may be fractional
  double first_azimuth_rad = 0;         ///< azimuth of column 0
  std::vector<double> aside_columns{};  ///< azimuth offset of each ring, columns; empty for none
  int direction = 1;                    ///< 1: counter-clockwise; -1: clockwise

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

/// Range along a unit direction from S's origin, m; infinite if there is no return.
using RangeOf = std::function<double(const glm::dvec3& towards)>;

/// Returns the measurements of a fan: one row per beam, ring after ring.
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

/// Range of the plane normal . p = offset_m; infinite behind the sensor and parallel to the plane.
inline RangeOf plane_at(const glm::dvec3& normal, double offset_m) {
  return [=](const glm::dvec3& towards) {
    const double r = offset_m / glm::dot(normal, towards);
    return r > 0 ? r : std::numeric_limits<double>::infinity();
  };
}

/// The smaller of two ranges.
inline RangeOf nearer(const RangeOf& a, const RangeOf& b) {
  return [=](const glm::dvec3& towards) { return std::min(a(towards), b(towards)); };
}

/// Returns the rows i of `returns` for which `keep(i)` holds.
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
