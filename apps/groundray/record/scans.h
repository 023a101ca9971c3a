#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/groundray/record/dataset_writer.h"
#include "apps/scene/simulation.h"
#include "sensors/lidar/lidar.h"

namespace groundray {

/// Returns the suffixes of all files of a lidar's scan, in the order in which they are written.
std::vector<std::string> scan_suffixes(const MountedLidar& lidar);

/// Writes all files of a scan.
/// @param lidar  index in Simulation::lidars.
/// @throws Error if a file cannot be written.
void write_scan(const Simulation& simulation, const DatasetWriter& dataset, std::uint32_t lidar,
                std::int64_t frame, const LidarScan& scan);

}  // namespace groundray
