#include "sensors/sky/sky.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/luminance.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr int turbidities = 10, albedos = 2, elevation_nodes = 6, channels = 3, parameters = 10;
constexpr double coefficient_table[] = {
#include <sky/hosek_wilkie_rgb.inc>
};
static_assert(std::size(coefficient_table) ==
              std::size_t{turbidities} * albedos * elevation_nodes * channels * parameters);

// Returns the Bernstein polynomials of degree 5, the model's interpolation over the sun's
// elevation.
std::array<double, elevation_nodes> node_weights(double elevation_rad) {
  constexpr std::array<double, elevation_nodes> binomials{1, 5, 10, 10, 5, 1};
  const double x = math::cbrt(elevation_rad / (std::numbers::pi / 2));
  std::array<double, elevation_nodes> weights;
  for (int i = 0; i < elevation_nodes; ++i) {
    weights[static_cast<std::size_t>(i)] = binomials[static_cast<std::size_t>(i)] *
                                           math::pow(x, i) *
                                           math::pow(1 - x, elevation_nodes - 1 - i);
  }
  return weights;
}

double coefficient(int turbidity, int albedo, int channel, int parameter,
                   const std::array<double, elevation_nodes>& weights) {
  double sum = 0;
  for (int node = 0; node < elevation_nodes; ++node) {
    const int row = ((turbidity * albedos + albedo) * elevation_nodes + node) * channels + channel;
    sum +=
        weights[static_cast<std::size_t>(node)] * coefficient_table[row * parameters + parameter];
  }
  return sum;
}

void check_analytic_sky(double turbidity, const glm::dvec3& albedo, const glm::dvec3& sun) {
  Violations broken("Analytic sky");
  broken.unless(turbidity >= 1 && turbidity <= 10, "turbidity = {} must be in [1, 10]", turbidity);
  for (int channel = 0; channel < channels; ++channel) {
    broken.unless(albedo[channel] >= 0 && albedo[channel] <= 1,
                  "ground_albedo[{}] = {} must be in [0, 1]: is it in percent?", channel,
                  albedo[channel]);
  }
  broken.unless(std::abs(glm::dot(sun, sun) - 1) < 1e-9,
                "the sun's direction ({}, {}, {}) must be of length 1", sun.x, sun.y, sun.z);
  broken.unless(sun.z >= 0,
                "the sun is {:.3g} degrees below the horizon, but the model has no twilight: use a "
                "constant sky or an environment image",
                -glm::degrees(math::asin(std::clamp(sun.z, -1.0, 1.0))));
  broken.throw_if_any();
}

using std::numbers::pi;
constexpr int table_width = 256, table_height = 128;

// Integrates by the midpoint rule over azimuth and elevation.
glm::dvec3 irradiance_of(const HosekWilkie& model) {
  constexpr int rings = 180, sectors = 180;
  glm::dvec3 sum(0);
  for (int ring = 0; ring < rings; ++ring) {
    const double elevation = pi / 2 * (ring + 0.5) / rings;
    const double level = math::cos(elevation), height = math::sin(elevation);
    glm::dvec3 around(0);
    for (int sector = 0; sector < sectors; ++sector) {
      const double azimuth = 2 * pi * (sector + 0.5) / sectors;
      around += model.radiance({level * math::sin(azimuth), level * math::cos(azimuth), height});
    }
    sum += around * (height * level);
  }
  return sum * (pi * pi / (rings * sectors));
}

// Renders a sky with clouds, and the ground below it.
ImageF cloudy_dome(const ClearSky& clear, const AnalyticSky& spec, const Sun& clear_sun) {
  constexpr int width = 2048, height = width / 2;
  const Clouds clouds(*spec.clouds);
  const Clouds::Lighting lighting{.sun = clear_sun.direction(),
                                  .sun_irradiance = clear_sun.irradiance(),
                                  .sky_irradiance = clear.horizontal_irradiance()};
  ImageF image(width, height, channels);
  std::vector<glm::dvec3> rings(height / 2);  // sums over the pixels of a row
  const auto put = [&](int x, int y, const glm::dvec3& radiance) {
    for (int c = 0; c < channels; ++c) image.at(x, y)[c] = static_cast<float>(radiance[c]);
  };
  tbb::parallel_for(0, height / 2, [&](int y) {
    const double polar = pi * (y + 0.5) / height;
    const double level = math::sin(polar), up = math::cos(polar);
    for (int x = 0; x < width; ++x) {
      const double azimuth = 2 * pi * ((x + 0.5) / width - 0.5);
      const glm::dvec3 direction(level * math::sin(azimuth), level * math::cos(azimuth), up);
      Clouds::Lighting seen = lighting;
      seen.clear_radiance = clear.radiance(direction);
      const glm::dvec3 radiance = clouds.radiance(direction, pi / height, seen);
      put(x, y, radiance);
      rings[static_cast<std::size_t>(y)] +=
          radiance * (level * up * 2 * pi * pi / (double{width} * height));
    }
  });
  const glm::dvec3 irradiance =
      std::accumulate(rings.begin(), rings.end(),
                      clouds.sun_transmittance(lighting.sun) * std::max(lighting.sun.z, 0.0) *
                          lighting.sun_irradiance);
  for (int y = height / 2; y < height; ++y)
    for (int x = 0; x < width; ++x) put(x, y, spec.ground_albedo * irradiance / pi);
  return image;
}

ConstantSky checked_sky(const ConstantSky& sky) {
  Violations broken("Constant sky");
  for (int channel = 0; channel < 3; ++channel) {
    const double value = sky.radiance[channel];
    broken.unless(value >= 0 && std::isfinite(value), "radiance[{}] = {} must be finite and >= 0",
                  channel, value);
  }
  broken.throw_if_any();
  return sky;
}

}  // namespace

HosekWilkie::HosekWilkie(double turbidity, const glm::dvec3& ground_albedo, const glm::dvec3& sun)
    : sun_(sun) {
  check_analytic_sky(turbidity, ground_albedo, sun);
  const auto weights = node_weights(math::atan2(sun.z, math::hypot(sun.x, sun.y)));
  const int below = std::min(static_cast<int>(turbidity), turbidities - 1) - 1;
  const double above_share = turbidity - (below + 1);
  for (int parameter = 0; parameter < parameters; ++parameter) {
    for (int channel = 0; channel < channels; ++channel) {
      const auto at = [&](int turbidity_index) {
        return glm::mix(coefficient(turbidity_index, 0, channel, parameter, weights),
                        coefficient(turbidity_index, 1, channel, parameter, weights),
                        ground_albedo[channel]);
      };
      coefficients_[static_cast<std::size_t>(parameter)][channel] =
          glm::mix(at(below), at(below + 1), above_share);
    }
  }
}

glm::dvec3 HosekWilkie::radiance(const glm::dvec3& direction) const noexcept {
  const auto& [a, b, c, d, e, f, g, h, i, mean] = coefficients_;
  const double cos_theta = std::max(direction.z, 0.0);
  const double cos_gamma = std::clamp(glm::dot(direction, sun_), -1.0, 1.0);
  const double gamma = math::acos(cos_gamma);
  const double cos2 = cos_gamma * cos_gamma;
  const glm::dvec3 aside = 1.0 + i * i - 2.0 * i * cos_gamma;
  const glm::dvec3 halo = (1 + cos2) / (aside * glm::sqrt(aside));
  const glm::dvec3 from_horizon = 1.0 + a * math::exp(b / (cos_theta + 0.01));
  const glm::dvec3 from_sun =
      c + d * math::exp(e * gamma) + f * cos2 + g * halo + h * std::sqrt(cos_theta);
  return glm::max(from_horizon * from_sun * mean, glm::dvec3(0));
}

ClearSky::ClearSky(double turbidity, const glm::dvec3& ground_albedo, const glm::dvec3& sun,
                   const glm::dvec3& sun_irradiance)
    : model_(turbidity, ground_albedo, sun),
      irradiance_(irradiance_of(model_)),
      ground_(ground_albedo * (irradiance_ + sun_irradiance * sun.z) / pi),
      sampler_(tabulated()) {}

DirectionSampler ClearSky::tabulated() const {
  const LatLongGrid grid(table_width, table_height, 0);
  // Near the horizon the fit is clipped to 0 in places. This minimum ensures that the directions
  // next to them, where the radiance is positive, are drawn.
  const double least = 1e-3 * luminance(irradiance_) / pi;
  std::vector<float> weights;
  weights.reserve(std::size_t{table_width} * table_height);
  for (int y = 0; y < table_height; ++y) {
    const double polar = pi * (y + 0.5) / table_height;
    for (int x = 0; x < table_width; ++x) {
      const double azimuth = 2 * pi * ((x + 0.5) / table_width - 0.5);
      const double level = math::sin(polar);
      const glm::dvec3 direction(level * math::sin(azimuth), level * math::cos(azimuth),
                                 math::cos(polar));
      const double weight = luminance(radiance(direction));
      weights.push_back(static_cast<float>(direction.z < 0 ? weight : std::max(weight, least)));
    }
  }
  return {grid, std::move(weights)};
}

std::optional<Sun> sun_of(const SkySpec& spec) {
  if (!spec.sun) return std::nullopt;
  const Sun clear(*spec.sun, spec.air);
  const auto* analytic = std::get_if<AnalyticSky>(&spec.dome);
  if (!analytic || !analytic->clouds) return clear;
  return Sun(*spec.sun, spec.air, Clouds(*analytic->clouds).sun_transmittance(clear.direction()));
}

Sky::Sky(const SkySpec& spec, ImageF image)
    : sun_(sun_of(spec)), dome_(build_dome(spec, std::move(image))) {}

Sky::Dome Sky::build_dome(const SkySpec& spec, ImageF image) {
  check_air(spec.air);
  const auto* environment = std::get_if<EnvironmentImage>(&spec.dome);
  Violations broken("SkySpec");
  broken.unless(!environment || image.width() > 0, "the image '{}' is missing: load it first",
                environment ? environment->image.string() : "");
  broken.unless(environment || image.width() == 0,
                "an image is given, but the dome is not an environment image");
  const auto* analytic = std::get_if<AnalyticSky>(&spec.dome);
  broken.unless(!analytic || spec.sun, "an analytic sky needs a sun: specify its position");
  broken.throw_if_any();
  if (environment) {
    return EnvironmentMap(std::move(image), glm::radians(environment->center_azimuth_deg),
                          environment->scale);
  }
  if (!analytic) return checked_sky(std::get<ConstantSky>(spec.dome));
  const Sun sun(*spec.sun, spec.air);
  ClearSky clear(spec.air.turbidity, analytic->ground_albedo, sun.direction(), sun.irradiance());
  if (!analytic->clouds) return clear;
  return EnvironmentMap(cloudy_dome(clear, *analytic, sun), 0, RadianceScale{});
}

glm::dvec3 Sky::radiance(const glm::dvec3& direction) const noexcept {
  const glm::dvec3 dome = dome_radiance(direction);
  return sun_ ? dome + sun_->radiance(direction) : dome;
}

glm::dvec3 Sky::dome_radiance(const glm::dvec3& direction) const noexcept {
  if (const auto* sky = std::get_if<ConstantSky>(&dome_)) return sky->radiance;
  if (const auto* map = std::get_if<EnvironmentMap>(&dome_)) return map->radiance(direction);
  return std::get_if<ClearSky>(&dome_)->radiance(direction);
}

glm::dvec3 Sky::horizon_radiance(const glm::dvec3& direction) const noexcept {
  const double level = math::hypot(direction.x, direction.y);
  if (level == 0) return dome_radiance({0, 1, 0});
  return dome_radiance({direction.x / level, direction.y / level, 0});
}

DirectionSample Sky::sample_dome(const glm::dvec2& uniform) const noexcept {
  if (const auto* map = std::get_if<EnvironmentMap>(&dome_)) return map->sample(uniform);
  if (const auto* sky = std::get_if<ClearSky>(&dome_)) return sky->sample(uniform);
  const double height = 1 - 2 * uniform.y, azimuth = 2 * pi * uniform.x;
  const double level = 2 * std::sqrt(uniform.y * (1 - uniform.y));
  return {{level * math::sin(azimuth), level * math::cos(azimuth), height}, 1 / (4 * pi)};
}

double Sky::dome_pdf_per_sr(const glm::dvec3& direction) const noexcept {
  if (const auto* map = std::get_if<EnvironmentMap>(&dome_)) return map->pdf_per_sr(direction);
  if (const auto* sky = std::get_if<ClearSky>(&dome_)) return sky->pdf_per_sr(direction);
  return 1 / (4 * pi);
}

glm::dvec3 Sky::dome_irradiance() const noexcept {
  if (const auto* map = std::get_if<EnvironmentMap>(&dome_)) return map->horizontal_irradiance();
  if (const auto* sky = std::get_if<ClearSky>(&dome_)) return sky->horizontal_irradiance();
  return pi * std::get_if<ConstantSky>(&dome_)->radiance;
}

}  // namespace groundray
