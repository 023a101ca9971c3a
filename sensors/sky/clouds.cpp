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
constexpr double fading = 0.5;  // weight of an octave relative to the one before
constexpr double all_weights = (1 - 1.0 / (1 << octaves)) / (1 - fading);
constexpr int side = 256;            // of an octave's lattice, after which it repeats
constexpr double ramp = 0.25;        // of the noise, from a cloud's edge to its full thickness
constexpr int samples_across = 160;  // for the threshold
constexpr int least_steps = 16;      // of a path through the layer
constexpr double haze_m = 25e3;      // distance at which haze hides 1 - 1/e of a cloud
constexpr int halvings = 5;          // of the step in which a path enters a cloud
constexpr int steps_to_sun = 16;
constexpr double step_share = 0.03;  // of the distance: length of longer paths' steps
constexpr double lowest_sun = 0.05;  // sine of its elevation, for paths towards it
constexpr double opaque = 12;        // optical depth behind which nothing is seen

double fade(double t) noexcept { return t * t * t * (t * (6 * t - 15) + 10); }

// Returns the share of light that a layer passes: two streams, Bohren (1987).
double transmitted(double depth) noexcept { return 2 / (2 + (1 - asymmetry) * depth); }

// Returns the phase function of Henyey and Greenstein, 1/sr.
double phase_per_sr(double cosine) noexcept {
  const double aside = 1 + asymmetry * asymmetry - 2 * asymmetry * cosine;
  return (1 - asymmetry * asymmetry) / (4 * std::numbers::pi * aside * std::sqrt(aside));
}

std::vector<float> random_lattice(Seed variant) {
  std::vector<float> lattice(std::size_t{octaves} * side * side);
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const RandomKey key{.seed = variant,
                        .sensor = 2000,
                        .frame = 0,
                        .pulse = static_cast<std::uint32_t>(i),
                        .stream = RandomStream::Relief};
    lattice[i] = static_cast<float>(random_uniform(key).x);
  }
  return lattice;
}

// Value noise from 0 to 1, on a lattice of spacing 1.
double lattice_noise(glm::dvec2 p, const float* lattice) noexcept {
  const glm::dvec2 corner = glm::floor(p);
  const glm::ivec2 cell(corner);
  const auto at = [&](int right, int up) {
    return double{lattice[((cell.y + up) & (side - 1)) * side + ((cell.x + right) & (side - 1))]};
  };
  const glm::dvec2 share(fade(p.x - corner.x), fade(p.y - corner.y));
  return glm::mix(glm::mix(at(0, 0), at(1, 0), share.x), glm::mix(at(0, 1), at(1, 1), share.x),
                  share.y);
}

}  // namespace

// Returns fractal noise; octaves shorter than about two widths count as their mean. Each octave is
// turned against the previous one, so that their lattices do not show. Once the rest cannot reach
// the threshold, the sum so far is returned.
double Clouds::noise(glm::dvec2 p, double width) const noexcept {
  double sum = 0, rest = all_weights, weight = 1, size = 0.5;
  for (int octave = 0; octave < octaves; ++octave) {
    const double kept = std::clamp(size / (2 * width) - 0.5, 0.0, 1.0);
    const float* const lattice = lattice_.data() + std::ptrdiff_t{octave} * side * side;
    sum += weight * 0.5;
    if (kept > 0) sum += weight * kept * (lattice_noise(p / size, lattice) - 0.5);
    rest -= weight;
    if (sum + rest < threshold_ * all_weights) break;
    weight *= fading;
    size /= 2;
    p = {0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y};
  }
  return sum / all_weights;
}

Clouds::Clouds(const CloudSpec& spec) : spec_(spec), lattice_(random_lattice(spec.variant)) {
  Violations broken("Clouds");
  const auto in = [&](double value, double low, double high, const char* what) {
    broken.unless(low <= value && value <= high, "{} = {} must be from {} to {}", what, value, low,
                  high);
  };
  in(spec.cover, 0, 1, "cover");
  in(spec.optical_depth, 0, 1000, "optical_depth");
  in(spec.height_m, 100, 20e3, "height_m");
  in(spec.thickness_m, 1, 20e3, "thickness_m");
  in(spec.size_m, 10, 100e3, "size_m");
  broken.throw_if_any();
  if (spec.cover == 1) threshold_ = -std::numeric_limits<double>::infinity();
  if (spec.cover == 0) threshold_ = std::numeric_limits<double>::infinity();
  if (std::isinf(threshold_)) return;
  std::vector<double> values;
  for (int y = 0; y < samples_across; ++y) {
    for (int x = 0; x < samples_across; ++x) values.push_back(noise(0.37 * glm::dvec2(x, y), 0));
  }
  const auto clear =
      static_cast<std::ptrdiff_t>((1 - spec.cover) * static_cast<double>(values.size()));
  const auto at = values.begin() + std::min(clear, std::ssize(values) - 1);
  std::ranges::nth_element(values, at);
  threshold_ = *at;
}

double Clouds::vertical_depth(glm::dvec2 place_m, double width_m) const noexcept {
  if (std::isinf(threshold_)) return threshold_ < 0 ? spec_.optical_depth : 0;
  const double inside = noise(place_m / spec_.size_m, width_m / spec_.size_m) - threshold_;
  const double share = std::clamp(inside / ramp, 0.0, 1.0);
  return spec_.optical_depth * share * (2 - share);
}

Clouds::Crossing Clouds::cross(const glm::dvec3& direction, double width_rad) const noexcept {
  const double climb_m = earth_radius_m * direction.z, height_m = spec_.height_m;
  const double distance_m =
      std::sqrt(climb_m * climb_m + height_m * (2 * earth_radius_m + height_m)) - climb_m;
  const double cosine = (climb_m + distance_m) / (earth_radius_m + height_m);
  return {vertical_depth(distance_m * glm::dvec2(direction), distance_m * width_rad / cosine),
          cosine};
}

// Part of a path through the layer.
struct Clouds::Step {
  glm::dvec2 place_m;  // of the mean of its light
  double above_m;      // the base
  double distance_m;
  double depth;  // optical, along the path
};

// Divides the path of a direction through the layer into parts, and calls act(step) for each that
// is in a cloud until it returns false.
template <typename Act>
void Clouds::march(const glm::dvec3& direction, double width_rad, const Act& act) const noexcept {
  const double climb_m = earth_radius_m * direction.z;
  const auto distance_to = [&](double up_m) {
    return std::sqrt(climb_m * climb_m + up_m * (2 * earth_radius_m + up_m)) - climb_m;
  };
  const double level = math::hypot(direction.x, direction.y);
  const auto above_m = [&](double at_m) {  // the base
    return math::hypot(earth_radius_m + at_m * direction.z, at_m * level) - earth_radius_m -
           spec_.height_m;
  };
  const double extinction_per_m = spec_.optical_depth / spec_.thickness_m;
  const auto inside_m = [&](double at_m, double step_m) {  // below the top of the cloud
    const double width_m = std::max(at_m * width_rad, step_m * level / 2);
    const double depth = vertical_depth(at_m * glm::dvec2(direction), width_m);
    return depth > 0 ? depth / extinction_per_m - above_m(at_m) : -spec_.thickness_m;
  };
  const double end_m = distance_to(spec_.height_m + spec_.thickness_m);
  double begin_m = distance_to(spec_.height_m);
  const double most_m = (end_m - begin_m) / least_steps;
  double before_m = inside_m(begin_m, std::min(step_share * begin_m, most_m));
  while (begin_m < end_m) {
    const double step_m = std::min({step_share * begin_m, most_m, end_m - begin_m});
    const double after_m = inside_m(begin_m + step_m, step_m);
    const double in_m = std::max(before_m, 0.0) + std::max(after_m, 0.0);
    if (in_m > 0) {
      double in_begin_m = begin_m;  // of what is in the cloud
      double part_m = step_m * in_m / (std::abs(before_m) + std::abs(after_m));
      if (before_m <= 0) {
        double out_m = begin_m;
        in_begin_m = begin_m + step_m;
        for (int i = 0; i < halvings; ++i) {
          const double middle_m = (out_m + in_begin_m) / 2;
          (inside_m(middle_m, step_m) > 0 ? in_begin_m : out_m) = middle_m;
        }
        part_m = begin_m + step_m - in_begin_m;
      }
      // Mean of the distances from which the part's light comes, weighted by what passes.
      const double depth = extinction_per_m * part_m;
      const double seen = depth < 1e-6 ? depth / 2 : 1 - depth / math::expm1(depth);
      const double at_m = in_begin_m + seen / extinction_per_m;
      const Step step{at_m * glm::dvec2(direction), above_m(at_m), at_m, depth};
      if (depth > 0 && !act(step)) return;
    }
    begin_m += step_m;
    before_m = after_m;
  }
}

// Returns the optical depth from a place to the top of the layer towards the sun, times the cosine
// of the sun's angle: in a layer without edges, that of the part above.
double Clouds::depth_to_sun(const Step& at, const glm::dvec3& sun) const noexcept {
  const double extinction_per_m = spec_.optical_depth / spec_.thickness_m;
  if (std::isinf(threshold_)) return extinction_per_m * (spec_.thickness_m - at.above_m);
  // Steps grow with the distance, so that the first ones resolve the sunlit surface.
  const glm::dvec2 along = glm::dvec2(sun) / std::max(sun.z, lowest_sun);
  const double stretch = std::max(glm::length(along) / 2, 1.0);
  double inside_m = 0, from_m = 0;
  for (int i = 1; i <= steps_to_sun; ++i) {
    const double share = i / double{steps_to_sun};
    const double to_m = (spec_.thickness_m - at.above_m) * share * share;
    const double rise_m = to_m - from_m, middle_m = (from_m + to_m) / 2;
    const double top_m =
        vertical_depth(at.place_m + along * middle_m, rise_m * stretch) / extinction_per_m;
    inside_m += std::clamp(top_m - (at.above_m + from_m), 0.0, rise_m);
    from_m = to_m;
  }
  return extinction_per_m * inside_m;
}

double Clouds::sun_transmittance(const glm::dvec3& sun) const noexcept {
  const glm::dvec3 risen(sun.x, sun.y, std::max(sun.z, 0.0));
  if (std::isinf(threshold_)) return math::exp(-cross(risen, 0).depth());
  double depth = 0;
  march(risen, 0, [&](const Step& step) {
    depth += step.depth;
    return true;
  });
  return math::exp(-depth);
}

glm::dvec3 Clouds::radiance(const glm::dvec3& direction, double width_rad,
                            const Lighting& lighting) const noexcept {
  const glm::dvec3 from_sun = lighting.sun_irradiance * std::max(lighting.sun.z, 0.0);
  const glm::dvec3 once = lighting.sun_irradiance * phase_per_sr(glm::dot(direction, lighting.sun));
  const double sun_cosine = std::max(cross(lighting.sun, 0).cosine, 1e-3);
  // Of the light that is not scattered yet, the cloud returns what it does not pass.
  const double lost = transmitted(spec_.optical_depth);
  // Air below clouds is darker than below a clear sky.
  const glm::dvec3 air = lighting.clear_radiance * (1 - spec_.cover * (1 - lost));
  glm::dvec3 sum(0);
  double passed = 0;  // optical depth
  march(direction, width_rad, [&](const Step& step) {
    const double depth = depth_to_sun(step, lighting.sun);
    const double sunlit = math::exp(-depth / sun_cosine);
    const double skylit = math::exp(-diffusivity * depth);
    const double diffuse = transmitted(depth);
    const glm::dvec3 source = (from_sun * std::max(diffuse - lost * sunlit, 0.0) +
                               lighting.sky_irradiance * std::max(diffuse - lost * skylit, 0.0)) /
                                  std::numbers::pi +
                              once * sunlit;
    const double share = math::exp(-passed) - math::exp(-passed - step.depth);
    sum += share * glm::mix(air, source, math::exp(-step.distance_m / haze_m));
    passed += step.depth;
    return passed < opaque;
  });
  return sum + lighting.clear_radiance * math::exp(-passed);
}

}  // namespace groundray
