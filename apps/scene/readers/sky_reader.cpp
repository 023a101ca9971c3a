#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <glm/trigonometric.hpp>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/math.h"

namespace groundray::yaml {
namespace {

using Time = std::chrono::sys_time<std::chrono::milliseconds>;

// Reads one number for all channels, or three.
void read_rgb(Map& map, std::string_view key, Need need, Rule rule, Faults& faults,
              glm::dvec3& into) {
  const Node* node = map.find(key, need);
  if (!node) return;
  if (node->kind != Node::Kind::List) {
    if (const auto value = number(*node, key, rule, faults)) into = glm::dvec3(*value);
  } else {
    map.read_vector(key, need, into, rule);
  }
}

ConstantSky read_constant(Map map, Faults& faults) {
  ConstantSky sky;
  read_rgb(map, "radiance_w_m2_sr", Need::Required, not_negative, faults, sky.radiance);
  map.close();
  return sky;
}

// Checks that the image can be read and is suitable as a sky.
void check_image(const EnvironmentImage& sky, const Node& node, Faults& faults) {
  try {
    const EnvironmentMap works(read_image_f(sky.image), glm::radians(sky.center_azimuth_deg),
                               sky.scale);
  } catch (const Error& fault) {
    faults.add(node, "image", "cannot be used as the sky:\n{}", fault.what());
  }
}

EnvironmentImage read_environment(Map map, const fs::path& path, Faults& faults) {
  EnvironmentImage sky;
  const std::size_t faults_before = faults.count();
  const Node* const at_image = read_path(map, "image", Need::Required, path, sky.image);
  map.read_number("center_azimuth_deg", Need::Optional, sky.center_azimuth_deg);
  double factor = 1, lux = 0;
  const bool has_factor = map.find("radiance_factor", Need::Optional) != nullptr;
  if (map.read_number("radiance_factor", Need::Optional, factor, positive))
    sky.scale = RadianceScale{factor};
  if (const Node* at = map.read_number("illuminance_lux", Need::Optional, lux, positive)) {
    sky.scale = IlluminanceScale{lux};
    if (has_factor)
      faults.add(*at, "illuminance_lux", "is an alternative to radiance_factor: give one of them");
  }
  map.close();
  if (faults.count() == faults_before) check_image(sky, *at_image, faults);
  return sky;
}

CloudSpec read_clouds(Map map) {
  CloudSpec clouds;
  map.read_number("cover", Need::Required, clouds.cover, share_rule);
  map.read_number("optical_depth", Need::Optional, clouds.optical_depth, not_negative);
  map.read_number("height_m", Need::Optional, clouds.height_m, positive);
  map.read_number("thickness_m", Need::Optional, clouds.thickness_m, positive);
  map.read_number("size_m", Need::Optional, clouds.size_m, positive);
  map.read_whole("variant", Need::Optional, clouds.variant.value);
  map.close();
  return clouds;
}

AnalyticSky read_analytic(Map map, Faults& faults) {
  AnalyticSky sky;
  read_rgb(map, "ground_albedo", Need::Optional, share_rule, faults, sky.ground_albedo);
  if (auto clouds = map.map("clouds", Need::Optional)) sky.clouds = read_clouds(std::move(*clouds));
  map.close();
  return sky;
}

// Returns the whole number that the first `digits` characters of a text represent, and removes
// them.
std::optional<int> take_digits(std::string_view& text, std::size_t digits) {
  if (text.size() < digits) return std::nullopt;
  int value = 0;
  for (const char c : text.substr(0, digits)) {
    if (c < '0' || c > '9') return std::nullopt;
    value = 10 * value + (c - '0');
  }
  text.remove_prefix(digits);
  return value;
}

// Returns the UTC time that a text such as "2003-10-17T19:30:30Z" represents, in whole seconds; ISO
// 8601.
std::optional<Time> parse_utc(std::string_view text) {
  std::array<int, 6> parts{};
  constexpr std::string_view separators = "--T::Z";
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto part = take_digits(text, i == 0 ? 4 : 2);
    if (!part || text.empty() || text[0] != separators[i]) return std::nullopt;
    parts[i] = *part;
    text.remove_prefix(1);
  }
  const std::chrono::year_month_day date{std::chrono::year{parts[0]},
                                         std::chrono::month{static_cast<unsigned>(parts[1])},
                                         std::chrono::day{static_cast<unsigned>(parts[2])}};
  if (!text.empty() || !date.ok() || parts[3] > 23 || parts[4] > 59 || parts[5] > 59)
    return std::nullopt;
  return std::chrono::sys_days(date) + std::chrono::hours(parts[3]) +
         std::chrono::minutes(parts[4]) + std::chrono::seconds(parts[5]);
}

SunTime read_time(Map& map, Faults& faults) {
  SunTime sun;
  std::string text;
  if (const Node* at = map.read_text("utc", Need::Required, text)) {
    if (const auto utc = parse_utc(text)) {
      sun.utc = *utc;
    } else {
      faults.add(*at, "utc", "is {}, but must be a time like 2026-06-21T10:30:00Z", shown(*at));
    }
  }
  map.read_number("latitude_deg", Need::Required, sun.latitude_deg);
  map.read_number("longitude_deg", Need::Required, sun.longitude_deg);
  map.read_number("temperature_c", Need::Optional, sun.temperature_c);
  return sun;
}

SunSpec read_sun(Map map, Faults& faults) {
  SunSpec spec;
  const bool timed = map.find("utc", Need::Optional) != nullptr;
  const bool fixed = map.find("elevation_deg", Need::Optional) != nullptr;
  if (timed == fixed && map.node().kind == Node::Kind::Map) {
    faults.add(map.node(), "sun",
               "must have either 'utc', 'latitude_deg' and 'longitude_deg', or 'azimuth_deg' and "
               "'elevation_deg'");
  }
  if (timed) {
    spec.position = read_time(map, faults);
  } else {
    SunAngles sun;
    map.read_number("azimuth_deg", fixed ? Need::Required : Need::Optional, sun.azimuth_deg);
    map.read_number("elevation_deg", Need::Optional, sun.elevation_deg);
    map.read_number("distance_au", Need::Optional, sun.distance_au);
    spec.position = sun;
  }
  map.read_choice("disc", Need::Optional, spec.disc, {"uniform", "limb_darkened"});
  map.close();
  return spec;
}

// Checks that the sun and the sky can be built together. An image has already been checked.
void check_sky(const SkySpec& spec, const Node& node, Faults& faults) {
  SkySpec without_image = spec;
  if (std::holds_alternative<EnvironmentImage>(spec.dome)) without_image.dome = ConstantSky{};
  try {
    const Sky works(without_image);
  } catch (const Error& fault) {
    faults.add(node, "sky", "is invalid: {}", fault.what());
  }
}

}  // namespace

SkySpec read_sky(Map map, const fs::path& path, Faults& faults) {
  const std::size_t faults_before = faults.count();
  SkySpec spec;
  auto constant = map.map("constant", Need::Optional);
  auto environment = map.map("environment", Need::Optional);
  auto analytic = map.map("analytic", Need::Optional);
  if (constant.has_value() + environment.has_value() + analytic.has_value() > 1) {
    faults.add(map.node(), "sky",
               "must have at most one of 'constant', 'environment' and 'analytic'");
  }
  if (constant) spec.dome = read_constant(std::move(*constant), faults);
  if (environment) spec.dome = read_environment(std::move(*environment), path, faults);
  if (analytic) spec.dome = read_analytic(std::move(*analytic), faults);
  if (auto sun = map.map("sun", Need::Optional)) spec.sun = read_sun(std::move(*sun), faults);
  map.read_number("turbidity", Need::Optional, spec.air.turbidity, positive);
  map.read_number("water_cm", Need::Optional, spec.air.water_cm, not_negative);
  map.read_number("ozone_cm", Need::Optional, spec.air.ozone_cm, not_negative);
  map.read_number("pressure_hpa", Need::Optional, spec.air.pressure_hpa, positive);
  const Node& node = map.node();
  map.close();
  if (faults.count() == faults_before) check_sky(spec, node, faults);
  return spec;
}

AtmosphereSpec read_air(Map map, Faults& faults) {
  AtmosphereSpec air;
  map.read_number("visibility_m", Need::Optional, air.visibility_m, positive);
  map.read_choice("haze_law", Need::Optional, air.haze_law, {"kruse", "kim"});
  map.read_number("fog_range_m", Need::Optional, air.fog_range_m, positive);
  map.read_number("rain_mm_h", Need::Optional, air.rain_mm_h, not_negative);
  map.read_number("backscatter_per_m_sr", Need::Optional, air.backscatter_per_m_sr, not_negative);
  map.read_number("group_index", Need::Optional, air.group_index, at_least_one);
  if (std::isfinite(air.visibility_m) && std::isfinite(air.fog_range_m))
    faults.add(map.node(), "weather", "has haze and fog: give one of visibility_m and fog_range_m");
  map.close();
  return air;
}

Wind read_wind(Map map) {
  constexpr Rule speed_rule{
      [](double value) { return value == 0 || (value >= 0.1 && value <= 30); },
      "must be 0, or from 0.1 to 30"};
  constexpr Rule turbulence_rule{[](double value) { return value >= 0 && value <= 0.5; },
                                 "must be from 0 to 0.5"};
  Wind wind;
  double from_deg = 270;
  map.read_number("speed_m_s", Need::Required, wind.speed_m_s, speed_rule);
  map.read_number("from_deg", Need::Optional, from_deg);
  map.read_number("turbulence", Need::Optional, wind.turbulence, turbulence_rule);
  map.close();
  const double from_rad = glm::radians(from_deg);
  wind.towards = {-math::sin(from_rad), -math::cos(from_rad)};
  return wind;
}

}  // namespace groundray::yaml
