#include "sensors/sky/hosek_wilkie.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "core/error.h"

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
  const double x = std::cbrt(elevation_rad / (std::numbers::pi / 2));
  std::array<double, elevation_nodes> weights;
  for (int i = 0; i < elevation_nodes; ++i) {
    weights[static_cast<std::size_t>(i)] = binomials[static_cast<std::size_t>(i)] * std::pow(x, i) *
                                           std::pow(1 - x, elevation_nodes - 1 - i);
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
                -glm::degrees(std::asin(std::clamp(sun.z, -1.0, 1.0))));
  broken.throw_if_any();
}

}  // namespace

HosekWilkie::HosekWilkie(double turbidity, const glm::dvec3& ground_albedo, const glm::dvec3& sun)
    : sun_(sun) {
  check_analytic_sky(turbidity, ground_albedo, sun);
  const auto weights = node_weights(std::atan2(sun.z, std::hypot(sun.x, sun.y)));
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
  const double gamma = std::acos(cos_gamma);
  const double cos2 = cos_gamma * cos_gamma;
  const glm::dvec3 halo = (1 + cos2) / glm::pow(1.0 + i * i - 2.0 * i * cos_gamma, glm::dvec3(1.5));
  const glm::dvec3 from_horizon = 1.0 + a * glm::exp(b / (cos_theta + 0.01));
  const glm::dvec3 from_sun =
      c + d * glm::exp(e * gamma) + f * cos2 + g * halo + h * std::sqrt(cos_theta);
  return glm::max(from_horizon * from_sun * mean, glm::dvec3(0));
}

}  // namespace groundray
