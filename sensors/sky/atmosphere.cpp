#include "sensors/sky/atmosphere.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "sensors/normal_spread.h"

namespace groundray {
namespace {

constexpr double most_steps = 1e7;

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
    return std::exp(-2 * extinction_per_m_ * range_m) * std::min(seen, 1.) / (range_m * range_m);
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

double haze_exponent(double visibility_km, HazeLaw law) noexcept {
  if (visibility_km > 50) return 1.6;
  if (visibility_km > 6) return 1.3;
  if (law == HazeLaw::Kruse) return 0.585 * std::cbrt(visibility_km);
  if (visibility_km > 1) return 0.16 * visibility_km + 0.34;
  if (visibility_km > 0.5) return visibility_km - 0.5;
  return 0;
}

}  // namespace

double haze_extinction_per_m(double visibility_m, double wavelength_nm, HazeLaw law) noexcept {
  const double exponent = haze_exponent(visibility_m / 1000, law);
  return 3.912 / visibility_m * std::pow(wavelength_nm / 550, -exponent);
}

double fog_extinction_per_m(double fog_range_m) noexcept { return std::log(20.) / fog_range_m; }

// Rasshofer et al. (2011).
double fog_backscatter_per_m_sr(double fog_range_m) noexcept { return 0.046 / fog_range_m; }

// Carbonneau and Wisely (1998), as given by Kaushal and Kaddoum, IEEE Communications Surveys and
// Tutorials 19 (2017), section IV.
double rain_extinction_per_m(double rain_mm_h) noexcept {
  const double decibels_per_km = 1.076 * std::pow(rain_mm_h, 0.67);
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
  return std::exp(-extinction_per_m_ * range_m);
}

std::vector<SoftReturn> Atmosphere::soft_return(const RadarEquation& radar, const Overlap& overlap,
                                                const SoftReturnGrid& grid) const {
  check_overlap(overlap, grid);
  std::vector<SoftReturn> returns;
  const SoftTarget air(extinction_per_m_, overlap);
  const double energy_m_j = radar.energy_area_j_m2() * backscatter_per_m_sr_;
  const double first_step = std::floor(overlap.none_below_m / grid.step_m);
  double strongest_j = 0;
  for (double step = first_step; step * grid.step_m < grid.max_range_m; ++step) {
    const double far_m = std::min((step + 1) * grid.step_m, grid.max_range_m);
    const Moments moments = air.between(step * grid.step_m, far_m);
    const double energy_j = energy_m_j * moments.zeroth;
    strongest_j = std::max(strongest_j, energy_j);
    if (energy_j < grid.least_share * strongest_j) break;
    if (energy_j < std::numeric_limits<double>::min()) continue;
    returns.push_back({.range_m = moments.first / moments.zeroth, .energy_j = energy_j});
  }
  return returns;
}

}  // namespace groundray
