#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// What measured a point.
enum class PointOrigin : std::uint8_t { Lidar, Stereo };

/// Points in D and what is known of their errors: one entry of each column for each point.
struct MeasuredPoints {
  std::vector<glm::dvec3> p_m;
  std::vector<float> sd_m;         ///< of the height: what differs from point to point
  std::vector<float> bias_sd_m;    ///< of the height: what all points of the group have in common
  std::vector<float> across_sd_m;  ///< of the place in plan, with the beam's footprint, each way
  std::vector<std::uint32_t> groups;  ///< number of the scan or pair
  std::vector<PointOrigin> origins;

  std::size_t size() const noexcept { return p_m.size(); }
};

}  // namespace groundray
