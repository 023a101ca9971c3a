#pragma once

#include <limits>
#include <vector>

#include "sensors/radar_equation.h"

namespace groundray {

/// The law of the wavelength in haze's extinction: by Kruse (1962), or with Kim's exponents below
/// 6 km (2001), which let fog attenuate all wavelengths alike.
enum class HazeLaw { Kruse, Kim };

/// The air between a lidar and the ground, the same everywhere. The default is a vacuum.
struct AtmosphereSpec {
  static constexpr double none = std::numeric_limits<double>::infinity();
  double visibility_m = none;  ///< where 2 % of the contrast is left at 550 nm; infinite: no haze
  HazeLaw haze_law = HazeLaw::Kim;
  double fog_range_m = none;  ///< meteorological optical range: 5 % left; infinite: no fog
  double rain_mm_h = 0;
  double backscatter_per_m_sr = 0;  ///< of haze or rain, beside what fog scatters back
  double group_index = 1;           ///< of air: c / group velocity (air_group_index)
};

/// Where the receiver begins to see what the emitter lights up: nothing nearer than `none_below_m`,
/// all beyond `full_from_m`, linear between.
struct Overlap {
  double none_below_m = 0;
  double full_from_m = 0;
};

/// Returns the share of the light from a range that the receiver sees.
constexpr double overlap_share(const Overlap& overlap, double range_m) noexcept {
  if (range_m <= overlap.none_below_m) return 0;
  if (range_m >= overlap.full_from_m) return 1;
  return (range_m - overlap.none_below_m) / (overlap.full_from_m - overlap.none_below_m);
}

/// The ranges at which the return of the air is summed up: steps from 0 on.
struct SoftReturnGrid {
  double step_m = 0;
  double max_range_m = 0;
  double least_share = 0;  ///< ends where a step returns less than this share of the strongest one
};

/// What a stretch of air sends back, as if from one place.
struct SoftReturn {
  double range_m = 0;  ///< centre of its energy
  double energy_j = 0;
};

/// Haze, fog and rain at one wavelength. Immutable, so any number of threads may use one.
/// @see docs/lidar_atmosphere.md: formulas, their sources and limits.
class Atmosphere {
 public:
  /// @param wavelength_nm  of the laser, 400 to 2000.
  /// @throws Error listing every field of `spec` that is out of bounds.
  Atmosphere(const AtmosphereSpec& spec, double wavelength_nm);

  /// Returns the share of light that is left after `range_m` metres, one way (Beer-Lambert).
  double transmission(double range_m) const noexcept;

  double extinction_per_m() const noexcept { return extinction_per_m_; }
  double backscatter_per_m_sr() const noexcept { return backscatter_per_m_sr_; }
  double group_index() const noexcept { return group_index_; }

  /// Returns the energy that the air itself sends back from each step of `grid`, nearest first,
  /// to 1e-9 of each; steps that nothing comes from are left out. Nothing ends it but the grid:
  /// truncate it at the surface. Do this once for each lidar.
  /// @throws Error listing what is out of bounds in `overlap` and `grid`.
  /// @see Rasshofer et al., Influences of weather phenomena on automotive laser radar systems,
  ///      Adv. Radio Sci. 9 (2011): the soft target.
  std::vector<SoftReturn> soft_return(const RadarEquation& radar, const Overlap& overlap,
                                      const SoftReturnGrid& grid) const;

 private:
  double extinction_per_m_;
  double backscatter_per_m_sr_;
  double group_index_;
};

/// Returns the extinction of haze, 1/m, by visibility: (3.912 / V) (wavelength / 550 nm)^-q.
double haze_extinction_per_m(double visibility_m, double wavelength_nm, HazeLaw law) noexcept;

/// Returns the extinction of fog, 1/m: ln 20 / range, of any wavelength.
double fog_extinction_per_m(double fog_range_m) noexcept;

/// Returns what fog scatters back, 1/(m sr): 0.046 / range.
double fog_backscatter_per_m_sr(double fog_range_m) noexcept;

/// Returns the extinction of rain, 1/m, at a rate: 1.076 R^0.67 dB/km, of any wavelength.
double rain_extinction_per_m(double rain_mm_h) noexcept;

/// Returns the group index of dry air with 0.0375 % CO2, to 1e-6; saturated with water vapour it is
/// 0.9e-6 less at 20 degrees Celsius.
/// @param wavelength_nm  300 to 1700, in vacuum.
/// @param temperature_c  -40 to 100 degrees Celsius.
/// @param pressure_pa  10 000 to 140 000.
/// @throws Error if one is out of bounds.
/// @see Rueger, Refractive indices of light, infrared and radio waves in the atmosphere (2002),
///      the closed formula of IUGG resolution 3 (1999).
double air_group_index(double wavelength_nm, double temperature_c, double pressure_pa);

}  // namespace groundray
