#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "core/point_cloud.h"
#include "core/random.h"
#include "core/scene.h"
#include "core/trajectory.h"
#include "sensors/scan_pattern.h"

namespace groundray {

/// Slant ranges a receiver reports: a closed interval, metres along the beam.
struct RangeGate {
  double near_m = 0;
  double far_m = std::numeric_limits<double>::infinity();
};

/// Everything that makes one spinning lidar.
struct LidarSpec {
  std::string model;  ///< for people: "Velodyne VLP-16"
  SpinningPattern pattern;
  RangeGate gate;
  double range_noise_sigma_m = 0;  ///< of a Gaussian along the beam; 0 for none
  /// Whether scans bound how far each range is from the reference surface, which takes two more
  /// rays where the terrain is simplified.
  enum class ErrorBound { Omit, Report } error_bound = ErrorBound::Omit;
};

/// A scanning time-of-flight lidar, one ray for each pulse. Immutable, so any number of threads may
/// scan with one.
class Lidar {
 public:
  /// @throws Error listing every field of `spec` that is out of bounds.
  explicit Lidar(const LidarSpec& spec);

  const ScanPattern& pattern() const { return pattern_; }

  /// Returns the echoes of one sweep, a row for each, in firing order. Columns (see
  /// docs/formats.md): x y z (float, m, S as the beam fired), intensity, time (float, s since the
  /// sweep's stamp), ring, return_index, return_count, world_x world_y world_z (double, m, D),
  /// range_true (double, m, from where the beam left), nx ny nz (float, D), incidence (float, rad),
  /// label, instance, error_estimate (float, m) and, if asked for, error_bound (float, m; see
  /// RayTracer::bound_errors).
  /// @param X_DS   path of sensor S through D; must cover the sweep.
  /// @param sweep  which turn of the head since time 0.
  /// @param sensor_number  tells sensors of one dataset apart in the random numbers.
  /// @throws Error if X_DS does not cover the sweep.
  PointCloud scan(const Scene& scene, const Trajectory& X_DS, std::int64_t sweep, Seed seed,
                  std::uint32_t sensor_number) const;

 private:
  ScanPattern pattern_;
  RangeGate gate_;
  double range_noise_sigma_m_;
  LidarSpec::ErrorBound error_bound_;
};

}  // namespace groundray
