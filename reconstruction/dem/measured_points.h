#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// What measured a point.
enum class PointOrigin : std::uint8_t { Lidar, Stereo };

/// Points in D and what is known of their errors: one entry of each column for each point.
///
/// Errors are mostly along lines of sight: what puts a point too high by 1 m moves it by `lean` in
/// plan as well. On ground of the slope g (rise over run, as a vector) an error e of the height
/// then puts it off that ground by e (1 - g lean): facing the sensor by more, falling away from it
/// by less. A stereo pair's bias is along the same line, and leans; that of a scan is of its pose,
/// and does not.
struct MeasuredPoints {
  std::vector<glm::dvec3> p_m;
  std::vector<float> sd_m;         ///< of the height: what differs from point to point
  std::vector<float> bias_sd_m;    ///< of the height: what all points of the group have in common
  std::vector<glm::vec2> lean;     ///< covariance of place and height over the height's variance
  std::vector<float> across_sd_m;  ///< of the rest of the place in plan, with footprint, each way
  std::vector<std::uint32_t> groups;  ///< number of the scan or pair
  std::vector<PointOrigin> origins;

  static constexpr float most_lean = 60;  ///< its length

  std::size_t size() const noexcept { return p_m.size(); }
};

/// What differs from point to point, as MeasuredPoints has it.
struct PointErrors {
  float sd_m = 0;
  glm::vec2 lean{0};
  float across_sd_m = 0;
};

/// Returns what a point's covariance, axes of D, says of its errors. A lean longer than most_lean
/// is cut to that; what it does not tell of the place then counts as the rest.
PointErrors point_errors(const glm::dmat3& covariance_m2) noexcept;

}  // namespace groundray
