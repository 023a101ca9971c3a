#pragma once

#include <chrono>
#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "apps/view/recorded_image.h"
#include "apps/view/recorded_sensor.h"

namespace groundray {

/// Where a pixel of a recorded image looks, and what it sees.
struct SeenPixel {
  glm::dvec3 origin_m{0};            ///< of the lens in D, when the pixel's row is half exposed
  glm::dvec3 direction{0};           ///< unit, in D
  std::chrono::nanoseconds time{0};  ///< that
  std::optional<glm::dvec3> p_D_m;  ///< the surface, if the image tells its distance and it is none
                                    ///< of sky
};

/// Returns the ray of a place in an image, whole numbers being centres of pixels; none if the lens
/// images nothing there.
/// @param camera  a camera. @param frame  one of its frames.
/// @param image   that frame's, for the surface; may be null.
std::optional<SeenPixel> seen_pixel(const RecordedSensor& camera, const RecordedFrame& frame,
                                    glm::dvec2 pixel, const RecordedImage* image);

/// Returns where a point of D falls in an image: inside or not; none if it is not imaged. With a
/// rolling shutter, at the row's own time.
std::optional<glm::dvec2> pixel_of(const RecordedSensor& camera, const RecordedFrame& frame,
                                   const glm::dvec3& p_D);

}  // namespace groundray
