#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/random.h"
#include "core/scene.h"
#include "core/trajectory.h"
#include "sensors/beam.h"
#include "sensors/lidar_spec.h"
#include "sensors/pulse_batch.h"
#include "sensors/scan_pattern.h"

namespace groundray {

/// One sweep: when and from where its pulses leave.
struct SweepPath {
  const ScanPattern& pattern;
  const Trajectory& X_DS;
  std::int64_t number = 0;
  std::chrono::nanoseconds stamp{0};
};

/// Pulses of a sweep on their way: where they leave, their rays, and what these meet. Its buffers
/// are used again and again.
class PulseCast {
 public:
  /// Where S is as a volley fires.
  struct SensorPose {
    glm::dmat3 R_DS{1};
    glm::dvec3 p_DS{0};
    float time_s = 0;  ///< since the sweep's stamp
  };
  /// What follows from the spec alone.
  struct Settings {
    const LaserBeam& beam;
    int last_level = 0;       ///< up to which sub-rays are doubled
    double resolution_m = 0;  ///< doubled where neighbours' ranges differ by more
    double angular_jitter_rad = 0;
    double far_m = 0;  ///< rays end there
  };

  /// Casts pulses [begin, end) of a sweep.
  /// @param key  names the sweep.
  void cast(const SweepPath& sweep, std::int64_t begin, std::int64_t end, const Settings& settings,
            const RandomKey& key, const Scene& scene);

  std::size_t size() const { return pulses_.size(); }
  const PulseBatch& pulses() const { return pulses_; }
  /// Of all rays: those that were too few for their pulse, too.
  std::span<const Ray> all_rays() const { return rays_; }
  std::span<const Hit> all_hits() const { return hits_; }

  /// Where the rays of a pulse are among all.
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

  /// Casts a pulse again with the sub-rays of a level; returns their rays and hits, which last
  /// until the next call.
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
  bool alone_ = false;                    // pulses have one ray for ever: their axis
  std::vector<Ray> axes_;                 // by pulse, of those that are not alone
  std::vector<glm::dvec3> horizontals_;   // in D, by pulse
  std::vector<Range> ranges_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::vector<std::uint32_t> coarse_;
};

}  // namespace groundray
