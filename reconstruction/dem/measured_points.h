#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// Kind of sensor that measured a point.
enum class PointOrigin : std::uint8_t { Lidar, Stereo };

/// Points in D and their errors: one entry of each column per point.
///
/// Errors are mostly along lines of sight: a point that is too high by 1 m is also displaced by
/// `lean` in plan. On ground of the slope g (rise over run, as a vector), a height error e
/// therefore moves the point off the ground by e (1 - g lean): by more if the ground faces the
/// sensor, by less if it falls away from it. The bias of a stereo pair lies along the same line and
/// has a lean, too; that of a scan is due to its pose and has none.
/// @see docs/theory/dem.md
struct MeasuredPoints {
  std::vector<glm::dvec3> p_m;
  std::vector<float> sd_m;       ///< sd of the height, independent from point to point
  std::vector<float> bias_sd_m;  ///< sd of the height, common to all points of the group
  /// Covariance of position in plan and height, divided by the variance of the height.
  std::vector<glm::vec2> lean;
  /// Sd of the remaining position in plan, including the footprint, each way.
  std::vector<float> across_sd_m;
  std::vector<std::uint32_t> groups;  ///< number of the scan or stereo pair
  std::vector<PointOrigin> origins;

  static constexpr float most_lean = 60;  ///< maximum length

  std::size_t size() const noexcept { return p_m.size(); }
};

/// Errors that are independent from point to point, as in MeasuredPoints.
struct PointErrors {
  float sd_m = 0;
  glm::vec2 lean{0};
  float across_sd_m = 0;
};

/// Returns the errors of a point from its covariance in D. A lean longer than most_lean is
/// shortened to that; the position error that it no longer explains is added to across_sd_m.
PointErrors point_errors(const glm::dmat3& covariance_m2) noexcept;

}  // namespace groundray
