#pragma once

#include <chrono>
#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "apps/view/recorded/recorded_image.h"
#include "apps/view/recorded/recorded_sensor.h"

namespace groundray {

/// Line of sight of a pixel in a recorded image, and the surface point that it sees.
struct SeenPixel {
  glm::dvec3 origin_m{0};            ///< lens centre in D, when the pixel's row is half exposed
  glm::dvec3 direction{0};           ///< unit, in D
  std::chrono::nanoseconds time{0};  ///< that moment, in the run
  /// Surface point in D, if the image states its distance and it is not sky.
  std::optional<glm::dvec3> p_D_m;
};

/// Returns the line of sight of a position in an image, with integers at pixel centres;
/// std::nullopt if the lens images nothing there.
/// @param camera  a camera.
/// @param frame   one of its frames.
/// @param image   image of that frame, for the surface point; may be null.
/// @throws Error if the sensor is no camera.
std::optional<SeenPixel> seen_pixel(const RecordedSensor& camera, const RecordedFrame& frame,
                                    glm::dvec2 pixel, const RecordedImage* image);

/// Returns the projection of a point of D into an image, possibly outside its bounds; std::nullopt
/// if the point is not imaged. With a rolling shutter, it is projected at the time of its row.
/// @throws Error if the sensor is no camera.
std::optional<glm::dvec2> pixel_of(const RecordedSensor& camera, const RecordedFrame& frame,
                                   const glm::dvec3& p_D);

}  // namespace groundray
