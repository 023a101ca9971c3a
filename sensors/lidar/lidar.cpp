#include "sensors/lidar/lidar.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

// Returns the limit of refinement at which neighbouring sub-rays, about 2 w / sqrt(n) apart on a
// plane at 87 degrees at the end of the range gate, differ in range by the resolution.
int derived_limit(const LidarSpec& spec, double resolution_m) {
  constexpr int most = 1024;
  constexpr double tangent = 19.08;  // of 87 degrees
  const auto half_width_m = [&](int i) {
    const double tilt = math::tan(0.5 * spec.beam.divergence_rad[i]);
    return 0.5 * spec.beam.aperture_m[i] + (tilt > 0 ? tilt * spec.gate.far_m : 0);
  };
  const double steps = 2 * tangent * std::max(half_width_m(0), half_width_m(1)) / resolution_m;
  int limit = spec.beam.sub_rays;
  while (limit > 1 && limit < most && limit < steps * steps) limit *= 2;
  return limit;
}

BeamSpec beam_of(const LidarSpec& spec, const std::optional<EchoSimulator>& light) {
  BeamSpec beam = spec.beam;
  if (!beam.most_sub_rays && light) beam.most_sub_rays = derived_limit(spec, light->resolution_m());
  return beam;
}

BeamSpec with_one_level_more(BeamSpec beam) {
  const int most = beam.most_sub_rays.value_or(beam.sub_rays);
  const bool doubles = beam.sub_rays > 1 && most >= beam.sub_rays &&
                       most < LaserBeam::sub_ray_limit &&
                       std::has_single_bit(static_cast<unsigned>(most));
  if (doubles) beam.most_sub_rays = 2 * most;
  return beam;
}

// Returns the level that has `sub_rays`, or the only one.
int level_of(const LaserBeam& beam, const std::optional<int>& sub_rays) {
  int level = 0;
  while (sub_rays && beam.sub_rays(level).size() < static_cast<std::size_t>(*sub_rays)) ++level;
  return level;
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
  constexpr double most_noise_m = 1000, most_jitter_rad = 1;  // far beyond any data sheet
  broken.unless(spec.range_noise_sigma_m >= 0 && spec.range_noise_sigma_m <= most_noise_m,
                "range noise of {} m must be from 0 to {} m", spec.range_noise_sigma_m,
                most_noise_m);
  broken.unless(spec.angular_jitter_rad >= 0 && spec.angular_jitter_rad <= most_jitter_rad,
                "angular jitter of {} rad must be from 0 to {} rad", spec.angular_jitter_rad,
                most_jitter_rad);
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
      light_(light_of(spec.light, air, spec.gate)),
      quiet_light_(light_of(without_noise(light_), air, spec.gate)),
      beam_(with_one_level_more(beam_of(spec, light_))),
      last_level_(level_of(beam_, beam_of(spec, light_).most_sub_rays)) {
  if (light_ && spec.beam.sub_rays > 1)
    planes_.emplace(spec.beam.profile, light_->even_spacing_m(), light_->resolution_m());
}

void Convergence::Changes::add(double change) {
  sum_squares += change * change;
  largest = std::max(largest, std::abs(change));
  ++count;
}

void Convergence::Changes::add(const Changes& other) {
  sum_squares += other.sum_squares;
  largest = std::max(largest, other.largest);
  count += other.count;
}

double Convergence::Changes::rms() const {
  return count > 0 ? std::sqrt(sum_squares / static_cast<double>(count)) : 0;
}

void Convergence::add(const Convergence& other) {
  pulses += other.pulses;
  changed += other.changed;
  range_m.add(other.range_m);
  true_m.add(other.true_m);
  share.add(other.share);
}

}  // namespace groundray
