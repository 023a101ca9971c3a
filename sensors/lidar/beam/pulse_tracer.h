#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/random.h"
#include "core/tracing/scene.h"
#include "sensors/lidar/beam/beam.h"
#include "sensors/lidar/beam/plane_footprint.h"
#include "sensors/lidar/lidar_spec.h"
#include "sensors/lidar/pattern/firing_cycle.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace groundray {

/// One sweep: its pattern, and the poses of its sensor.
struct SweepPath {
  const ScanPattern& pattern;
  const Trajectory& X_DS;
  std::int64_t number = 0;
  std::chrono::nanoseconds stamp{0};
};

/// Traced pulses of a sweep: their origins, rays and hits. The buffers are reused.
class PulseTracer {
 public:
  /// Pose of S in D as a volley fires.
  struct SensorPose {
    glm::dmat3 R_DS{1};
    glm::dvec3 p_DS{0};
    float time_s = 0;  ///< since the sweep's stamp
  };
  /// Settings that follow from the spec alone.
  struct Settings {
    const LaserBeam& beam;
    int last_level = 0;       ///< last level of refinement
    double resolution_m = 0;  ///< pulses are refined if ranges of neighbours differ by more
    double angular_jitter_rad = 0;
    double far_m = 0;                         ///< end of the rays
    const PlaneQuadrature* planes = nullptr;  ///< pulses on a plane need no refinement
  };

  /// Casts pulses [begin, end) of a sweep.
  /// @param key  random key of the sweep.
  void cast(const SweepPath& sweep, std::int64_t begin, std::int64_t end, const Settings& settings,
            const RandomKey& key, const Scene& scene);

  std::size_t size() const { return pulses_.size(); }
  const PulseBatch& pulses() const { return pulses_; }
  /// Returns all rays, including those that a finer level of their pulse has replaced.
  std::span<const Ray> all_rays() const { return rays_; }
  std::span<const Hit> all_hits() const { return hits_; }

  /// Position of a pulse's rays among all rays.
  struct Range {
    std::uint32_t first = 0;
    std::uint32_t count = 1;
    int level = 0;
  };
  Range range(std::size_t pulse) const { return ranges_[pulse]; }
  std::span<const Ray> rays(std::size_t pulse) const {
    return std::span(rays_).subspan(ranges_[pulse].first, ranges_[pulse].count);
  }
  std::span<const Hit> hits(std::size_t pulse) const {
    return std::span(hits_).subspan(ranges_[pulse].first, ranges_[pulse].count);
  }
  const SensorPose& pose(std::size_t pulse) const { return poses_[volley_of_[pulse]]; }
  const Ray& axis(std::size_t pulse) const {
    return alone_ ? rays_[ranges_[pulse].first] : axes_[pulse];
  }

  PulseAxis pulse_axis(std::size_t pulse) const { return {axis(pulse), horizontals_[pulse]}; }

  /// Casts a pulse again with the sub-rays of a level, and stores their rays and hits in `rays` and
  /// `hits`.
  void cast_again(std::size_t pulse, int level, const LaserBeam& beam, const RandomKey& key,
                  const Scene& scene, std::vector<Ray>& rays, std::vector<Hit>& hits) const;

 private:
  void lay_axes(const SweepPath& sweep, std::int64_t begin, const Settings& settings,
                const RandomKey& key);
  void add_sub_rays(std::size_t pulse, int level, const LaserBeam& beam, const RandomKey& key,
                    Ray* out) const;
  bool is_coarse(std::size_t pulse, const Settings& settings) const;
  void refine(const Settings& settings, const RandomKey& key, const Scene& scene);

  std::int64_t begin_ = 0;
  PulseBatch pulses_;
  std::vector<SensorPose> poses_;         // by volley
  std::vector<std::uint32_t> volley_of_;  // by pulse
  bool alone_ = false;                    // true if each pulse has only one ray, its axis
  std::vector<Ray> axes_;                 // by pulse; empty if alone_
  std::vector<glm::dvec3> horizontals_;   // in D, by pulse
  std::vector<Range> ranges_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::vector<std::uint32_t> coarse_;
};

}  // namespace groundray
