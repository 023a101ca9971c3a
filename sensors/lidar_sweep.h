#pragma once

#include <cstdint>

#include "sensors/lidar.h"

namespace groundray {

/// What a lidar is made of. All of it outlives its sweeps.
struct LidarParts {
  const LidarSpec& spec;
  const ScanPattern& pattern;
  const LaserBeam& beam;     ///< with a level more than pulses use, to compare with
  int last_level;            ///< that pulses use
  const Light* light;        ///< null without light
  const Light* quiet_light;  ///< the same without noise
};

/// Makes one sweep of a lidar. @param key  names the sweep. @throws Error as Lidar::scan.
LidarScan scan_sweep(const LidarParts& lidar, const Scene& scene, const Trajectory& X_DS,
                     std::int64_t number, const RandomKey& key, const SweepWatch& watch);

}  // namespace groundray
