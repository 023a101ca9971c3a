#pragma once

#include <chrono>
#include <filesystem>
#include <span>

#include "apps/scene/simulation.h"
#include "sensors/camera/image_boxes.h"
#include "sensors/lidar/scan_boxes.h"

namespace groundray {

/// Suffix of the file with the boxes of the instances of a scan or an image.
inline constexpr const char* boxes_suffix = "_boxes.npy";

/// Writes the boxes of a scan as a structured NumPy array (docs/reference/boxes.md).
/// @param stamp  of the scan.
/// @throws Error as write_whole.
void write_boxes(const std::filesystem::path& path, const SceneObjects& objects,
                 std::span<const ScannedInstance> instances, std::chrono::nanoseconds stamp);

/// Writes the boxes of an image likewise.
/// @param stamp  of the image.
/// @throws Error as write_whole.
void write_boxes(const std::filesystem::path& path, const SceneObjects& objects,
                 std::span<const ImagedInstance> instances, std::chrono::nanoseconds stamp);

}  // namespace groundray
