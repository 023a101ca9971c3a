#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "apps/scan/scan.h"

namespace groundray::golden {

/// The returns of a scan, pulse by pulse, in the order of their first returns.
struct Pulses {
  std::vector<std::uint32_t> returns;  ///< indices of the scan's returns
  std::vector<std::size_t> begins{0};  ///< of each pulse in `returns`, and the end
  std::vector<glm::dvec3> directions;  ///< unit, of its first return
  std::vector<double> rings, times;    ///< of its first return; empty if the scan has none

  std::size_t size() const { return directions.size(); }
  std::span<const std::uint32_t> of(std::size_t pulse) const {
    return std::span(returns).subspan(begins[pulse], begins[pulse + 1] - begins[pulse]);
  }
};

/// Directions that differ by no more are one.
constexpr double same_pulse_rad = 1e-5;

/// Returns for each direction the first that it is one with: itself, or one before it that is the
/// first of its own and at 1e-5 rad or less.
/// @param directions  unit.
std::vector<std::uint32_t> firsts_of(const std::vector<glm::dvec3>& directions);

/// Returns the pulses of a scan by number, else by ring and time, else by direction. Times are left
/// out if they do not tell pulses apart: more than 16 returns have one ring and time.
Pulses pulses_of(const Scan& scan);

}  // namespace groundray::golden
