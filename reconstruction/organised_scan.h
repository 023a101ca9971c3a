#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// A scan whose beams lie on a grid: beams beside each other there are neighbours in the world.
/// Cell (row, column) is number row * columns + column of each list. In any one frame.
struct OrganisedScan {
  int rows = 0, columns = 0;
  bool is_round = false;  ///< the last column is beside the first
  std::vector<glm::dvec3> points_m;   ///< where each beam met something; NaN where nothing returned
  std::vector<glm::dvec3> origins_m;  ///< where each beam began
  std::vector<float> sd_m;            ///< standard deviation of each range; one for each cell
  std::vector<std::uint16_t> labels;  ///< semantic class of each return, or none for all
};

}  // namespace groundray
