#include <algorithm>
#include <utility>

#include "apps/scene/calibration/calibration_io.h"
#include "apps/scene/readers/readers.h"
#include "core/error.h"

namespace groundray::yaml {
namespace {

void read_scaled_pair(Map& map, std::string_view key, double scale, glm::dvec2& into) {
  glm::dvec2 pair(0);
  if (map.read_vector(key, Need::Optional, pair, not_negative)) into = pair * scale;
}

void read_beam(Map beam, BeamSpec& spec) {
  beam.read_choice("profile", Need::Optional, spec.profile, {"gaussian", "top_hat"});
  beam.read_choice("width", Need::Optional, spec.width, {"fwhm", "inverse_e_square"});
  read_scaled_pair(beam, "divergence_mrad", 1e-3, spec.divergence_rad);
  read_scaled_pair(beam, "aperture_mm", 1e-3, spec.aperture_m);
  std::uint32_t sub_rays = static_cast<std::uint32_t>(spec.sub_rays);
  if (beam.read_whole("sub_rays", Need::Optional, sub_rays)) {
    spec.sub_rays = static_cast<int>(std::min(sub_rays, 1u << 20));
    spec.most_sub_rays.reset();
  }
  std::uint32_t most = 0;
  if (beam.read_whole("most_sub_rays", Need::Optional, most))
    spec.most_sub_rays = static_cast<int>(std::min(most, 1u << 20));
  beam.read_choice("turn", Need::Optional, spec.turn, {"fixed", "each_pulse"});
  beam.close();
}

void read_pulse(Map& laser, PulseSpec& pulse, Faults& faults) {
  laser.read_scaled("pulse_fwhm_ns", Need::Optional, 1e-9, pulse.fwhm_s, positive);
  for (const Node& node : laser.list("pulse_shape", Need::Optional)) {
    if (const auto value = number(node, "pulse_shape", not_negative, faults))
      pulse.shape.push_back(*value);
  }
  const Node* step =
      laser.read_scaled("pulse_shape_step_ns", Need::Optional, 1e-9, pulse.shape_step_s, positive);
  if (step != nullptr && pulse.shape.empty()) {
    faults.add(*step, "pulse_shape_step_ns",
               "is the step of pulse_shape: [power, ...], which is missing");
  }
}

void read_laser(Map laser, LightSpec& light, Faults& faults) {
  if (const Node* const at =
          laser.read_number("wavelength_nm", Need::Required, light.wavelength_nm, positive)) {
    const double given = light.wavelength_nm;
    if (given < 400 || given > 2000)
      faults.add(*at, "wavelength_nm", "is {}, but must be from 400 to 2000{}", at->text,
                 given < 10 ? fmt::format(": {} um are {:.6g} nm", at->text, 1000 * given) : "");
  }
  laser.read_scaled("pulse_energy_nj", Need::Required, 1e-9, light.optics.pulse_energy_j, positive);
  read_pulse(laser, light.pulse, faults);
  laser.read_number("efficiency", Need::Optional, light.optics.emitter_efficiency,
                    positive_share_rule);
  laser.close();
}

void read_noise(Map map, LightSpec& light) {
  NoiseSpec noise;
  map.read_number("nep_w_per_sqrt_hz", Need::Required, noise.nep_w_per_sqrt_hz, positive);
  map.read_number("quantum_efficiency", Need::Optional, noise.quantum_efficiency,
                  positive_share_rule);
  map.read_number("excess_noise_factor", Need::Optional, noise.excess_noise_factor, at_least_one);
  map.read_number("false_alarm_rate_hz", Need::Optional, noise.false_alarm_rate_hz, not_negative);
  map.read_number("sun_w_m2_nm", Need::Optional, light.sun.irradiance_w_m2_nm, not_negative);
  map.read_number("filter_width_nm", Need::Optional, light.sun.filter_width_nm, not_negative);
  double field_of_view_rad = 0;
  map.read_scaled(
      "field_of_view_mrad", Need::Optional, 1e-3, field_of_view_rad,
      {[](double value) { return value >= 0 && value <= 3000; }, "must be from 0 to 3000"});
  light.sun.field_of_view_sr = cone_solid_angle_sr(field_of_view_rad);
  map.close();
  light.receiver.noise = noise;
}

void read_intensity(Map& map, IntensitySpec& intensity) {
  map.read_choice("intensity", Need::Optional, intensity.scale,
                  {"power", "reflectance", "eight_bit"});
  map.read_number("intensity_gain", Need::Optional, intensity.gain, positive);
  map.read_number("full_scale_reflectance", Need::Optional, intensity.full_scale_reflectance,
                  Rule{[](double value) { return value > 1; }, "must be > 1"});
}

void read_receiver(Map map, LightSpec& light) {
  ReceiverSpec& receiver = light.receiver;
  map.read_scaled("aperture_mm", Need::Required, 1e-3, light.optics.aperture_diameter_m, positive);
  map.read_number("efficiency", Need::Optional, light.optics.receiver_efficiency,
                  positive_share_rule);
  map.read_scaled("response_fwhm_ns", Need::Optional, 1e-9, receiver.response_fwhm_s);
  map.read_scaled("sample_interval_ns", Need::Optional, 1e-9, receiver.sample_interval_s);
  map.read_choice("timing", Need::Optional, receiver.timing,
                  {"leading_edge", "constant_fraction", "peak", "centre_of_gravity"});
  map.read_number("threshold_w", Need::Optional, receiver.threshold_w, not_negative);
  map.read_number("fraction", Need::Optional, receiver.fraction,
                  Rule{[](double value) { return value > 0 && value < 1; }, "must be > 0 and < 1"});
  map.read_choice("returns", Need::Optional, receiver.returns,
                  {"first", "last", "strongest", "second", "dual", "all"});
  auto most = static_cast<std::uint8_t>(receiver.most_returns);
  map.read_whole("most_returns", Need::Optional, most);
  receiver.most_returns = most;
  map.read_scaled("dead_time_ns", Need::Optional, 1e-9, receiver.dead_time_s);
  map.read_number("saturation_w", Need::Optional, receiver.saturation_w, positive);
  map.read_number("calibrated_group_index", Need::Optional, receiver.calibrated_group_index,
                  at_least_one);
  glm::dvec2 overlap(0);
  map.read_vector("overlap_m", Need::Optional, overlap, not_negative);
  light.overlap = {overlap.x, overlap.y};
  map.read_scaled("range_step_mm", Need::Optional, 1e-3, light.range_step_m);
  read_intensity(map, light.intensity);
  if (auto noise = map.map("noise", Need::Optional)) read_noise(std::move(*noise), light);
  map.close();
}

// Reads beam, laser, receiver and noise, which lidar files and scenes have in common.
void read_physics(Map& map, LidarSpec& lidar, Faults& faults) {
  if (auto beam = map.map("beam", Need::Optional)) read_beam(std::move(*beam), lidar.beam);
  auto laser = map.map("laser", Need::Optional);
  auto receiver = map.map("receiver", Need::Optional);
  if (laser.has_value() != receiver.has_value()) {
    faults.add(map.node(), laser ? "laser" : "receiver",
               "needs '{}' too: echoes are simulated from both", laser ? "receiver" : "laser");
  }
  if (laser && receiver) {
    lidar.light.emplace();
    read_laser(std::move(*laser), *lidar.light, faults);
    read_receiver(std::move(*receiver), *lidar.light);
  }
  map.read_number("range_noise_sigma_m", Need::Optional, lidar.range_noise_sigma_m, not_negative);
  map.read_scaled("angular_jitter_mrad", Need::Optional, 1e-3, lidar.angular_jitter_rad);
}

}  // namespace

LidarSpec read_lidar(const Node& node, const fs::path& path, Faults& faults) {
  LidarSpec lidar;
  Map root(node, "", faults);
  check_version(root, "groundray_lidar", faults);
  root.read_text("model", Need::Required, lidar.model);
  lidar.pattern = read_pattern(root, path, faults);
  if (auto gate = root.map("range_gate_m", Need::Optional)) {
    gate->read_number("near", Need::Optional, lidar.gate.near_m, not_negative);
    gate->read_number("far", Need::Optional, lidar.gate.far_m, positive);
    if (lidar.gate.near_m >= lidar.gate.far_m) {
      faults.add(gate->node(), "range_gate_m", "near must be less than far: are they swapped?");
    }
    gate->close();
  }
  read_physics(root, lidar, faults);
  check_sources(root, faults);
  root.close();
  return lidar;
}

void change_lidar(Map& entry, const fs::path& path, LidarSpec& lidar, Faults& faults) {
  std::string unit;
  if (const Node* at = entry.read_text("calibration", Need::Optional, unit)) {
    try {
      lidar.pattern = calibrated(lidar.pattern, beside(path, unit));
    } catch (const Error& fault) {
      faults.add(*at, "calibration", "the calibration cannot be read:\n{}", fault.what());
    }
  }
  double rate_hz = 0;
  if (const Node* at = entry.read_number("rate_hz", Need::Optional, rate_hz, positive)) {
    if (auto* pattern = std::get_if<SpinningPattern>(&lidar.pattern)) {
      pattern->rate_hz = rate_hz;
      if (pattern->firing_period_s > 0) check_turn(*at, "rate_hz", *pattern, faults);
    } else {
      faults.add(*at, "rate_hz", "applies to spinning heads only; edit the lidar's file instead");
    }
  }
  glm::dvec2 gate(0);
  if (const Node* at = entry.read_vector("range_gate_m", Need::Optional, gate, not_negative)) {
    if (gate.x >= gate.y)
      faults.add(*at, "range_gate_m", "[{}, {}] is empty: are near and far swapped?", gate.x,
                 gate.y);
    lidar.gate = {gate.x, gate.y};
  }
  read_physics(entry, lidar, faults);
  entry.read_choice("error_bound", Need::Optional, lidar.error_bound, {"omit", "report"});
  entry.read_choice("no_returns", Need::Optional, lidar.no_returns, {"omit", "report"});
  entry.read_choice("boxes", Need::Optional, lidar.boxes, {"omit", "report"});
  entry.read_choice("waveforms", Need::Optional, lidar.waveforms, {"omit", "keep"});
  entry.read_choice("points", Need::Optional, lidar.points, {"as_fired", "at_stamp"});
}

}  // namespace groundray::yaml
