#include "sensors/sky/atmosphere.h"

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

void check_atmosphere(const AtmosphereSpec& spec, double wavelength_nm) {
  Violations broken("AtmosphereSpec");
  broken.unless(spec.visibility_m > 0, "visibility_m = {} must be positive, or infinite",
                spec.visibility_m);
  broken.unless(spec.fog_range_m > 0, "fog_range_m = {} must be positive, or infinite",
                spec.fog_range_m);
  broken.unless(std::isinf(spec.visibility_m) || std::isinf(spec.fog_range_m),
                "visibility_m = {} and fog_range_m = {} are alternatives: give one of them",
                spec.visibility_m, spec.fog_range_m);
  broken.unless(spec.rain_mm_h >= 0 && std::isfinite(spec.rain_mm_h),
                "rain_mm_h = {} must be >= 0 and finite", spec.rain_mm_h);
  broken.unless(spec.backscatter_per_m_sr >= 0 && std::isfinite(spec.backscatter_per_m_sr),
                "backscatter_per_m_sr = {} must be >= 0 and finite", spec.backscatter_per_m_sr);
  broken.unless(spec.group_index >= 1 && spec.group_index < 1.001,
                "group_index = {} must be in [1, 1.001): that of air is about 1.0003",
                spec.group_index);
  broken.unless(wavelength_nm >= 400 && wavelength_nm <= 2000,
                "the laser's wavelength = {} nm must be in [400, 2000]", wavelength_nm);
  broken.throw_if_any();
}

double haze_exponent(double visibility_km, HazeLaw law) noexcept {
  if (visibility_km > 50) return 1.6;
  if (visibility_km > 6) return 1.3;
  if (law == HazeLaw::Kruse) return 0.585 * math::cbrt(visibility_km);
  if (visibility_km > 1) return 0.16 * visibility_km + 0.34;
  if (visibility_km > 0.5) return visibility_km - 0.5;
  return 0;
}

}  // namespace

double haze_extinction_per_m(double visibility_m, double wavelength_nm, HazeLaw law) noexcept {
  const double exponent = haze_exponent(visibility_m / 1000, law);
  return 3.912 / visibility_m * math::pow(wavelength_nm / 550, -exponent);
}

double fog_extinction_per_m(double fog_range_m) noexcept { return math::log(20.) / fog_range_m; }

// Rasshofer et al. (2011).
double fog_backscatter_per_m_sr(double fog_range_m) noexcept { return 0.046 / fog_range_m; }

// Carbonneau and Wisely (1998), as given by Kaushal and Kaddoum, IEEE Communications Surveys and
// Tutorials 19 (2017), section IV.
double rain_extinction_per_m(double rain_mm_h) noexcept {
  const double decibels_per_km = 1.076 * math::pow(rain_mm_h, 0.67);
  return decibels_per_km * std::numbers::ln10 / 10 / 1000;
}

double air_group_index(double wavelength_nm, double temperature_c, double pressure_pa) {
  Violations broken("Group index of air");
  broken.unless(wavelength_nm >= 300 && wavelength_nm <= 1700,
                "wavelength_nm = {} must be in [300, 1700]", wavelength_nm);
  broken.unless(temperature_c >= -40 && temperature_c <= 100,
                "temperature_c = {} must be in [-40, 100]: is it in kelvins?", temperature_c);
  broken.unless(pressure_pa >= 10'000 && pressure_pa <= 140'000,
                "pressure_pa = {} must be in [10000, 140000]: is it in hectopascals?", pressure_pa);
  broken.throw_if_any();
  const double per_um2 = 1e6 / (wavelength_nm * wavelength_nm);
  const double standard = 287.6155 + per_um2 * (4.88660 + per_um2 * 0.06800);
  const double density = (273.15 / (temperature_c + 273.15)) * (pressure_pa / 101'325);
  return 1 + 1e-6 * standard * density;
}

Atmosphere::Atmosphere(const AtmosphereSpec& spec, double wavelength_nm)
    : extinction_per_m_(haze_extinction_per_m(spec.visibility_m, wavelength_nm, spec.haze_law) +
                        fog_extinction_per_m(spec.fog_range_m) +
                        rain_extinction_per_m(spec.rain_mm_h)),
      backscatter_per_m_sr_(fog_backscatter_per_m_sr(spec.fog_range_m) + spec.backscatter_per_m_sr),
      group_index_(spec.group_index) {
  check_atmosphere(spec, wavelength_nm);
}

double Atmosphere::transmission(double range_m) const noexcept {
  return math::exp(-extinction_per_m_ * range_m);
}

}  // namespace groundray
