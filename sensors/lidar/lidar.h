#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/io/point_cloud.h"
#include "core/random.h"
#include "core/tracing/scene.h"
#include "sensors/lidar/beam/beam.h"
#include "sensors/lidar/beam/plane_footprint.h"
#include "sensors/lidar/echo_simulator.h"
#include "sensors/lidar/lidar_spec.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace groundray {

/// Contiguous samples of the power received from one pulse.
struct WaveformRun {
  std::uint32_t pulse = 0;         ///< number in the sweep, in firing order
  std::uint32_t count = 0;         ///< number of samples
  std::uint64_t first_sample = 0;  ///< index in Waveforms::power_w
  double start_s = 0;              ///< time of the first sample after the pulse was emitted
};

/// Power received in a sweep, W, wherever there is any.
struct Waveforms {
  double interval_s = 0;  ///< between samples
  std::vector<WaveformRun> runs;
  std::vector<float> power_w;
};

/// Convergence of the footprint: every 64th pulse is traced again with twice the sub-rays, noise
/// off.
struct Convergence {
  /// Absolute changes of a value of the echoes.
  struct Changes {
    double sum_squares = 0, largest = 0;
    std::uint64_t count = 0;

    void add(double change);
    void add(const Changes& other);
    double rms() const;  ///< 0 without any
  };

  std::uint64_t pulses = 0;   ///< traced again
  std::uint64_t changed = 0;  ///< pulses whose number of echoes changed
  // Of all echoes of the other pulses:
  Changes range_m;  ///< reported range
  Changes true_m;   ///< range_true, where surfaces made both echoes
  Changes share;

  void add(const Convergence& other);
};

/// Result of one sweep of a lidar.
struct LidarScan {
  PointCloud echoes;
  PointCloud no_returns;
  Waveforms waveforms;
  Convergence convergence;
};

/// Progress callback: receives the fraction of the sweep that has begun, from 0; returns false to
/// stop the sweep. Called by one thread at a time, but not always by the same one.
using SweepWatch = std::function<bool(double share)>;

/// Exception thrown when the progress callback stops a sweep before its last pulse.
struct SweepStopped {};

/// Scanning time-of-flight lidar. Immutable and therefore thread-safe.
class Lidar {
 public:
  /// @param air  air that the light passes through; ignored if `spec` has no light.
  /// @throws Error listing every field of `spec` that is out of bounds.
  explicit Lidar(const LidarSpec& spec, const AtmosphereSpec& air = {});

  const ScanPattern& pattern() const { return pattern_; }
  /// Returns the limit of the refinement of a pulse.
  std::size_t most_sub_rays() const { return beam_.sub_rays(last_level_).size(); }

  /// Returns one sweep. Each echo has a row, in firing order and by range, with the columns of
  /// docs/reference/formats.md: x y z (float, m, in S as the pulse fired or at the stamp),
  /// intensity, time (float, s since the sweep's stamp), ring, return_index, return_count, world_x
  /// world_y world_z (double, m, D), range_true (double, m, from the beam's origin), nx ny nz
  /// (float, D), incidence (float, rad), label, instance, error_estimate (float, m); with light
  /// pulse (number in the sweep), amplitude (float, W), width (float, s), snr, kind, share,
  /// second_share and second_label; with noise range_sd (float, m); if any object moves vx vy vz
  /// (float, m/s, D); and, if requested, error_bound (float, m; see RayTracer::bound_errors). If
  /// requested, each pulse without an echo has a row in `no_returns`: pulse, time, ring, dx dy dz
  /// (float, axes of D), reason.
  /// @param X_DS  pose of sensor S in D over time; must cover the sweep.
  /// @param sweep  number of the sweep since time 0.
  /// @param sensor_number  distinguishes the sensors of one dataset in the random numbers.
  /// @param watch  progress callback; may be empty.
  /// @throws Error if X_DS does not cover the sweep, or a spectrum does not cover the laser's
  ///         wavelength.
  /// @throws SweepStopped if `watch` returns false.
  LidarScan scan(const Scene& scene, const Trajectory& X_DS, std::int64_t sweep, Seed seed,
                 std::uint32_t sensor_number, const SweepWatch& watch = {}) const;

 private:
  class Sweep;

  LidarSpec spec_;
  ScanPattern pattern_;
  std::optional<EchoSimulator> light_;
  std::optional<EchoSimulator> quiet_light_;  // light_ without noise
  LaserBeam beam_;  // with one level more than pulses use, for Convergence
  int last_level_;
  std::optional<PlaneQuadrature> planes_;  // if there are sub-rays
};

}  // namespace groundray
