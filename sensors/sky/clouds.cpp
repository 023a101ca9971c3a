#include "sensors/sky/clouds.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr double earth_radius_m = 6371e3;
constexpr double asymmetry = 0.85;    // of scattering by droplets in visible light
constexpr double diffusivity = 1.66;  // mean length of diffuse light's paths, relative to vertical
constexpr int octaves = 7;
constexpr double ramp = 0.12;        // of the noise, from a cloud's edge to its full depth
constexpr int samples_across = 160;  // for the threshold

double fade(double t) noexcept { return t * t * t * (t * (6 * t - 15) + 10); }

// Value noise from 0 to 1, on a lattice of spacing 1.
double lattice_noise(glm::dvec2 p, Seed variant, std::uint32_t octave) noexcept {
  const glm::dvec2 corner = glm::floor(p);
  const auto at = [&](int right, int up) {
    const glm::ivec2 cell = glm::ivec2(corner) + glm::ivec2(right, up);
    const RandomKey key{.seed = variant,
                        .sensor = 2000 + octave,
                        .frame = static_cast<std::uint32_t>(cell.x),
                        .pulse = static_cast<std::uint32_t>(cell.y),
                        .stream = RandomStream::Relief};
    return random_uniform(key).x;
  };
  const glm::dvec2 share(fade(p.x - corner.x), fade(p.y - corner.y));
  return glm::mix(glm::mix(at(0, 0), at(1, 0), share.x), glm::mix(at(0, 1), at(1, 1), share.x),
                  share.y);
}

// Fractal noise; octaves shorter than about two widths count as their mean.
double noise(glm::dvec2 p, double width, Seed variant) noexcept {
  double sum = 0, weights = 0, weight = 1, size = 0.5;
  for (std::uint32_t octave = 0; octave < octaves; ++octave) {
    const double kept = std::clamp(size / (2 * width) - 0.5, 0.0, 1.0);
    sum += weight * 0.5;
    if (kept > 0) sum += weight * kept * (lattice_noise(p / size, variant, octave) - 0.5);
    weights += weight;
    weight *= 0.55;
    size /= 2;
  }
  return sum / weights;
}

}  // namespace

Clouds::Clouds(const CloudSpec& spec) : spec_(spec) {
  Violations broken("Clouds");
  const auto in = [&](double value, double low, double high, const char* what) {
    broken.unless(low <= value && value <= high, "{} = {} must be from {} to {}", what, value, low,
                  high);
  };
  in(spec.cover, 0, 1, "cover");
  in(spec.optical_depth, 0, 1000, "optical_depth");
  in(spec.height_m, 100, 20e3, "height_m");
  in(spec.size_m, 10, 100e3, "size_m");
  broken.throw_if_any();
  if (spec.cover == 1) threshold_ = -std::numeric_limits<double>::infinity();
  if (spec.cover == 0) threshold_ = std::numeric_limits<double>::infinity();
  if (std::isinf(threshold_)) return;
  std::vector<double> values;
  for (int y = 0; y < samples_across; ++y) {
    for (int x = 0; x < samples_across; ++x)
      values.push_back(noise(0.37 * glm::dvec2(x, y), 0, spec.variant));
  }
  const auto clear =
      static_cast<std::ptrdiff_t>((1 - spec.cover) * static_cast<double>(values.size()));
  const auto at = values.begin() + std::min(clear, std::ssize(values) - 1);
  std::ranges::nth_element(values, at);
  threshold_ = *at;
}

double Clouds::vertical_depth(glm::dvec2 place_m, double width_m) const noexcept {
  if (std::isinf(threshold_)) return threshold_ < 0 ? spec_.optical_depth : 0;
  const double inside =
      noise(place_m / spec_.size_m, width_m / spec_.size_m, spec_.variant) - threshold_;
  return spec_.optical_depth * std::clamp(inside / ramp, 0.0, 1.0);
}

Clouds::Crossing Clouds::cross(const glm::dvec3& direction, double width_rad) const noexcept {
  const double climb_m = earth_radius_m * direction.z, height_m = spec_.height_m;
  const double distance_m =
      std::sqrt(climb_m * climb_m + height_m * (2 * earth_radius_m + height_m)) - climb_m;
  const double cosine = (climb_m + distance_m) / (earth_radius_m + height_m);
  return {vertical_depth(distance_m * glm::dvec2(direction), distance_m * width_rad / cosine),
          cosine};
}

double Clouds::sun_transmittance(const glm::dvec3& sun) const noexcept {
  return math::exp(-cross({sun.x, sun.y, std::max(sun.z, 0.0)}, 0).depth());
}

glm::dvec3 Clouds::radiance(const glm::dvec3& direction, double width_rad,
                            const Lighting& lighting) const noexcept {
  const Crossing crossing = cross(direction, width_rad);
  const double depth = crossing.vertical_depth;
  if (depth == 0) return lighting.clear_radiance;
  const double sun_cosine = std::max(cross(lighting.sun, 0).cosine, 1e-3);
  const double transmitted = 2 / (2 + (1 - asymmetry) * depth);  // two streams, Bohren (1987)
  const double direct = math::exp(-depth / sun_cosine);
  const glm::dvec3 diffuse =
      (lighting.sun_irradiance * std::max(lighting.sun.z, 0.0) *
           std::max(transmitted - direct, 0.0) +
       lighting.sky_irradiance * (transmitted - math::exp(-diffusivity * depth))) /
      std::numbers::pi;
  // Single scattering in the direction of the sun, which makes thin edges bright.
  const double cosine = glm::dot(direction, lighting.sun);
  const double aside = 1 + asymmetry * asymmetry - 2 * asymmetry * cosine;
  const double phase_per_sr =
      (1 - asymmetry * asymmetry) / (4 * std::numbers::pi * aside * std::sqrt(aside));
  const double through = math::exp(-crossing.depth());
  const double gap = 1 / crossing.cosine - 1 / sun_cosine;
  const double path = std::abs(gap * depth) < 1e-6 ? depth / crossing.cosine * direct
                                                   : (direct - through) / (gap * crossing.cosine);
  return lighting.clear_radiance * through + diffuse +
         lighting.sun_irradiance * (phase_per_sr * path);
}

}  // namespace groundray
