#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/groundray/record/dataset.h"
#include "apps/scene/world.h"
#include "core/point_cloud.h"
#include "core/scene.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/image_truth.h"
#include "sensors/camera/lidar_image.h"

namespace groundray {

/// Returns what the names of all files of an image of a camera end with.
std::vector<std::string> image_suffixes(const MountedCamera& camera);

/// A scan whose echoes an image shows.
struct ShownScan {
  std::uint32_t lidar = 0;  ///< index among the world's
  std::int64_t scan = 0;
};

/// Returns those of an image, in the order in which its camera names the lidars: of each the last
/// scan that has begun when the image is half exposed, or else the first.
/// @param camera  index among the world's. @param image  number of the camera's.
std::vector<ShownScan> shown_scans(const World& world, std::size_t camera, std::int64_t image);

/// Returns where an image shows the echoes of a scan.
/// @param scene  of the scan, on whose surface the echoes lie: what hides them is looked for there.
std::vector<ImagedEcho> show_echoes(const World& world, std::size_t camera, std::int64_t image,
                                    const ShownScan& shown, const PointCloud& echoes,
                                    const Scene& scene);

/// An image in memory, with all that is asked for with it.
struct MadeImage {
  std::optional<Exposure> light;
  std::optional<ImageTruth> truth;
  std::vector<std::uint16_t> labels;            ///< of the channels of the light's coverage
  std::vector<std::vector<ImagedEcho>> echoes;  ///< of each lidar that the camera shows
  std::uint64_t paths = 0;                      ///< of light, that it took
};

/// Makes an image, without echoes. @throws Interrupted.
MadeImage make_image(const World& world, std::size_t camera, std::int64_t image,
                     const Scene& scene);

/// Takes the imager's part in an image, and writes all of it.
/// @return how many flows are beyond what KITTI's files hold.
/// @throws Error if a file cannot be written.
std::uint64_t write_image(const World& world, const Dataset& dataset, std::size_t camera,
                          std::int64_t image, const MadeImage& made);

}  // namespace groundray
