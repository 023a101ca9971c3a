#pragma once

#include <glm/vec3.hpp>
#include <optional>

namespace groundray {

/// What the radar equation needs to know of a lidar's optics.
struct LidarOptics {
  double pulse_energy_j = 0;       ///< in front of the emitter's optics
  double aperture_diameter_m = 0;  ///< of the receiver
  double emitter_efficiency = 1;   ///< share of the energy that leaves the emitter
  double receiver_efficiency = 1;  ///< share of the energy in the aperture that meets the detector
};

/// Sunlight that a receiver sees on a diffuse surface.
struct SolarBackground {
  /// By the sun at the laser's wavelength: with a `direction`, of a plane across its rays; else of
  /// all surfaces alike. Nothing for that of the scene's sun, or none.
  std::optional<double> irradiance_w_m2_nm;
  /// To the sun, unit, in D; a surface has the irradiance times its cosine, and none facing away.
  std::optional<glm::dvec3> direction;
  double filter_width_nm = 0;   ///< equivalent width of the receiver's optical filter
  double field_of_view_sr = 0;  ///< of one detector
};

/// Returns the solid angle of a cone of full angle `angle_rad`, in [0, 2 pi]: sr.
double cone_solid_angle_sr(double angle_rad) noexcept;

/// The radar equation of a lidar whose receiver sees the whole footprint. Ranges are much larger
/// than the aperture: an aperture of diameter D at range R gets (D / 2R)^2 less than said.
/// @see Wagner et al., Gaussian decomposition and calibration of a novel small-footprint
///      full-waveform digitising airborne laser scanner, ISPRS J. 60 (2006), section 2.
class RadarEquation {
 public:
  /// @throws Error listing every field of `optics` that is out of bounds.
  explicit RadarEquation(const LidarOptics& optics);

  /// Returns the energy that the detector gets from one sub-ray of a pulse, J.
  /// @param share  of the pulse's energy that the sub-ray carries.
  /// @param brdf_cos_per_sr  BRDF back to the source times cosine of incidence (retro_brdf_cos).
  /// @param range_m  > 0.
  /// @param transmission  of the air, one way.
  double received_energy_j(double share, double brdf_cos_per_sr, double range_m,
                           double transmission) const noexcept {
    const double fade = transmission / range_m;
    return energy_area_j_m2_ * share * brdf_cos_per_sr * (fade * fade);
  }

  /// Returns the sunlight that the detector gets, W, from a surface of hemispherical reflectance
  /// `reflectance` that fills the field of view. @throws Error if a figure is negative.
  double solar_power_w(const SolarBackground& sun, double reflectance) const;

  /// Energy of the pulse times efficiencies and area of the aperture: what `received_energy_j`
  /// multiplies.
  double energy_area_j_m2() const noexcept { return energy_area_j_m2_; }

 private:
  double receiver_area_m2_;
  double receiver_efficiency_;
  double energy_area_j_m2_;
};

}  // namespace groundray
