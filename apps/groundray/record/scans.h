#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/groundray/record/dataset.h"
#include "apps/scene/world.h"
#include "sensors/lidar.h"

namespace groundray {

/// Returns what the names of all files of a scan of a lidar end with, in the order in which they
/// are written.
std::vector<std::string> scan_suffixes(const MountedLidar& lidar);

/// Writes a scan and all that is asked for with it.
/// @param lidar  index among the world's. @throws Error if a file cannot be written.
void write_scan(const World& world, const Dataset& dataset, std::uint32_t lidar, std::int64_t frame,
                const LidarScan& scan);

}  // namespace groundray
