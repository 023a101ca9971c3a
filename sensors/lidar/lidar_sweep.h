#pragma once

#include <cstdint>

#include "sensors/lidar/lidar.h"

namespace groundray {

/// Components of a lidar. All must outlive its sweeps.
struct LidarParts {
  const LidarSpec& spec;
  const ScanPattern& pattern;
  const LaserBeam& beam;             ///< with one level more than pulses use, for Convergence
  int last_level;                    ///< last level that pulses use
  const EchoSimulator* light;        ///< null without light
  const EchoSimulator* quiet_light;  ///< `light` without noise; null without light
};

/// Scans one sweep of a lidar.
/// @param key  random key of the sweep.
/// @throws Error, SweepStopped as Lidar::scan.
LidarScan scan_sweep(const LidarParts& lidar, const Scene& scene, const Trajectory& X_DS,
                     std::int64_t number, const RandomKey& key, const SweepWatch& watch);

}  // namespace groundray
