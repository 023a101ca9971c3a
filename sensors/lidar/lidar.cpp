#include "sensors/lidar/lidar.h"

#include <bit>
#include <cmath>

#include "core/error.h"

namespace groundray {
namespace {

BeamSpec with_one_level_more(BeamSpec beam) {
  const bool doubles = beam.sub_rays > 1 && beam.most_sub_rays >= beam.sub_rays &&
                       beam.most_sub_rays < LaserBeam::sub_ray_limit &&
                       std::has_single_bit(static_cast<unsigned>(beam.most_sub_rays));
  if (doubles) beam.most_sub_rays *= 2;
  return beam;
}

std::optional<EchoSimulator> light_of(const std::optional<LightSpec>& spec,
                                      const AtmosphereSpec& air, const RangeGate& gate) {
  if (!spec) return std::nullopt;
  return EchoSimulator(*spec, air, gate);
}

// Keeps the threshold of the noisy receiver in the dark.
std::optional<LightSpec> without_noise(const std::optional<EchoSimulator>& light) {
  if (!light) return std::nullopt;
  LightSpec spec = light->spec();
  spec.receiver.threshold_w = light->threshold_w();
  spec.receiver.noise.reset();
  return spec;
}

void check_lidar(const LidarSpec& spec) {
  Violations broken(spec.model.empty() ? "lidar" : spec.model);
  const RangeGate& gate = spec.gate;
  broken.unless(gate.near_m >= 0 && gate.near_m < gate.far_m,
                "range gate [{}, {}] m is empty or begins below 0: are near and far swapped?",
                gate.near_m, gate.far_m);
  broken.unless(spec.range_noise_sigma_m >= 0 && std::isfinite(spec.range_noise_sigma_m),
                "range noise of {} m must be finite and not negative", spec.range_noise_sigma_m);
  broken.unless(spec.angular_jitter_rad >= 0 && std::isfinite(spec.angular_jitter_rad),
                "angular jitter of {} rad must be finite and not negative",
                spec.angular_jitter_rad);
  broken.unless(spec.light || spec.beam.sub_rays == 1,
                "beam: {} sub-rays need light: echoes are detected by their energy",
                spec.beam.sub_rays);
  broken.unless(!spec.light || !spec.light->receiver.noise || std::isfinite(gate.far_m),
                "range gate is unbounded, so noise alone would cause infinitely many false alarms: "
                "give its far end");
  broken.unless(spec.light || spec.waveforms == LidarSpec::WaveformOutput::Omit,
                "waveforms need light");
  broken.throw_if_any();
}

}  // namespace

Lidar::Lidar(const LidarSpec& spec, const AtmosphereSpec& air)
    : spec_((check_lidar(spec), spec)),
      pattern_(spec.pattern),
      beam_(with_one_level_more(spec.beam)),
      last_level_(beam_.levels() -
                  (with_one_level_more(spec.beam).most_sub_rays > spec.beam.most_sub_rays ? 2 : 1)),
      light_(light_of(spec.light, air, spec.gate)),
      quiet_light_(light_of(without_noise(light_), air, spec.gate)) {}

}  // namespace groundray
