#include "sensors/lidar/receiver/radar_equation.h"

#include <cmath>
#include <numbers>

#include "core/error.h"

namespace groundray {
namespace {

using std::numbers::pi;

void check_optics(const LidarOptics& optics) {
  Violations broken("LidarOptics");
  broken.unless(optics.pulse_energy_j > 0 && std::isfinite(optics.pulse_energy_j),
                "pulse_energy_j = {} must be positive and finite", optics.pulse_energy_j);
  broken.unless(optics.aperture_diameter_m > 0 && std::isfinite(optics.aperture_diameter_m),
                "aperture_diameter_m = {} must be positive and finite", optics.aperture_diameter_m);
  broken.unless(optics.emitter_efficiency > 0 && optics.emitter_efficiency <= 1,
                "emitter_efficiency = {} must be in (0, 1]: is it in percent?",
                optics.emitter_efficiency);
  broken.unless(optics.receiver_efficiency > 0 && optics.receiver_efficiency <= 1,
                "receiver_efficiency = {} must be in (0, 1]: is it in percent?",
                optics.receiver_efficiency);
  broken.throw_if_any();
}

}  // namespace

double cone_solid_angle_sr(double angle_rad) noexcept {
  const double s = std::sin(angle_rad / 4);
  return 4 * pi * s * s;
}

RadarEquation::RadarEquation(const LidarOptics& optics)
    : receiver_area_m2_(pi / 4 * optics.aperture_diameter_m * optics.aperture_diameter_m),
      receiver_efficiency_(optics.receiver_efficiency),
      energy_area_j_m2_(optics.pulse_energy_j * optics.emitter_efficiency *
                        optics.receiver_efficiency * receiver_area_m2_) {
  check_optics(optics);
}

double RadarEquation::solar_power_w(const SolarBackground& sun, double reflectance) const {
  Violations broken("SolarBackground");
  const double irradiance_w_m2_nm = sun.irradiance_w_m2_nm.value_or(0);
  broken.unless(irradiance_w_m2_nm >= 0, "irradiance_w_m2_nm = {} must be >= 0",
                irradiance_w_m2_nm);
  broken.unless(sun.filter_width_nm >= 0, "filter_width_nm = {} must be >= 0", sun.filter_width_nm);
  broken.unless(sun.field_of_view_sr >= 0 && sun.field_of_view_sr <= 2 * pi,
                "field_of_view_sr = {} must be in [0, 2 pi]: is it in degrees?",
                sun.field_of_view_sr);
  broken.unless(reflectance >= 0 && reflectance <= 1, "reflectance = {} must be in [0, 1]",
                reflectance);
  broken.throw_if_any();
  const double radiance_w_m2_sr = irradiance_w_m2_nm * sun.filter_width_nm * reflectance / pi;
  return radiance_w_m2_sr * sun.field_of_view_sr * receiver_area_m2_ * receiver_efficiency_;
}

}  // namespace groundray
