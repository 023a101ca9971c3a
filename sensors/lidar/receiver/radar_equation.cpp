#include "sensors/lidar/receiver/radar_equation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/math.h"
#include "sensors/lidar/receiver/normal_spread.h"

namespace groundray {
namespace {

using std::numbers::pi;
constexpr double most_steps = 1e7;

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

void check_overlap(const Overlap& overlap, const SoftReturnGrid& grid) {
  Violations broken("Soft return");
  broken.unless(overlap.none_below_m > 0, "none_below_m = {} must be positive",
                overlap.none_below_m);
  broken.unless(overlap.none_below_m < overlap.full_from_m && std::isfinite(overlap.full_from_m),
                "full_from_m = {} must be finite and greater than none_below_m = {}",
                overlap.full_from_m, overlap.none_below_m);
  broken.unless(grid.step_m > 0 && std::isfinite(grid.step_m),
                "step_m = {} must be positive and finite", grid.step_m);
  broken.unless(grid.max_range_m > 0 && std::isfinite(grid.max_range_m),
                "max_range_m = {} must be positive and finite", grid.max_range_m);
  broken.unless(!(grid.max_range_m / grid.step_m > most_steps),
                "max_range_m = {} needs more than {} steps of {} m", grid.max_range_m, most_steps,
                grid.step_m);
  broken.unless(grid.least_share >= 0 && grid.least_share < 1, "least_share = {} must be in [0, 1)",
                grid.least_share);
  broken.throw_if_any();
}

// Abramowitz and Stegun, Handbook of Mathematical Functions (1964), table 25.4: 8 points.
constexpr std::array gauss_legendre{QuadratureNode{0.1834346424956498, 0.3626837833783620},
                                    QuadratureNode{0.5255324099163290, 0.3137066458778873},
                                    QuadratureNode{0.7966664774136267, 0.2223810344533745},
                                    QuadratureNode{0.9602898564975363, 0.1012285362903763}};

// Integrals over range of the backscatter per metre, and of its product with the range.
struct Moments {
  double zeroth = 0;
  double first = 0;
};

// Integrand of the soft target: exp(-2 extinction r) overlap(r) / r^2.
class SoftTarget {
 public:
  SoftTarget(double extinction_per_m, const Overlap& overlap)
      : extinction_per_m_(extinction_per_m), overlap_(overlap) {}

  Moments between(double near_m, double far_m) const noexcept {
    Moments sum;
    double from = std::max(near_m, overlap_.none_below_m);
    while (from < far_m) {
      // Over at most an octave of range and four e-foldings, the error of 8 points is below 1e-10.
      double to = std::min({far_m, 2 * from, from + 2 / extinction_per_m_});
      if (from < overlap_.full_from_m) to = std::min(to, overlap_.full_from_m);
      if (!(to > from)) break;
      add_piece(from, to, sum);
      from = to;
    }
    return sum;
  }

 private:
  double at(double range_m) const noexcept {
    const double seen =
        (range_m - overlap_.none_below_m) / (overlap_.full_from_m - overlap_.none_below_m);
    return math::exp(-2 * extinction_per_m_ * range_m) * std::min(seen, 1.) / (range_m * range_m);
  }

  void add_piece(double from, double to, Moments& sum) const noexcept {
    const double middle = (from + to) / 2;
    const double half = (to - from) / 2;
    for (const QuadratureNode& node : gauss_legendre) {
      const double near = middle - half * node.position;
      const double far = middle + half * node.position;
      const double weight = half * node.weight;
      const double near_value = weight * at(near);
      const double far_value = weight * at(far);
      sum.zeroth += near_value + far_value;
      sum.first += near_value * near + far_value * far;
    }
  }

  double extinction_per_m_;
  Overlap overlap_;
};

}  // namespace

double cone_solid_angle_sr(double angle_rad) noexcept {
  const double s = math::sin(angle_rad / 4);
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

std::vector<SoftReturn> RadarEquation::soft_return(const Atmosphere& air, const Overlap& overlap,
                                                   const SoftReturnGrid& grid) const {
  check_overlap(overlap, grid);
  std::vector<SoftReturn> returns;
  const SoftTarget target(air.extinction_per_m(), overlap);
  const double energy_m_j = energy_area_j_m2_ * air.backscatter_per_m_sr();
  const double first_step = std::floor(overlap.none_below_m / grid.step_m);
  double strongest_j = 0;
  for (double step = first_step; step * grid.step_m < grid.max_range_m; ++step) {
    const double far_m = std::min((step + 1) * grid.step_m, grid.max_range_m);
    const Moments moments = target.between(step * grid.step_m, far_m);
    const double energy_j = energy_m_j * moments.zeroth;
    strongest_j = std::max(strongest_j, energy_j);
    if (energy_j < grid.least_share * strongest_j) break;
    if (energy_j < std::numeric_limits<double>::min()) continue;
    returns.push_back({.range_m = moments.first / moments.zeroth, .energy_j = energy_j});
  }
  return returns;
}

}  // namespace groundray
