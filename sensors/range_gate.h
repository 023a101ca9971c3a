#pragma once

#include <limits>

namespace groundray {

/// Slant ranges a receiver reports: a closed interval, metres along the beam.
struct RangeGate {
  double near_m = 0;
  double far_m = std::numeric_limits<double>::infinity();
};

}  // namespace groundray
