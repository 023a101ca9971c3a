#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/point_cloud.h"
#include "core/random.h"
#include "core/scene.h"
#include "core/trajectory.h"
#include "sensors/beam.h"
#include "sensors/lidar_spec.h"
#include "sensors/light.h"
#include "sensors/scan_pattern.h"

namespace groundray {

/// A run of samples of the power that one pulse brought back.
struct WaveformRun {
  std::uint32_t pulse = 0;         ///< of the sweep, in firing order
  std::uint32_t count = 0;         ///< of samples
  std::uint64_t first_sample = 0;  ///< in Waveforms::power_w
  double start_s = 0;              ///< time of its first sample after the pulse left
};

/// The power received in a sweep, W, wherever there was any.
struct Waveforms {
  double interval_s = 0;  ///< from sample to sample
  std::vector<WaveformRun> runs;
  std::vector<float> power_w;
};

/// How much twice the sub-rays would change: every 64th pulse with and without them, free of noise.
struct Convergence {
  std::uint64_t pulses = 0;   ///< looked at
  std::uint64_t changed = 0;  ///< of these, how many have another number of echoes
  double sum_squares_m2 = 0;  ///< of the differences in range of the first echoes of the others
  double largest_m = 0;
  std::uint64_t compared = 0;  ///< how many these are
};

/// What one sweep of a lidar gives.
struct LidarScan {
  PointCloud echoes;
  PointCloud no_returns;
  Waveforms waveforms;
  Convergence convergence;
};

/// Is told now and then which share of a sweep is begun, from 0, and returns whether to go on. It
/// is called by one thread at a time, but not always by the same.
using SweepWatch = std::function<bool(double share)>;

/// Thrown where a sweep ends before its last pulse, because its watch said so.
struct SweepStopped {};

/// A scanning time-of-flight lidar. Immutable, so any number of threads may scan with one.
class Lidar {
 public:
  /// @param air  that light goes through; a spec without light does not see it.
  /// @throws Error listing every field of `spec` that is out of bounds.
  explicit Lidar(const LidarSpec& spec, const AtmosphereSpec& air = {});

  const ScanPattern& pattern() const { return pattern_; }

  /// Returns one sweep. Echoes have a row each, in firing order and by range, with the columns of
  /// docs/formats.md: x y z (float, m, S as the beam fired or at the stamp), intensity, time
  /// (float, s since the sweep's stamp), ring, return_index, return_count, world_x world_y world_z
  /// (double, m, D), range_true (double, m, from where the beam left), nx ny nz (float, D),
  /// incidence (float, rad), label, instance, error_estimate (float, m), with light pulse
  /// (of the sweep), amplitude (float, W), width (float, s), snr, kind, share, second_share and
  /// second_label, with noise range_sd (float, m), and, if asked for, error_bound (float, m; see
  /// RayTracer::bound_errors). Pulses without an echo, if asked for, have a row each in
  /// `no_returns`: pulse, time, ring, dx dy dz (float, axes of D), reason.
  /// @param X_DS   path of sensor S through D; must cover the sweep.
  /// @param sweep  which one since time 0.
  /// @param sensor_number  tells sensors of one dataset apart in the random numbers.
  /// @param watch  may be none.
  /// @throws Error if X_DS does not cover the sweep, or a spectrum not the laser's wavelength.
  /// @throws SweepStopped if `watch` says so.
  LidarScan scan(const Scene& scene, const Trajectory& X_DS, std::int64_t sweep, Seed seed,
                 std::uint32_t sensor_number, const SweepWatch& watch = {}) const;

 private:
  LidarSpec spec_;
  ScanPattern pattern_;
  LaserBeam beam_;  // with a level more than pulses use, to compare with
  int last_level_;
  std::optional<Light> light_;
  std::optional<Light> quiet_light_;  // the same without noise
};

}  // namespace groundray
