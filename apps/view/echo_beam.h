#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/recorded/recorded_sensor.h"
#include "core/io/point_cloud.h"

namespace groundray {

/// Displayed value of one column of a scan's row.
struct EchoValue {
  std::string column;
  std::string text;  ///< value with unit or name: "12.345 m", "4 (tree)"
};

/// Returns the values of all columns of a scan's row, in the scan's order, with the units of
/// docs/reference/formats.md; columns that are not listed there have no unit.
/// @param names  names of labels and instances.
/// @throws Error if there is no such row.
std::vector<EchoValue> echo_values(const PointCloud& scan, std::size_t row,
                                   const RecordedNames& names = {});

/// Beam of an echo and its footprint, in D.
struct EchoBeam {
  glm::dvec3 origin_m{0};    ///< point at which the beam leaves the sensor
  glm::dvec3 direction{0};   ///< unit vector
  double range_m = 0;        ///< reported range: reported_m = origin_m + range_m * direction
  glm::dvec3 reported_m{0};  ///< reported point
  std::optional<glm::dvec3> true_m;       ///< true point on the surface, if the scan states it
  glm::dvec3 horizontal{0}, vertical{0};  ///< unit axes of the cross-section
  double horizontal_radius_m = 0, vertical_radius_m = 0;  ///< 1/e^2 or top-hat edge, at the range
  /// Closed ring at the aperture: its last point equals its first; the next two have as many
  /// points.
  std::vector<glm::dvec3> waist_m;
  std::vector<glm::dvec3> across_m;  ///< same at the range, perpendicular to the beam
  /// Same on the tangent plane of the surface; empty without a normal or at grazing incidence.
  std::vector<glm::dvec3> surface_m;
  bool is_origin_exact = false;  ///< false: the beam's own origin is unknown, and S's is used
};

/// Returns the beam of a scan's row.
/// @param lidar   sensor of the dataset that recorded the scan.
/// @param frame   frame of `lidar` that holds the scan.
/// @param points  number of distinct points of each ring; values below 3 count as 3.
/// @throws Error if there is no such row, x, y and z are missing or not finite, the point coincides
///         with the beam's origin, or the sensor is no lidar.
EchoBeam echo_beam(const RecordedSensor& lidar, const RecordedFrame& frame, const PointCloud& scan,
                   std::size_t row, std::size_t points = 64);

}  // namespace groundray
