#pragma once

#include <limits>
#include <vector>

#include "sensors/lidar/receiver/radar_equation.h"

namespace groundray {

/// Model of the exponent of wavelength in haze's extinction: Kruse (1962), or Kim (2001). They
/// differ below a visibility of 6 km; below 0.5 km, Kim's model attenuates all wavelengths equally.
enum class HazeLaw { Kruse, Kim };

/// Air between a lidar and the ground, homogeneous. The default is a vacuum.
struct AtmosphereSpec {
  static constexpr double none = std::numeric_limits<double>::infinity();
  double visibility_m = none;  ///< range of 2 % contrast at 550 nm; infinite: no haze
  HazeLaw haze_law = HazeLaw::Kim;
  double fog_range_m = none;  ///< meteorological optical range: 5 % contrast; infinite: no fog
  double rain_mm_h = 0;
  double backscatter_per_m_sr = 0;  ///< coefficient of haze or rain, added to that of fog
  double group_index = 1;  ///< group index of the air: c / group velocity (air_group_index)
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

/// Air with haze, fog and rain at one wavelength. Immutable and therefore thread-safe.
/// @see docs/theory/lidar_atmosphere.md: formulas, their sources and limits.
class Atmosphere {
 public:
  /// @param wavelength_nm  wavelength of the laser, 400 to 2000.
  /// @throws Error listing every field of `spec` that is out of bounds.
  Atmosphere(const AtmosphereSpec& spec, double wavelength_nm);

  /// Returns the one-way transmission over `range_m` metres (Beer-Lambert).
  double transmission(double range_m) const noexcept;

  double extinction_per_m() const noexcept { return extinction_per_m_; }
  double backscatter_per_m_sr() const noexcept { return backscatter_per_m_sr_; }
  double group_index() const noexcept { return group_index_; }

  /// Returns the energy that the air scatters back from each step of `grid`, nearest first, with a
  /// relative error of at most 1e-9. Steps without energy are omitted. Surfaces are not considered:
  /// truncate the result at the surface. It is the same for all pulses of a lidar.
  /// @throws Error listing all values that are out of bounds in `overlap` and `grid`.
  /// @see Rasshofer et al., Influences of weather phenomena on automotive laser radar systems, Adv.
  ///      Radio Sci. 9 (2011): the soft target.
  std::vector<SoftReturn> soft_return(const RadarEquation& radar, const Overlap& overlap,
                                      const SoftReturnGrid& grid) const;

 private:
  double extinction_per_m_;
  double backscatter_per_m_sr_;
  double group_index_;
};

/// Returns the extinction of haze, 1/m, at a visibility V: (3.912 / V) (wavelength / 550 nm)^-q.
double haze_extinction_per_m(double visibility_m, double wavelength_nm, HazeLaw law) noexcept;

/// Returns the extinction of fog, 1/m, at any wavelength: ln 20 / range.
double fog_extinction_per_m(double fog_range_m) noexcept;

/// Returns the backscatter coefficient of fog, 1/(m sr): 0.046 / range.
double fog_backscatter_per_m_sr(double fog_range_m) noexcept;

/// Returns the extinction of rain, 1/m, at any wavelength: 1.076 R^0.67 dB/km at the rate R.
double rain_extinction_per_m(double rain_mm_h) noexcept;

/// Returns the group index of dry air with 0.0375 % CO2, accurate to 1e-6. Saturation with water
/// vapour reduces it by 0.9e-6 at 20 degrees Celsius.
/// @param wavelength_nm  in vacuum, 300 to 1700.
/// @param temperature_c  -40 to 100 degrees Celsius.
/// @param pressure_pa  10 000 to 140 000.
/// @throws Error if an argument is out of bounds.
/// @see Rueger, Refractive indices of light, infrared and radio waves in the atmosphere (2002), the
///      closed formula of IUGG resolution 3 (1999).
double air_group_index(double wavelength_nm, double temperature_c, double pressure_pa);

}  // namespace groundray
