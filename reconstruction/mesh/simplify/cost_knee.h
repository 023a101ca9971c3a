#pragma once

#include <cstddef>
#include <vector>

namespace groundray {

/// Cost of a collapse, and the number of triangles left.
struct CostStep {
  double cost = 0;
  std::size_t triangles = 0;
};

/// Returns the number of triangles at the knee of the cost: see CostKnee. Uses the running maximum
/// of the cost.
/// @param steps  of a run to the end, in order; the first precedes all collapses.
std::size_t find_knee(const std::vector<CostStep>& steps);

}  // namespace groundray
