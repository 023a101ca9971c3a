#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/material.h"
#include "core/random.h"
#include "core/scene.h"
#include "sensors/atmosphere.h"
#include "sensors/beam.h"
#include "sensors/lidar_spec.h"
#include "sensors/radar_equation.h"
#include "sensors/receiver.h"

namespace groundray {

/// What the surfaces of a scene send back at a laser's wavelength.
class RetroBrdfs {
 public:
  /// @param beam  for what a sub-ray sees of a texture.
  /// @throws Error as retro_brdf, of any of the scene's materials.
  RetroBrdfs(const Scene& scene, double wavelength_nm, const LaserBeam& beam);

  /// What a surface does with light.
  struct Reflection {
    double retro_cos_per_sr = 0;  ///< f_r cos, see retro_brdf_cos
    double albedo = 0;
  };
  /// Returns that of a surface that a sub-ray met.
  /// @param sub_rays  how many the pulse has: each sees its share of the beam's area.
  Reflection reflection_of(const Ray& ray, const Hit& hit, std::size_t sub_rays) const noexcept {
    const double cosine = std::max(-glm::dot(ray.direction, glm::dvec3(hit.normal)), 0.0);
    if (!is_plain_) [[unlikely]]
      return varied_reflection(ray, hit, cosine, sub_rays);
    const RetroBrdf& brdf =
        hit.object == 0 ? ground_ : by_material_[scene_.truth_of(ray, hit).material];
    return {retro_brdf_cos(brdf, cosine), brdf.albedo};
  }

 private:
  Reflection varied_reflection(const Ray& ray, const Hit& hit, double cosine,
                               std::size_t sub_rays) const noexcept;

  const Scene& scene_;
  std::span<const RetroBrdf> by_material_;
  RetroBrdf ground_;
  bool is_plain_;
  const LaserBeam& beam_;
};

/// What came back of a pulse: an echo, and the truth about it.
struct Echo {
  /// Where an echo comes from.
  enum class Kind : std::uint8_t { Surface, Air, FalseAlarm };
  Detection detection;
  Kind kind = Kind::Surface;
  // Of the surface that most of its energy comes from, weighed by energy:
  double range_m = 0;            ///< from where the beam leaves
  glm::dvec3 p_DQ{0};            ///< in D
  glm::vec3 normal{0};           ///< unit, axes of D
  float share = 0;               ///< of the echo's energy, that of the air included
  float second_share = 0;        ///< that of the surface with the most energy but for this one
  std::uint32_t hit = 0;         ///< of the surface, the strongest: index among the pulse's hits
  std::uint32_t second_hit = 0;  ///< of the other surface, if it has a share
  float deviation_m = 0;         ///< the largest of its hits'
  double bound_m = 0;            ///< the largest error bound of its hits, if these have any
};

/// Why a pulse has no echo.
enum class NoReturn : std::uint8_t {
  Sky,             ///< it meets nothing
  OutOfGate,       ///< all that it meets is nearer or farther than the range gate
  BelowThreshold,  ///< what comes back is too weak
  Absorbed,        ///< and would not be but for the air
  Blanked,         ///< an echo, but not one that the sensor is asked to report
};

/// Hits of one object whose ranges follow each other closely.
struct LitSurface {
  std::uint32_t object = 0;
  double last_m = 0;
  double energy_j = 0;
  double strongest_j = 0;
  std::size_t strongest = 0;  ///< arrival
};

/// Energy, air and electronics of a lidar: from the hits of a pulse's sub-rays to echoes.
/// Immutable, so any number of threads may use one.
class Light {
 public:
  /// Buffers of one thread, for pulse after pulse.
  struct Workspace {
    std::vector<std::uint32_t> order;       ///< the sub-rays that met something, by range
    std::vector<Arrival> arrivals;          ///< in that order
    std::vector<LitSurface> surfaces;       ///< that an echo's energy comes from
    std::vector<std::uint32_t> surface_of;  ///< of its arrivals
    double sunlit = 0;  ///< mean over sub-rays of albedo times cosine: the sunlight that is seen
    Waveform waveform;
    Detections detections;
    std::vector<Echo> echoes;         ///< of the last pulse, by reported range
    NoReturn reason = NoReturn::Sky;  ///< of the last pulse, if it has no echo
    std::vector<float> air_w;         ///< what the air sends back, from the first bin of it on
    Waveform clear_waveform;          ///< as it would be without air
  };

  /// @throws Error listing what is out of bounds in `spec` and `air`.
  Light(const LightSpec& spec, const AtmosphereSpec& air, const RangeGate& gate);

  const LightSpec& spec() const { return spec_; }
  double interval_s() const { return receiver_.interval_s(); }     ///< between a waveform's samples
  double threshold_w() const { return receiver_.threshold_w(0); }  ///< of the receiver in the dark
  /// How far apart the ranges of neighbouring sub-rays may be: c FWHM / 4.
  double resolution_m() const { return resolution_m_; }

  /// Finds the echoes of one pulse.
  /// @param hits  one for each of `rays`, which share the pulse's energy equally.
  /// @param bounds_m  of the hits' ranges; may be empty.
  /// @param brdfs  of what they hit.
  void receive(std::span<const Ray> rays, std::span<const Hit> hits,
               std::span<const double> bounds_m, const RetroBrdfs& brdfs, const RandomKey& key,
               Workspace& work) const noexcept;

  /// Returns what the sensor reports as the intensity of an echo.
  float intensity(const Detection& detection) const noexcept;
  /// Returns what the sensor reports of a range that it measures: the nearest of its steps.
  double reported_m(double range_m) const noexcept;
  /// Returns the standard deviation of what it reports of a range measured with this one: steps add
  /// that of a uniform number.
  double reported_sd_m(double sd_m) const noexcept;

 private:
  void collect(std::span<const Ray> rays, std::span<const Hit> hits, const RetroBrdfs& brdfs,
               double extinction_per_m, Workspace& work) const noexcept;
  double sun_cosine(const glm::vec3& normal) const noexcept {
    if (!spec_.sun.direction) return 1;
    return std::max(glm::dot(glm::dvec3(normal), *spec_.sun.direction), 0.0);
  }
  void add_air(std::span<const Hit> hits, Workspace& work) const noexcept;
  void tell_truth(std::span<const Ray> rays, std::span<const Hit> hits,
                  std::span<const double> bounds_m, const Detection& detection,
                  Workspace& work) const noexcept;
  NoReturn reason_for_none(std::span<const Ray> rays, std::span<const Hit> hits,
                           const RetroBrdfs& brdfs, Workspace& work) const noexcept;
  double air_energy_j(const Detection& detection, const Workspace& work) const noexcept;
  void sample_air(const AtmosphereSpec& air);

  LightSpec spec_;
  RangeGate gate_;
  Atmosphere atmosphere_;
  RadarEquation radar_;
  Receiver receiver_;
  double resolution_m_;
  double perpendicular_w_m2_;  // peak power times range squared, of a white Lambertian target
  double sun_w_;               // of a white surface that faces the sun
  std::int64_t first_air_bin_ = 0;
  std::vector<float> air_w_;  // what the air sends back if nothing ends it, from that bin on
};

}  // namespace groundray
