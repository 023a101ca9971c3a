#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "apps/view/recorded/recorded_image.h"
#include "apps/view/recorded/recorded_sensor.h"

namespace groundray {

/// Echo of a lidar in an image.
struct EchoPixel {
  glm::dvec2 pixel{0};  ///< integers at pixel centres
  double depth_m = 0;   ///< along the optical axis
};

/// Returns the files that list where a frame shows the echoes of each lidar, by the lidar's name
/// (docs/theory/camera_rig.md).
/// @param stem  path of the frame's files without their suffixes.
std::map<std::string, std::filesystem::path> echo_files(const std::filesystem::path& stem);

/// Reads the echoes that are visible in the image from such a file.
/// @throws Error naming the file, if it is damaged or has other columns.
std::vector<EchoPixel> read_echo_pixels(const std::filesystem::path& file);

/// Projects echoes into a recorded image, each at the time of its row, as pixel_of(). Omits those
/// outside the image and, if the image records distances, those behind what their pixel sees by
/// more than 10 cm and 2 %: the camera does not see what the lidar hit. Objects that moved between
/// the scan and the image are not accounted for.
/// @param p_D_m  echoes in D; those that are not finite are omitted.
/// @throws Error if the sensor is no camera.
std::vector<EchoPixel> echo_pixels(const RecordedSensor& camera, const RecordedFrame& frame,
                                   const RecordedImage& image, std::span<const glm::dvec3> p_D_m);

}  // namespace groundray
