#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "core/io/point_cloud.h"
#include "core/tracing/instance_box.h"

namespace groundray {

/// Instance that a scan hit.
struct ScannedInstance {
  InstanceBox box;           ///< at the mean of the firing times of its points
  std::uint32_t points = 0;  ///< number of echoes
};

/// Returns the instances of which a scan has one echo at least, in the order of their numbers.
/// @param echoes  result of Lidar::scan.
/// @param stamp   stamp of the scan.
std::vector<ScannedInstance> scanned_instances(const PointCloud& echoes, const InstanceBoxes& boxes,
                                               std::chrono::nanoseconds stamp);

}  // namespace groundray
