#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "sensors/sky/atmosphere.h"

namespace groundray {

/// Optics of a lidar, as far as the radar equation depends on them.
struct LidarOptics {
  double pulse_energy_j = 0;       ///< before the emitter's optics
  double aperture_diameter_m = 0;  ///< diameter of the receiver's aperture
  double emitter_efficiency = 1;   ///< fraction of the energy that leaves the emitter
  double receiver_efficiency = 1;  ///< fraction of the energy in the aperture that is detected
};

/// Sunlight that a receiver sees on a diffuse surface.
struct SolarBackground {
  /// Spectral irradiance by the sun at the laser's wavelength. With a `direction` it is that of a
  /// plane perpendicular to the sun's rays; otherwise it is the same on all surfaces. If absent, it
  /// is that of the scene's sun, or 0 without one.
  std::optional<double> irradiance_w_m2_nm;
  /// Unit vector to the sun, in D. A surface has the irradiance times the cosine between its normal
  /// and the sun, or 0 if it faces away.
  std::optional<glm::dvec3> direction;
  double filter_width_nm = 0;   ///< equivalent width of the receiver's optical filter
  double field_of_view_sr = 0;  ///< solid angle of one detector's view
};

/// Overlap of the emitter's beam and the receiver's field of view: 0 up to `none_below_m`, 1 from
/// `full_from_m` on, linear between.
struct Overlap {
  double none_below_m = 0;
  double full_from_m = 0;
};

/// Returns the overlap at a range: the fraction of its light that the receiver sees.
constexpr double overlap_share(const Overlap& overlap, double range_m) noexcept {
  if (range_m <= overlap.none_below_m) return 0;
  if (range_m >= overlap.full_from_m) return 1;
  return (range_m - overlap.none_below_m) / (overlap.full_from_m - overlap.none_below_m);
}

/// Range steps over which the backscatter of the air is integrated, starting at 0.
struct SoftReturnGrid {
  double step_m = 0;
  double max_range_m = 0;
  double least_share = 0;  ///< the grid ends at a step below this fraction of the strongest
};

/// Backscatter of one step of air, reduced to a single range.
struct SoftReturn {
  double range_m = 0;  ///< centroid of its energy
  double energy_j = 0;
};

/// Returns the solid angle, sr, of a cone of full angle `angle_rad` in [0, 2 pi].
double cone_solid_angle_sr(double angle_rad) noexcept;

/// Radar equation of a lidar whose receiver sees the whole footprint. Ranges must be much larger
/// than the aperture: an aperture of diameter D at range R actually receives less, by the fraction
/// (D / 2R)^2.
/// @see Wagner et al., Gaussian decomposition and calibration of a novel small-footprint
///      full-waveform digitising airborne laser scanner, ISPRS J. 60 (2006), section 2.
class RadarEquation {
 public:
  /// @throws Error listing every field of `optics` that is out of bounds.
  explicit RadarEquation(const LidarOptics& optics);

  /// Returns the energy that the detector receives from one sub-ray of a pulse, J.
  /// @param share  fraction of the pulse's energy that the sub-ray carries.
  /// @param brdf_cos_per_sr  BRDF back to the source times cosine of incidence (retro_brdf_cos).
  /// @param range_m  > 0.
  /// @param transmission  one-way transmission of the air.
  double received_energy_j(double share, double brdf_cos_per_sr, double range_m,
                           double transmission) const noexcept {
    const double fade = transmission / range_m;
    return energy_area_j_m2_ * share * brdf_cos_per_sr * (fade * fade);
  }

  /// Returns the power of sunlight, W, that the detector receives from a surface of hemispherical
  /// reflectance `reflectance` that fills the field of view.
  /// @throws Error listing all values that are out of bounds.
  double solar_power_w(const SolarBackground& sun, double reflectance) const;

  /// Returns the energy that the air scatters back from each step of `grid`, nearest first, with a
  /// relative error of at most 1e-9. Steps without energy are omitted. Surfaces are not considered:
  /// truncate the result at the surface. It is the same for all pulses of a lidar.
  /// @throws Error listing all values that are out of bounds in `overlap` and `grid`.
  /// @see Rasshofer et al., Influences of weather phenomena on automotive laser radar systems, Adv.
  ///      Radio Sci. 9 (2011): the soft target.
  std::vector<SoftReturn> soft_return(const Atmosphere& air, const Overlap& overlap,
                                      const SoftReturnGrid& grid) const;

  /// Returns the energy of the pulse times the efficiencies and the area of the aperture: the
  /// constant factor of `received_energy_j`.
  double energy_area_j_m2() const noexcept { return energy_area_j_m2_; }

 private:
  double receiver_area_m2_;
  double receiver_efficiency_;
  double energy_area_j_m2_;
};

}  // namespace groundray
