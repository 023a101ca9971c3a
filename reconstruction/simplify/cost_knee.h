#pragma once

#include <cstddef>
#include <vector>

namespace groundray {

/// What a collapse cost, and how many triangles it left.
struct CostStep {
  double cost = 0;
  std::size_t triangles = 0;
};

/// Returns at how many triangles the knee of cost is: see CostKnee. Cost is the largest so far.
/// @param steps  of a run to the end, in order, the first before any collapse.
std::size_t find_knee(const std::vector<CostStep>& steps);

}  // namespace groundray
