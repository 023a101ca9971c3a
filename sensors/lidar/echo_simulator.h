#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/appearance/material.h"
#include "core/random.h"
#include "core/tracing/scene.h"
#include "sensors/lidar/beam/beam.h"
#include "sensors/lidar/lidar_spec.h"
#include "sensors/lidar/receiver/radar_equation.h"
#include "sensors/lidar/receiver/receiver.h"
#include "sensors/sky/atmosphere.h"

namespace groundray {

/// Reflection of the scene's surfaces back to the source, at a laser's wavelength.
class RetroBrdfs {
 public:
  /// @param beam  defines the footprint of a sub-ray on a texture.
  /// @throws Error as retro_brdf, for any of the scene's materials, or if a surface has a material
  ///         that the scene lacks.
  RetroBrdfs(const Scene& scene, double wavelength_nm, const LaserBeam& beam);

  /// Reflection properties of a surface.
  struct Reflection {
    double retro_cos_per_sr = 0;  ///< BRDF back to the source times cosine of incidence
    double albedo = 0;
  };
  /// Returns the reflection of the surface that a sub-ray hits.
  /// @param sub_rays  number of sub-rays of the pulse; each covers an equal part of the beam's
  ///        area.
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

/// Sub-rays of a pulse.
struct LitPulse {
  std::span<const Ray> rays;
  std::span<const Hit> hits;         ///< one for each of `rays`
  std::span<const double> shares;    ///< of the pulse's energy, one for each; empty if equal
  std::span<const double> bounds_m;  ///< error bounds of the hits' ranges; may be empty
  std::size_t traced = 0;  ///< number of sub-rays that share the beam's area, for textures
};

/// Echo of a pulse and the ground truth about it.
struct Echo {
  /// Origin of an echo.
  enum class Kind : std::uint8_t { Surface, Air, FalseAlarm };
  Detection detection;
  Kind kind = Kind::Surface;
  // Surface with the most energy; means are weighted by energy:
  double range_m = 0;            ///< from the beam's origin
  glm::dvec3 p_DQ{0};            ///< in D
  glm::vec3 normal{0};           ///< unit, axes of D
  float share = 0;               ///< fraction of the echo's energy, which includes that of the air
  float second_share = 0;        ///< fraction of the surface with the next most energy
  std::uint32_t hit = 0;         ///< strongest hit on the surface: index among the pulse's hits
  std::uint32_t second_hit = 0;  ///< the same for the second surface, if second_share > 0
  float deviation_m = 0;         ///< largest deviation of its hits
  double bound_m = 0;            ///< largest error bound of its hits, if bounds are given
};

/// Reason why a pulse has no echo.
enum class NoReturn : std::uint8_t {
  Sky,             ///< no sub-ray hits anything
  OutOfGate,       ///< everything that the sub-rays hit is nearer or farther than the range gate
  BelowThreshold,  ///< the returned light is too weak
  Absorbed,        ///< too weak only because of the air
  Blanked,         ///< there is an echo, but Returns omits it
};

/// Hits of one object that lie in one plane, or whose ranges the pulse does not resolve.
struct LitSurface {
  std::uint32_t object = 0;
  std::size_t last = 0;  ///< index of the farthest arrival
  double energy_j = 0;
  double strongest_j = 0;
  std::size_t strongest = 0;  ///< index of the strongest arrival
};

/// Radiometry, air and electronics of a lidar: converts the hits of a pulse's sub-rays to echoes.
/// Immutable and therefore thread-safe.
class EchoSimulator {
 public:
  /// Buffers of one thread, reused for every pulse.
  struct Workspace {
    std::vector<std::uint32_t> order;  ///< sub-rays with a hit, by range
    std::vector<Arrival> arrivals;     ///< in the same order
    std::vector<double> seen;  ///< share of the pulse's energy that the receiver sees, likewise
    std::vector<LitSurface> surfaces;       ///< surfaces that contribute to an echo
    std::vector<std::uint32_t> surface_of;  ///< surface of each of the echo's arrivals
    double sunlit = 0;  ///< mean of albedo times the sun's cosine; 0 if no sunlight is received
    Waveform waveform;
    Detections detections;
    std::vector<Echo> echoes;         ///< echoes of the last pulse, by reported range
    NoReturn reason = NoReturn::Sky;  ///< reason if the last pulse has no echo
    std::vector<float> air_w;         ///< power from the air, starting at its first bin
    Waveform clear_waveform;          ///< waveform without air
  };

  /// @throws Error listing all values that are out of bounds in `spec` and `air`.
  EchoSimulator(const LightSpec& spec, const AtmosphereSpec& air, const RangeGate& gate);

  const LightSpec& spec() const { return spec_; }
  double interval_s() const { return receiver_.interval_s(); }     ///< between a waveform's samples
  double threshold_w() const { return receiver_.threshold_w(0); }  ///< in the dark
  /// Returns the largest difference between the ranges of neighbouring sub-rays that needs no
  /// refinement: c FWHM / 4.
  double resolution_m() const { return resolution_m_; }
  /// Returns the spacing in range at which equal returns add up to a smooth waveform.
  double even_spacing_m() const;

  /// Finds the echoes of one pulse and stores them in `work`.
  /// @param brdfs  reflection of the surfaces.
  void receive(const LitPulse& pulse, const RetroBrdfs& brdfs, const RandomKey& key,
               Workspace& work) const;

  /// Returns the intensity that the sensor reports for an echo.
  float intensity(const Detection& detection) const noexcept;
  /// Returns the range that the sensor reports for a measured range: the nearest multiple of its
  /// step.
  double reported_m(double range_m) const noexcept;
  /// Returns the standard deviation of the reported range, given that of the measured range; steps
  /// add the variance of a uniform distribution.
  double reported_sd_m(double sd_m) const noexcept;

 private:
  void collect(const LitPulse& pulse, const RetroBrdfs& brdfs, double extinction_per_m,
               Workspace& work) const;
  double sun_cosine(const glm::vec3& normal) const noexcept {
    if (!spec_.sun.direction) return 1;
    return std::max(glm::dot(glm::dvec3(normal), *spec_.sun.direction), 0.0);
  }
  void add_air(const LitPulse& pulse, Workspace& work) const;
  void attribute_echo(const LitPulse& pulse, const Detection& detection, Workspace& work) const;
  NoReturn reason_for_none(const LitPulse& pulse, const RetroBrdfs& brdfs, Workspace& work) const;
  double air_energy_j(const Detection& detection, const Workspace& work) const noexcept;
  void sample_air(const AtmosphereSpec& air);

  LightSpec spec_;
  RangeGate gate_;
  Atmosphere atmosphere_;
  RadarEquation radar_;
  Receiver receiver_;
  double resolution_m_;
  double perpendicular_w_m2_;  // peak power times squared range, for a white Lambertian target
  double sun_w_;               // power of sunlight from a white surface that faces the sun
  std::int64_t first_air_bin_ = 0;
  std::vector<float> air_w_;  // power from the air in the absence of surfaces, from that bin on
};

}  // namespace groundray
