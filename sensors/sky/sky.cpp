#include "sensors/sky/sky.h"

#include <cmath>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <utility>

#include "core/error.h"

namespace groundray {
namespace {

using std::numbers::pi;

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

Sky::Sky(const SkySpec& spec, ImageF image)
    : sun_(spec.sun ? std::optional<Sun>(std::in_place, *spec.sun, spec.air) : std::nullopt),
      dome_(build_dome(spec, std::move(image), sun_)) {}

Sky::Dome Sky::build_dome(const SkySpec& spec, ImageF image, const std::optional<Sun>& sun) {
  check_air(spec.air);
  const auto* environment = std::get_if<EnvironmentImage>(&spec.dome);
  Violations broken("SkySpec");
  broken.unless(!environment || image.width() > 0, "the image '{}' is missing: load it first",
                environment ? environment->image.string() : "");
  broken.unless(environment || image.width() == 0,
                "an image is given, but the dome is not an environment image");
  const auto* analytic = std::get_if<AnalyticSky>(&spec.dome);
  broken.unless(!analytic || sun, "an analytic sky needs a sun: specify its position");
  broken.throw_if_any();
  if (environment) {
    return EnvironmentMap(std::move(image), glm::radians(environment->center_azimuth_deg),
                          environment->scale);
  }
  if (!analytic) return checked_sky(std::get<ConstantSky>(spec.dome));
  return ClearSky(spec.air.turbidity, analytic->ground_albedo, sun->direction(), sun->irradiance());
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
  const double level = std::hypot(direction.x, direction.y);
  if (level == 0) return dome_radiance({0, 1, 0});
  return dome_radiance({direction.x / level, direction.y / level, 0});
}

DirectionSample Sky::sample_dome(const glm::dvec2& uniform) const noexcept {
  if (const auto* map = std::get_if<EnvironmentMap>(&dome_)) return map->sample(uniform);
  if (const auto* sky = std::get_if<ClearSky>(&dome_)) return sky->sample(uniform);
  const double height = 1 - 2 * uniform.y, azimuth = 2 * pi * uniform.x;
  const double level = 2 * std::sqrt(uniform.y * (1 - uniform.y));
  return {{level * std::sin(azimuth), level * std::cos(azimuth), height}, 1 / (4 * pi)};
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
