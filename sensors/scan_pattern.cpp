#include "sensors/scan_pattern.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/error.h"

namespace groundray {
namespace {

constexpr double full_turn_rad = 2 * std::numbers::pi;
constexpr double tolerance_turns = 1e-9;

void check(const SpinningPattern& pattern) {
  Violations broken("SpinningPattern");
  const double rate_hz = pattern.rate_hz;
  const double period_s = pattern.firing_period_s;
  broken.unless(rate_hz > 0 && std::isfinite(rate_hz), "rate_hz = {} must be positive and finite",
                rate_hz);
  broken.unless(period_s > 0 && std::isfinite(period_s),
                "firing_period_s = {} must be positive and finite", period_s);
  const double sequences = 1 / (rate_hz * period_s);
  broken.unless(sequences >= 1 - tolerance_turns && sequences <= ScanPattern::most_sequences,
                "a turn has {} firing sequences, but must have 1 to {}: is the period in seconds?",
                sequences, ScanPattern::most_sequences);
  broken.unless(std::isfinite(pattern.start_azimuth_rad), "start_azimuth_rad = {} must be finite",
                pattern.start_azimuth_rad);
  broken.unless(!pattern.beams.empty(), "beams: there must be at least one");
  for (std::size_t i = 0; i < pattern.beams.size(); ++i) {
    const Beam& beam = pattern.beams[i];
    broken.unless(std::abs(beam.elevation_rad) <= std::numbers::pi / 2,
                  "beams[{}].elevation_rad = {} must be in [-pi/2, pi/2]: is it in degrees?", i,
                  beam.elevation_rad);
    broken.unless(std::isfinite(beam.azimuth_offset_rad),
                  "beams[{}].azimuth_offset_rad = {} must be finite", i, beam.azimuth_offset_rad);
    const glm::dvec3& p = beam.origin_m;
    broken.unless(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z),
                  "beams[{}].origin_m = ({}, {}, {}) must be finite", i, p.x, p.y, p.z);
    broken.unless(beam.firing_time_s >= 0 && beam.firing_time_s < period_s,
                  "beams[{}].firing_time_s = {} must be in [0, firing_period_s)", i,
                  beam.firing_time_s);
  }
  broken.throw_if_any();
}

ScanPattern::Shot shot_of(const Beam& beam) {
  const double level = std::cos(beam.elevation_rad);
  return {.direction = {level * std::cos(beam.azimuth_offset_rad),
                        level * std::sin(beam.azimuth_offset_rad), std::sin(beam.elevation_rad)},
          .origin_m = beam.origin_m,
          .ring = beam.ring};
}

std::chrono::nanoseconds nearest_nanosecond(double time_s) {
  return std::chrono::nanoseconds(std::llround(time_s * 1e9));
}

// Returns the angle in [0, 2 pi). A tiny negative one would round up to the whole turn.
double wrapped(double angle_rad) {
  const double angle = std::fmod(angle_rad, full_turn_rad);
  const double positive = angle < 0 ? angle + full_turn_rad : angle;
  return positive < full_turn_rad ? positive : 0;
}

}  // namespace

ScanPattern::ScanPattern(const SpinningPattern& pattern)
    : rate_hz_(pattern.rate_hz),
      signed_rate_hz_(pattern.sense == SpinningPattern::Sense::Clockwise ? -pattern.rate_hz
                                                                         : pattern.rate_hz),
      start_azimuth_rad_(pattern.start_azimuth_rad),
      firing_period_s_(pattern.firing_period_s) {
  check(pattern);
  std::vector<Beam> beams = pattern.beams;
  std::ranges::stable_sort(beams, {}, &Beam::firing_time_s);
  for (const Beam& beam : beams) {
    const int index = static_cast<int>(shots_.size());
    if (volleys_.empty() || volleys_.back().firing_time_s != beam.firing_time_s) {
      volleys_.push_back({beam.firing_time_s, index, index});
    }
    volleys_.back().end = index + 1;
    shots_.push_back(shot_of(beam));
  }
}

std::int64_t ScanPattern::first_sequence(std::int64_t sweep) const {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  const double turns = static_cast<double>(sweep);
  // Rate, period, their product and the quotient are rounded once each.
  const double early_turns = tolerance_turns + 4 * epsilon * turns;
  const double sequence = std::ceil((turns - early_turns) / (rate_hz_ * firing_period_s_));
  return std::max<std::int64_t>(0, static_cast<std::int64_t>(sequence));
}

double ScanPattern::spin_rad(double time_s) const {
  const double whole_turns = std::floor(signed_rate_hz_ * time_s);
  // The product is not rounded before the whole turns are gone, so days do not wear the angle down.
  const double fraction = std::fma(signed_rate_hz_, time_s, -whole_turns);
  return wrapped(start_azimuth_rad_ + full_turn_rad * fraction);
}

std::chrono::nanoseconds ScanPattern::stamp(std::int64_t sweep) const {
  return nearest_nanosecond(firing_time_s(first_sequence(sweep), volleys_.front()));
}

std::chrono::nanoseconds ScanPattern::last_firing(std::int64_t sweep) const {
  return nearest_nanosecond(firing_time_s(first_sequence(sweep + 1) - 1, volleys_.back()));
}

}  // namespace groundray
