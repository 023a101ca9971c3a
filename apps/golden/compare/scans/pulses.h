#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "apps/scan/scan.h"

namespace groundray::golden {

/// Pulses of a scan with their returns, in the order of their first returns.
struct Pulses {
  std::vector<std::uint32_t> returns;  ///< indices of the scan's returns, pulse by pulse
  std::vector<std::size_t> begins{0};  ///< start of each pulse in `returns`, and the end
  std::vector<glm::dvec3> directions;  ///< unit vector to each pulse's first return
  std::vector<double> rings, times;    ///< of each pulse's first return; empty if not available

  std::size_t size() const { return directions.size(); }
  std::span<const std::uint32_t> of(std::size_t pulse) const {
    return std::span(returns).subspan(begins[pulse], begins[pulse + 1] - begins[pulse]);
  }
};

/// Largest angle between directions that count as equal, rad.
constexpr double same_pulse_rad = 1e-5;

/// Returns, for each direction, the index of its representative: the first earlier direction within
/// same_pulse_rad that represents itself, or else its own index.
/// @param directions  unit vectors.
std::vector<std::uint32_t> firsts_of(const std::vector<glm::dvec3>& directions);

/// Groups the returns of a scan into pulses by number, else by ring and time, else by direction
/// (and by ring or time, if available). Times are ignored if they do not distinguish pulses: if
/// more than 16 returns share ring and time.
Pulses pulses_of(const Scan& scan);

}  // namespace groundray::golden
