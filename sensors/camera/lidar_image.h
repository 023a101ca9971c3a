#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "core/point_cloud.h"
#include "core/scene.h"
#include "core/trajectory.h"
#include "sensors/camera/camera.h"

namespace groundray {

/// Where an image shows what a lidar measured.
struct ImagedEcho {
  std::uint32_t echo = 0;     ///< row of the scan
  double u_px = 0, v_px = 0;  ///< in the image or beside it
  double depth_m = 0;         ///< Z: along the optical axis
  bool is_inside = false;     ///< whether that lies on one of the image's pixels
  bool is_visible = false;    ///< whether it does, and nothing hides it from the camera
};

/// Returns where an image shows the echoes of a scan, on all cores: one row for each echo that the
/// lens images, in the scan's order. Echoes are those of the truth, without noise. A point moves
/// with its object from when its pulse fired to the middle of its row's exposure. It is hidden if
/// anything is met on the way from the camera to a place above it, off its surface by the accuracy
/// of ranges and a micrometre.
/// @param X_DC    must cover the image.
/// @param begin   when the image's first row begins to see.
/// @param echoes  of Lidar::scan, of the same scene. @param stamp  of the scan.
/// @throws Error if X_DC does not cover the image, or if `echoes` lacks a column.
/// @see docs/camera_rig.md
std::vector<ImagedEcho> image_echoes(const Camera& camera, const Scene& scene,
                                     const Trajectory& X_DC, std::chrono::nanoseconds begin,
                                     const PointCloud& echoes, std::chrono::nanoseconds stamp);

/// Writes them as a NumPy array of the fields echo u4, u_px f8, v_px f8, depth_m f8, is_inside u1
/// and is_visible u1. @throws Error as write_whole.
void write_imaged_echoes(const std::filesystem::path& path, std::span<const ImagedEcho> echoes);

}  // namespace groundray
