#include "sensors/sky/environment_map.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/luminance.h"
#include "core/math.h"

namespace groundray {
namespace {

using std::numbers::pi;
constexpr int most_named = 5;  // faulty pixels named in an error

// Images are grey, grey with alpha, RGB, or RGB with alpha.
std::span<const float> without_alpha(std::span<const float> pixel) {
  return pixel.first(pixel.size() < 3 ? 1 : 3);
}

glm::dvec3 rgb(std::span<const float> pixel) {
  if (pixel.size() < 3) return glm::dvec3(pixel[0]);
  return {pixel[0], pixel[1], pixel[2]};
}

// Reports the first few pixels that are not valid radiances, and counts the others.
void check_light(const ImageF& image, Violations& broken) {
  int faulty = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const auto value = without_alpha(image.at(x, y));
      if (std::ranges::all_of(value, [](float v) { return v >= 0 && std::isfinite(v); })) continue;
      broken.unless(++faulty > most_named,
                    "pixel ({}, {}) = ({}) must be finite and >= 0 in every channel", x, y,
                    fmt::join(value, ", "));
    }
  }
  broken.unless(faulty <= most_named, "and {} more such pixels: correct the image",
                faulty - most_named);
}

ImageF checked_image(ImageF image) {
  Violations broken("Environment image");
  const bool is_picture = image.channels() >= 1 && image.channels() <= 4;
  broken.unless(is_picture,
                "has {} channels, but must have 1 (grey) or 3 (R, G, B), optionally with alpha",
                image.channels());
  if (is_picture) check_light(image, broken);
  broken.throw_if_any();
  const auto shines = [&](int y) {
    for (int x = 0; x < image.width(); ++x)
      if (luminance(rgb(image.at(x, y))) > 0) return true;
    return false;
  };
  for (int y = 0; y < image.height(); ++y)
    if (shines(y)) return image;
  throw Error("Environment image: every pixel is 0: use a constant sky of radiance 0 instead");
}

std::vector<float> luminances(const ImageF& image) {
  std::vector<float> result;
  result.reserve(image.values().size() / static_cast<std::size_t>(image.channels()));
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double value = luminance(rgb(image.at(x, y)));
      // A luminance that underflows a float keeps a positive weight, so that the pixel is drawn.
      result.push_back(
          value > 0 ? std::max(static_cast<float>(value), std::numeric_limits<float>::min()) : 0.f);
    }
  }
  return result;
}

// Returns the integral of (a + b theta) cos(theta) sin(theta) from `begin_rad` to `end_rad`.
double cosine_integral(double a, double b, double begin_rad, double end_rad) {
  const auto primitive = [&](double theta) {
    const double sine = math::sin(theta);
    return a * sine * sine / 2 + b * (math::sin(2 * theta) / 8 - theta * math::cos(2 * theta) / 4);
  };
  return primitive(end_rad) - primitive(begin_rad);
}

double scale_of(const EnvironmentScale& scale, const glm::dvec3& irradiance) {
  if (const auto* radiance = std::get_if<RadianceScale>(&scale)) {
    if (radiance->factor > 0 && std::isfinite(radiance->factor)) return radiance->factor;
    throw Error("Environment image: its radiance factor = {} must be positive and finite",
                radiance->factor);
  }
  const double lux = std::get<IlluminanceScale>(scale).lux;
  const double unscaled_lux = luminous_efficacy_lm_w * luminance(irradiance);
  Violations broken("Environment image");
  broken.unless(lux > 0 && std::isfinite(lux),
                "its illuminance = {} lx must be positive and finite", lux);
  broken.unless(unscaled_lux > 0,
                "all pixels above the horizon are 0, so it cannot be scaled to an illuminance: is "
                "it upside down? Row 0 is the zenith");
  broken.throw_if_any();
  return lux / unscaled_lux;
}

}  // namespace

EnvironmentMap::EnvironmentMap(ImageF image, double center_azimuth_rad,
                               const EnvironmentScale& scale)
    : image_(checked_image(std::move(image))),
      sampler_(LatLongGrid(image_.width(), image_.height(), center_azimuth_rad),
               luminances(image_)) {
  scale_ = scale_of(scale, horizontal_irradiance());
}

glm::dvec3 EnvironmentMap::pixel(int x, int y) const noexcept { return rgb(image_.at(x, y)); }

glm::dvec3 EnvironmentMap::radiance(const glm::dvec3& direction) const noexcept {
  const LatLongPlace at = sampler_.grid().place(direction);
  const glm::dvec3 top = glm::mix(pixel(at.left, at.top), pixel(at.right, at.top), at.across);
  const glm::dvec3 bottom =
      glm::mix(pixel(at.left, at.bottom), pixel(at.right, at.bottom), at.across);
  return scale_ * glm::mix(top, bottom, at.down);
}

glm::dvec3 EnvironmentMap::horizontal_irradiance() const noexcept {
  const LatLongGrid& grid = sampler_.grid();
  const auto row_mean = [&](int y) {
    glm::dvec3 sum(0);
    for (int x = 0; x < image_.width(); ++x) sum += pixel(x, y);
    return sum / static_cast<double>(image_.width());
  };
  glm::dvec3 sum(0);
  glm::dvec3 top = row_mean(0);
  for (int row = 0; row <= image_.height(); ++row) {
    const double begin = grid.patch_bounds_rad(row).x, end = grid.patch_bounds_rad(row).y;
    if (begin >= pi / 2) break;
    const glm::dvec3 bottom = row_mean(std::min(row, image_.height() - 1));
    const glm::dvec3 slope = (bottom - top) / (end - begin);
    const double last = std::min(end, pi / 2);
    sum +=
        top * cosine_integral(1, 0, begin, last) + slope * cosine_integral(-begin, 1, begin, last);
    top = bottom;
  }
  return 2 * pi * scale_ * sum;
}

}  // namespace groundray
