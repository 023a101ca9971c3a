#pragma once

#include <limits>

namespace groundray {

/// Closed interval of slant ranges that a receiver reports, metres along the beam.
struct RangeGate {
  double near_m = 0;
  double far_m = std::numeric_limits<double>::infinity();
};

}  // namespace groundray
