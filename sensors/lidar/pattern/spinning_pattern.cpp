#include "sensors/lidar/pattern/spinning_pattern.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

using std::numbers::pi;
constexpr double tolerance_turns = 1e-9;
constexpr int most_loops = 1000;

void check_beam(const Beam& beam, std::size_t i, double period_s, Violations& broken) {
  broken.unless(std::abs(beam.elevation_rad) <= pi / 2,
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
  broken.unless(beam.loop >= 0 && beam.loop < most_loops, "beams[{}].loop = {} must be in [0, {})",
                i, beam.loop, most_loops);
}

void check_view(const AzimuthInterval& view, double step_rad, Violations& broken) {
  const double width_rad = view.to_rad - view.from_rad;
  broken.unless(std::isfinite(view.from_rad) && std::isfinite(view.to_rad) &&
                    width_rad <= 2 * pi * (1 + tolerance_turns),
                "field_of_view = [{}, {}] rad must be finite and at most one turn wide: is it in "
                "degrees?",
                view.from_rad, view.to_rad);
  // A narrower interval would leave some turns without a pulse.
  broken.unless(!(width_rad < step_rad),
                "field_of_view = [{}, {}] rad is narrower than the {} rad from one firing sequence "
                "to the next: are its ends swapped?",
                view.from_rad, view.to_rad, step_rad);
}

void check_loops(const std::vector<Beam>& beams, Violations& broken) {
  std::set<int> loops;
  for (const Beam& beam : beams) loops.insert(beam.loop);
  broken.unless(loops.empty() || *loops.rbegin() + 1 == static_cast<int>(loops.size()),
                "beams: {} loops are used, but the greatest is {}: number them from 0 without gaps",
                loops.size(), loops.empty() ? 0 : *loops.rbegin());
}

void check_spinning_pattern(const SpinningPattern& pattern) {
  Violations broken("SpinningPattern");
  const double rate_hz = pattern.rate_hz;
  const double period_s = pattern.firing_period_s;
  broken.unless(rate_hz > 0 && std::isfinite(rate_hz), "rate_hz = {} must be positive and finite",
                rate_hz);
  broken.unless(period_s > 0 && std::isfinite(period_s),
                "firing_period_s = {} must be positive and finite", period_s);
  const double sequences = 1 / (rate_hz * period_s);
  broken.unless(sequences >= 1 - tolerance_turns && sequences <= SpinningScan::most_sequences,
                "a turn has {} firing sequences, but must have 1 to {}: is the period in seconds?",
                sequences, SpinningScan::most_sequences);
  broken.unless(std::isfinite(pattern.start_azimuth_rad), "start_azimuth_rad = {} must be finite",
                pattern.start_azimuth_rad);
  broken.unless(!pattern.beams.empty(), "beams: there must be at least one");
  for (std::size_t i = 0; i < pattern.beams.size(); ++i) {
    check_beam(pattern.beams[i], i, period_s, broken);
  }
  check_loops(pattern.beams, broken);
  if (pattern.field_of_view) {
    check_view(*pattern.field_of_view, 2 * pi / sequences, broken);
  }
  broken.throw_if_any();
}

double signed_rate_hz(const SpinningPattern& pattern) {
  return pattern.sense == SpinningPattern::Sense::Clockwise ? -pattern.rate_hz : pattern.rate_hz;
}

std::vector<FiringCycle::Firing> firings_of(const SpinningPattern& pattern) {
  std::vector<FiringCycle::Firing> firings;
  firings.reserve(pattern.beams.size());
  for (const Beam& beam : pattern.beams) {
    FiringCycle::Firing firing = firing_towards(beam.azimuth_offset_rad, beam.elevation_rad);
    firing.sequence = beam.loop;
    firing.firing_time_s = beam.firing_time_s;
    firing.shot.origin_m = beam.origin_m;
    firing.shot.ring = beam.ring;
    firings.push_back(firing);
  }
  return firings;
}

FiringCycle spinning_cycle(const SpinningPattern& pattern) {
  check_spinning_pattern(pattern);
  return {firings_of(pattern), pattern.firing_period_s,
          HeadTurn{signed_rate_hz(pattern), pattern.start_azimuth_rad}};
}

}  // namespace

FiringCycle::Firing firing_towards(double azimuth_rad, double elevation_rad) noexcept {
  const double level = math::cos(elevation_rad);
  const double cosine = math::cos(azimuth_rad);
  const double sine = math::sin(azimuth_rad);
  FiringCycle::Firing firing;
  firing.shot.direction = {level * cosine, level * sine, math::sin(elevation_rad)};
  firing.horizontal = {-sine, cosine, 0};
  return firing;
}

SpinningScan::SpinningScan(const SpinningPattern& pattern)
    : rate_hz_(pattern.rate_hz), cycle_(spinning_cycle(pattern)) {
  if (!pattern.field_of_view) return;
  const auto [from_rad, to_rad] = *pattern.field_of_view;
  const double width = (to_rad - from_rad) / (2 * pi);
  if (width >= 1 - tolerance_turns) return;
  const double ahead_rad = pattern.sense == SpinningPattern::Sense::Clockwise
                               ? pattern.start_azimuth_rad - to_rad
                               : from_rad - pattern.start_azimuth_rad;
  const double turns = ahead_rad / (2 * pi);
  const double open = turns - std::floor(turns);
  window_ = Window{open < 1 - tolerance_turns ? open : 0, width};
}

SweepPulses SpinningScan::runs(std::int64_t sweep) const noexcept {
  const NumberRange turn{first_sequence(sweep), first_sequence(sweep + 1)};
  const auto pulses = [&](std::int64_t begin, std::int64_t end) {
    begin = std::clamp(begin, turn.begin, turn.end);
    end = std::clamp(end, begin, turn.end);
    return NumberRange{cycle_.pulses_before(begin), cycle_.pulses_before(end)};
  };
  if (!window_) return {pulses(turn.begin, turn.end), {}};
  const double turns = static_cast<double>(sweep);
  const double step = rate_hz_ * cycle_.period_s();
  const auto from = [&](double at) {
    return static_cast<std::int64_t>(std::ceil((at - slack_turns(turns)) / step));
  };
  const auto past = [&](double at) {
    return static_cast<std::int64_t>(std::floor((at + slack_turns(turns)) / step)) + 1;
  };
  const auto [open, width] = *window_;
  const bool wraps = open + width >= 1 - tolerance_turns;
  const std::int64_t tail_end = wraps ? past(turns + (open + width - 1)) : turn.begin;
  return {pulses(turn.begin, tail_end),
          pulses(std::max(from(turns + open), tail_end), past(turns + (open + width)))};
}

}  // namespace groundray
