#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "apps/dataset/write/dataset_writer.h"
#include "apps/scene/frames.h"
#include "apps/scene/simulation.h"
#include "core/io/point_cloud.h"
#include "core/tracing/scene.h"
#include "sensors/camera/lidar_image.h"
#include "sensors/lidar/lidar.h"

namespace groundray {

/// Returns the suffixes of all files of a lidar's scan, in the order in which they are written.
std::vector<std::string> scan_suffixes(const MountedLidar& lidar);
/// Returns the suffixes of all files of a camera's image.
std::vector<std::string> image_suffixes(const MountedCamera& camera);

/// Writes all files of a scan.
/// @param lidar  index in Simulation::lidars.
/// @throws Error if a file cannot be written.
void write_scan(const Simulation& simulation, const DatasetWriter& dataset, std::uint32_t lidar,
                std::int64_t frame, const LidarScan& scan);

/// Scan whose echoes an image shows.
struct OverlaidScan {
  std::uint32_t lidar = 0;  ///< index in Simulation::lidars
  std::int64_t scan = 0;
};

/// Returns the scans that an image shows, in the order in which its camera lists the lidars: from
/// each, the last scan that has begun by the middle of the image's time, or else the first.
/// @param camera  index in Simulation::cameras.
/// @param image   number of the camera's image.
std::vector<OverlaidScan> shown_scans(const Simulation& simulation, std::size_t camera,
                                      std::int64_t image);

/// Returns the positions of a scan's echoes in an image.
/// @param scene  scene of the scan, on whose surfaces the echoes lie; used to find occluded echoes.
std::vector<ImagedEcho> show_echoes(const Simulation& simulation, std::size_t camera,
                                    std::int64_t image, const OverlaidScan& shown,
                                    const PointCloud& echoes, const Scene& scene);

/// Suffix of the file with an image's exposure time, its gain, the fraction of its pixels that are
/// saturated, and automatic settings of its picture; present if its camera has products of the
/// imager.
inline constexpr const char* exposure_suffix = "_exposure.yaml";

/// Figures of a written image.
struct ImageFigures {
  std::uint64_t flows_left_out = 0;  ///< number of flows that exceed the range of KITTI's format
  double saturated_share = 0;        ///< fraction of the pixels that are saturated
};

/// Simulates the imager if necessary, and writes all files of an image.
/// @param echoes  positions of the echoes of each lidar that the camera shows, as show_echoes.
/// @throws Error if a file cannot be written.
ImageFigures write_image(const Simulation& simulation, const DatasetWriter& dataset,
                         std::size_t camera, std::int64_t image, const MadeImage& made,
                         std::span<const std::vector<ImagedEcho>> echoes);

}  // namespace groundray
