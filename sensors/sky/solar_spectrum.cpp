#include "sensors/sky/solar_spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "core/error.h"

namespace groundray {
namespace {

struct Row {
  double wavelength_nm;
  double irradiance_w_m2_nm;
  double water, ozone, mixed;  // absorption coefficients
  double rgb_nm[3];
};
constexpr Row spectrum_table[] = {
#include <sky/solar_spectrum.inc>
};

// Returns the air mass of an ozone layer at a height of 22 km: Bird and Riordan, equation 2-10.
double ozone_mass(double elevation_rad) {
  constexpr double height = 22.0 / 6370;
  const double sine = std::max(std::sin(elevation_rad), 0.0);
  return (1 + height) / std::sqrt(sine * sine + 2 * height);
}

// Transmission of the air at a row's wavelength: Bird and Riordan, section 2.
class Transmission {
 public:
  Transmission(double elevation_rad, const ClearAir& air)
      : mass_(air_mass(elevation_rad)),
        pressure_mass_(mass_ * air.pressure_hpa / 1013),
        water_(air.water_cm * mass_),
        ozone_(air.ozone_cm * ozone_mass(elevation_rad)),
        // Preetham, Shirley and Smits, A practical analytic model for daylight (1999), appendix 1.
        aerosol_(mass_ * std::max(0.04608 * air.turbidity - 0.04586, 0.0)) {}

  double of(const Row& row) const {
    const double um = row.wavelength_nm / 1000, um2 = um * um;
    const double rayleigh = pressure_mass_ / (um2 * um2 * (115.6406 - 1.3366 / um2));
    const double aerosol = aerosol_ * std::pow(um, -1.3);
    const double water = row.water * water_;
    const double mixed = row.mixed * pressure_mass_;
    return std::exp(-rayleigh - aerosol - row.ozone * ozone_ -
                    0.2385 * water / std::pow(1 + 20.07 * water, 0.45) -
                    1.41 * mixed / std::pow(1 + 118.3 * mixed, 0.45));
  }

 private:
  double mass_;
  double pressure_mass_;
  double water_;
  double ozone_;
  double aerosol_;
};

}  // namespace

void check_air(const ClearAir& air) {
  Violations broken("ClearAir");
  broken.unless(air.turbidity >= 1 && air.turbidity <= 10, "turbidity = {} must be in [1, 10]",
                air.turbidity);
  broken.unless(air.water_cm >= 0 && air.water_cm <= 20,
                "water_cm = {} must be in [0, 20]: is it in millimetres?", air.water_cm);
  broken.unless(air.ozone_cm >= 0 && air.ozone_cm <= 1,
                "ozone_cm = {} must be in [0, 1]: is it in Dobson units (1/1000 cm)?",
                air.ozone_cm);
  broken.unless(air.pressure_hpa >= 100 && air.pressure_hpa <= 1100,
                "pressure_hpa = {} must be in [100, 1100]: is it in Pa?", air.pressure_hpa);
  broken.throw_if_any();
}

double air_mass(double elevation_rad) noexcept {
  const double degrees = std::max(glm::degrees(elevation_rad), 0.0);
  return 1 / (std::sin(glm::radians(degrees)) + 0.50572 * std::pow(degrees + 6.07995, -1.6364));
}

double direct_irradiance_w_m2_nm(double wavelength_nm, double elevation_rad, const ClearAir& air) {
  check_air(air);
  const Row& first = *std::begin(spectrum_table);
  const Row& last = *(std::end(spectrum_table) - 1);
  if (!(wavelength_nm >= first.wavelength_nm && wavelength_nm <= last.wavelength_nm)) {
    throw Error("Sunlight: wavelength {} nm must be in [{}, {}]", wavelength_nm,
                first.wavelength_nm, last.wavelength_nm);
  }
  const Row* above =
      std::ranges::lower_bound(std::begin(spectrum_table) + 1, std::end(spectrum_table),
                               wavelength_nm, {}, &Row::wavelength_nm);
  const Row* below = above - 1;
  const Transmission transmission(elevation_rad, air);
  const auto irradiance = [&](const Row& row) {
    return row.irradiance_w_m2_nm * transmission.of(row);
  };
  return glm::mix(
      irradiance(*below), irradiance(*above),
      (wavelength_nm - below->wavelength_nm) / (above->wavelength_nm - below->wavelength_nm));
}

glm::dvec3 direct_irradiance_rgb(double elevation_rad, const ClearAir& air) {
  check_air(air);
  const Transmission transmission(elevation_rad, air);
  glm::dvec3 sum(0);
  for (const Row& row : spectrum_table) {
    sum += row.irradiance_w_m2_nm * transmission.of(row) *
           glm::dvec3(row.rgb_nm[0], row.rgb_nm[1], row.rgb_nm[2]);
  }
  return glm::max(sum, glm::dvec3(0));  // the reddest light near the horizon is outside sRGB
}

}  // namespace groundray
