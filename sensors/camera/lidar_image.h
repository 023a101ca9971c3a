#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/io/point_cloud.h"
#include "core/tracing/scene.h"
#include "sensors/camera/camera.h"

namespace groundray {

/// Position of a lidar's echo in an image.
struct ImagedEcho {
  std::uint32_t echo = 0;     ///< row of the scan
  double u_px = 0, v_px = 0;  ///< inside the image or outside
  double depth_m = 0;         ///< Z, along the optical axis
  bool is_inside = false;     ///< true if the position lies on one of the image's pixels
  bool is_visible = false;    ///< true if is_inside, and nothing hides the point from the camera
};

/// Projects the echoes of a scan into an image, on all cores. Returns one row for each echo that
/// the lens images, in the scan's order. Echoes are those of the truth, without noise. A point
/// moves with its object from the time of its pulse to the middle of its row's exposure. It is
/// hidden if a ray from the camera hits anything before a position above the point, off its surface
/// by the accuracy of ranges and a micrometre.
/// @param X_DC    trajectory of the camera; must cover the image.
/// @param begin   start of the first row's exposure.
/// @param echoes  result of Lidar::scan, for the same scene.
/// @param stamp   stamp of the scan.
/// @throws Error if X_DC does not cover the image, or if `echoes` lacks a column.
/// @see docs/theory/camera_rig.md
std::vector<ImagedEcho> image_echoes(const Camera& camera, const Scene& scene,
                                     const Trajectory& X_DC, std::chrono::nanoseconds begin,
                                     const PointCloud& echoes, std::chrono::nanoseconds stamp);

/// Writes imaged echoes as a structured NumPy array with the fields echo u4, u_px f8, v_px f8,
/// depth_m f8, is_inside u1 and is_visible u1.
/// @throws Error as write_whole.
void write_imaged_echoes(const std::filesystem::path& path, std::span<const ImagedEcho> echoes);

}  // namespace groundray
