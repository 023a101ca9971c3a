#include "apps/groundray/describe/sensor_facts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <optional>
#include <set>
#include <vector>

#include "apps/scene/readers/scene_reader.h"
#include "core/math.h"
#include "sensors/camera/lens/lens.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace groundray {
namespace {

constexpr double turn_deg = 360;

double span_deg(std::vector<double> azimuths_deg) {
  constexpr double most_gap_deg = 5;
  std::ranges::sort(azimuths_deg);
  double gap_deg = azimuths_deg.front() + turn_deg - azimuths_deg.back();
  for (std::size_t i = 1; i < azimuths_deg.size(); ++i)
    gap_deg = std::max(gap_deg, azimuths_deg[i] - azimuths_deg[i - 1]);
  return gap_deg <= most_gap_deg ? turn_deg : turn_deg - gap_deg;
}

std::string range_text(const RangeGate& gate) {
  return std::isinf(gate.far_m) ? fmt::format("from {:.6g} m", gate.near_m)
                                : fmt::format("{:.6g} to {:.6g} m", gate.near_m, gate.far_m);
}

constexpr std::array<const char*, 6> returns_words{"first",  "last", "strongest",
                                                   "second", "dual", "all"};

void add_light(const LightSpec& light, Facts& facts) {
  facts.emplace_back("laser",
                     fmt::format("{:.6g} nm, {:.4g} nJ in {:.4g} ns a pulse", light.wavelength_nm,
                                 light.optics.pulse_energy_j * 1e9, light.pulse.fwhm_s * 1e9));
  facts.emplace_back(
      "receiver",
      fmt::format("aperture {:.4g} mm, returns: {}{}", light.optics.aperture_diameter_m * 1e3,
                  returns_words[static_cast<std::size_t>(light.receiver.returns)],
                  light.receiver.noise ? ", with noise" : ""));
}

// Returns the angle from the axis of the ray of a position, or the lens's limit towards it.
double angle_deg(const Lens& lens, const glm::dvec2& pixel, double azimuth_rad) {
  const auto ray = lens.ray(pixel);
  return glm::degrees(ray ? math::acos(std::clamp(ray->direction.z, -1.0, 1.0))
                          : lens.limit_rad(azimuth_rad));
}

std::string shutter_text(const CameraSpec& camera) {
  const ShutterSpec& shutter = camera.shutter;
  return shutter.row_s == 0
             ? "global shutter"
             : fmt::format("rolling shutter of {:.4g} ms", shutter.row_s * camera.size_px.y * 1e3);
}

}  // namespace

LidarFigures figures_of(const LidarSpec& lidar) {
  const ScanPattern pattern(lidar.pattern);
  LidarFigures figures{.pulses = pattern.pulses(0), .rate_hz = pattern.sweep_rate_hz()};
  PulseBatch batch;
  pattern.fill(0, 0, figures.pulses, batch);
  figures.channels = std::set(batch.ring.begin(), batch.ring.end()).size();
  std::vector<double> azimuths_deg;
  figures.elevation_deg = {90, -90};
  for (const glm::dvec3& direction : batch.direction) {
    const double elevation_deg = glm::degrees(math::asin(std::clamp(direction.z, -1.0, 1.0)));
    figures.elevation_deg.x = std::min(figures.elevation_deg.x, elevation_deg);
    figures.elevation_deg.y = std::max(figures.elevation_deg.y, elevation_deg);
    azimuths_deg.push_back(glm::degrees(math::atan2(direction.y, direction.x)));
  }
  figures.azimuth_span_deg = span_deg(std::move(azimuths_deg));
  return figures;
}

glm::dvec2 view_deg(const CameraSpec& camera) {
  const Lens lens(camera.lens, camera.size_px);
  const glm::dvec2 last_px = glm::dvec2(camera.size_px - 1), middle_px = last_px / 2.0;
  constexpr double right_rad = 0, down_rad = glm::radians(90.0), left_rad = glm::radians(180.0);
  return {angle_deg(lens, {0, middle_px.y}, left_rad) +
              angle_deg(lens, {last_px.x, middle_px.y}, right_rad),
          angle_deg(lens, {middle_px.x, 0}, -down_rad) +
              angle_deg(lens, {middle_px.x, last_px.y}, down_rad)};
}

std::string lens_name(const CameraSpec& camera) {
  const std::string text = lens_text(camera.lens);
  return text.substr(0, text.find(':'));
}

std::string_view filter_name(ColorFilter filter) {
  static constexpr std::array<std::string_view, 5> names{"mono", "rggb", "bggr", "grbg", "gbrg"};
  return names[static_cast<std::size_t>(filter)];
}

std::string line_of(const LidarSpec& lidar) {
  const LidarFigures figures = figures_of(lidar);
  return fmt::format("{}: {} channel{}, {:.4g} x {:.4g} deg, {}, {:.4g} Hz, {} pulses a sweep",
                     lidar.model, figures.channels, figures.channels == 1 ? "" : "s",
                     figures.azimuth_span_deg, figures.elevation_deg.y - figures.elevation_deg.x,
                     range_text(lidar.gate), figures.rate_hz, figures.pulses);
}

std::string line_of(const CameraSpec& camera) {
  const glm::dvec2 view = view_deg(camera);
  return fmt::format("{}: {} x {} px, {:.4g} x {:.4g} deg, {}, {:.4g} Hz, {}", camera.model,
                     camera.size_px.x, camera.size_px.y, view.x, view.y, lens_name(camera),
                     camera.rate_hz, shutter_text(camera));
}

Facts facts_of(const LidarSpec& lidar) {
  const LidarFigures figures = figures_of(lidar);
  Facts facts{{"kind", "lidar"},
              {"model", lidar.model},
              {"channels", fmt::to_string(figures.channels)},
              {"view", fmt::format("{:.4g} deg about z, elevations {:.4g} to {:.4g} deg",
                                   figures.azimuth_span_deg, figures.elevation_deg.x,
                                   figures.elevation_deg.y)},
              {"sweeps", fmt::format("{:.6g} Hz, {} pulses each", figures.rate_hz, figures.pulses)},
              {"range", range_text(lidar.gate)}};
  const glm::dvec2 divergence_mrad = lidar.beam.divergence_rad * 1e3;
  if (divergence_mrad != glm::dvec2(0))
    facts.emplace_back("beam",
                       fmt::format("{:.4g} x {:.4g} mrad", divergence_mrad.x, divergence_mrad.y));
  if (lidar.light) {
    add_light(*lidar.light, facts);
  } else {
    facts.emplace_back("laser", "none: every pulse that hits a surface returns at its exact range");
  }
  if (lidar.range_noise_sigma_m > 0)
    facts.emplace_back("noise", fmt::format("{:.4g} m of range", lidar.range_noise_sigma_m));
  return facts;
}

std::string exposure_text(const ShutterSpec& shutter) {
  const double longest_ms = 1e3 * shutter.exposure_s;
  if (!shutter.automatic) return fmt::format("exposure {:.4g} ms", longest_ms);
  return fmt::format("automatic exposure, {:.4g} to {:.4g} ms, gain up to {:.3g}",
                     1e3 * shutter.automatic->shortest_s, longest_ms, shutter.automatic->most_gain);
}

Facts facts_of(const CameraSpec& camera) {
  const glm::dvec2 view = view_deg(camera);
  Facts facts{{"kind", "camera"},
              {"model", camera.model},
              {"size", fmt::format("{} x {} px", camera.size_px.x, camera.size_px.y)},
              {"view", fmt::format("{:.4g} x {:.4g} deg", view.x, view.y)},
              {"lens", lens_text(camera.lens)},
              {"images", fmt::format("{:.6g} Hz, {}, {}", camera.rate_hz, shutter_text(camera),
                                     exposure_text(camera.shutter))}};
  if (camera.aperture)
    facts.emplace_back("aperture", fmt::format("f/{:.4g}", camera.aperture->f_number));
  if (camera.imager) {
    facts.emplace_back(
        "imager",
        fmt::format("{}, {} bits, pixels of {:.4g} um", filter_name(camera.imager->filter),
                    camera.imager->bits, camera.imager->pixel_pitch_m * 1e6));
  }
  return facts;
}

}  // namespace groundray
