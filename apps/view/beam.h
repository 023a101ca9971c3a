#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/recorded_sensor.h"
#include "core/point_cloud.h"

namespace groundray {

/// A column's value of one row, for people.
struct EchoValue {
  std::string column;
  std::string text;  ///< with its unit: "12.345 m", "4 (tree)"
};

/// Returns the values of all columns of a scan's row, in the scan's order. Units are those of
/// docs/formats.md; columns that it does not tell of have none.
/// @param names  of labels and instances. @throws Error if there is no such row.
std::vector<EchoValue> echo_values(const PointCloud& scan, std::size_t row,
                                   const RecordedNames& names = {});

/// The beam that an echo came back along, and where it fell, in D.
struct EchoBeam {
  glm::dvec3 origin_m{0};    ///< where the beam left the sensor
  glm::dvec3 direction{0};   ///< unit
  double range_m = 0;        ///< as reported: origin + range * direction is the reported point
  glm::dvec3 reported_m{0};  ///< that point
  std::optional<glm::dvec3> true_m;       ///< the surface's, if the scan tells it
  glm::dvec3 horizontal{0}, vertical{0};  ///< unit, across: the axes of the footprint
  double horizontal_radius_m = 0, vertical_radius_m = 0;  ///< at the range: 1/e^2, or the rim
  std::vector<glm::dvec3> waist_m;   ///< closed ring where the beam leaves: its first point is last
                                     ///< again; as the next two, of as many points
  std::vector<glm::dvec3> across_m;  ///< likewise at the range, across the beam
  std::vector<glm::dvec3> surface_m;  ///< likewise on the plane of the surface; empty without
                                      ///< normal, or if the beam only grazes it
  bool is_origin_exact = false;       ///< false: the beam's own origin is unknown, S's is taken
};

/// Returns the beam of a scan's row.
/// @param lidar   the sensor of a dataset that made the scan. @param frame  one of its frames.
/// @param points  of each ring, at least 3.
/// @throws Error if there is no such row, or no columns x, y and z; or if the sensor is no lidar.
EchoBeam echo_beam(const RecordedSensor& lidar, const RecordedFrame& frame, const PointCloud& scan,
                   std::size_t row, std::size_t points = 64);

}  // namespace groundray
