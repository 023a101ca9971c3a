#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <string>
#include <string_view>

#include "apps/groundray/describe/facts.h"
#include "sensors/camera/camera_spec.h"
#include "sensors/lidar/lidar_spec.h"

namespace groundray {

/// Main figures of a lidar, most of them from the pulses of its first sweep.
struct LidarFigures {
  std::size_t channels = 0;  ///< number of different rings
  std::int64_t pulses = 0;   ///< of a sweep
  double rate_hz = 0;        ///< sweeps per second
  glm::dvec2 elevation_deg{0};
  /// Angle about z that the pulses span: a turn without the widest gap between them. Gaps of up to
  /// 5 degrees count as spanned.
  double azimuth_span_deg = 0;
};

/// Computes the main figures of a lidar.
/// @throws Error as ScanPattern.
LidarFigures figures_of(const LidarSpec& lidar);

/// Returns the angles between the rays of a camera's outermost pixels in the middle row and in the
/// middle column, degrees: the sum of their angles from the axis. Where the lens does not image the
/// outermost pixel, its limit counts.
/// @throws Error as Lens.
glm::dvec2 view_deg(const CameraSpec& camera);

/// Returns a lidar's main figures in one line.
std::string line_of(const LidarSpec& lidar);
/// Returns a camera's main figures in one line.
std::string line_of(const CameraSpec& camera);

/// Describes a lidar.
Facts facts_of(const LidarSpec& lidar);
/// Describes a camera.
Facts facts_of(const CameraSpec& camera);

/// Returns the exposure time of images, or its limits if it is automatic.
std::string exposure_text(const ShutterSpec& shutter);
/// Returns the name of a lens model, as in a camera file.
std::string lens_name(const CameraSpec& camera);
/// Returns "mono", or the four pixels of the mosaic: "rggb".
std::string_view filter_name(ColorFilter filter);

}  // namespace groundray
