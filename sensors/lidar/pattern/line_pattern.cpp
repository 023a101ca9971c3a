#include "sensors/lidar/pattern/line_pattern.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

using Mirror = LinePattern::Mirror;

using std::numbers::pi;
// Tolerance for rates and angles, which are decimal figures that doubles approximate.
constexpr double rate_tolerance = 1e-9;
constexpr int most_facets = 1000;
constexpr int most_lines = 1'000'000;

// Returns the fraction of a line's time in which pulses are fired.
double active_fraction(const LinePattern& pattern) {
  if (pattern.mirror != Mirror::Polygon) return 1;
  return std::abs(pattern.to_rad - pattern.from_rad) * pattern.facets / (4 * pi);
}

// Returns the number of pulses per line. A laser never fires faster than its rate, so the last
// pulse keeps its distance to the next line. With a polygon the dead time ensures that, and the
// last pulse may lie at the end of the field of view.
double pulses_of_line(const LinePattern& pattern) {
  const double fraction = active_fraction(pattern);
  const double steps = fraction * pattern.pulse_rate_hz / pattern.line_rate_hz;
  return std::floor(steps * (1 + rate_tolerance)) + (fraction < 1 - rate_tolerance ? 1 : 0);
}

void check_polygon(const LinePattern& pattern, Violations& broken) {
  if (pattern.mirror != Mirror::Polygon) {
    broken.unless(pattern.facets == 0, "facets = {} applies to polygon mirrors only: remove it",
                  pattern.facets);
    return;
  }
  broken.unless(pattern.facets >= 3 && pattern.facets <= most_facets,
                "facets = {} must be from 3 to {}", pattern.facets, most_facets);
  broken.unless(
      active_fraction(pattern) <= 1 + rate_tolerance,
      "one of {} facets sweeps {:.6g} rad, less than the {:.6g} rad from from_rad to to_rad",
      pattern.facets, 4 * pi / pattern.facets, std::abs(pattern.to_rad - pattern.from_rad));
}

void check_line_pattern(const LinePattern& pattern) {
  Violations broken("LinePattern");
  const auto check_positive = [&](double value, const char* name) {
    broken.unless(value > 0 && std::isfinite(value), "{} = {} must be positive and finite", name,
                  value);
  };
  check_positive(pattern.line_rate_hz, "line_rate_hz");
  check_positive(pattern.pulse_rate_hz, "pulse_rate_hz");
  for (const double angle_rad : {pattern.from_rad, pattern.to_rad}) {
    broken.unless(std::abs(angle_rad) <= 2 * pi,
                  "scan angle {} must be in [-2 pi, 2 pi]: is it in degrees?", angle_rad);
  }
  broken.unless(pattern.from_rad != pattern.to_rad, "from_rad = to_rad = {}: the line is empty",
                pattern.from_rad);
  broken.unless(std::isfinite(pattern.head_rate_hz), "head_rate_hz = {} must be finite",
                pattern.head_rate_hz);
  broken.unless(std::isfinite(pattern.head_start_rad), "head_start_rad = {} must be finite",
                pattern.head_start_rad);
  broken.unless(pattern.lines_per_sweep >= 1 && pattern.lines_per_sweep <= most_lines,
                "lines_per_sweep = {} must be from 1 to {}", pattern.lines_per_sweep, most_lines);
  check_polygon(pattern, broken);
  const double pulses = pulses_of_line(pattern);
  broken.unless(pulses >= 1 && pulses <= LineScan::most_pulses_per_line,
                "a line has {} pulses, but must have 1 to {}: are the rates in Hz?", pulses,
                LineScan::most_pulses_per_line);
  broken.throw_if_any();
}

// Returns the scan angle at a fraction `part` of a line's time; `back` is true for every other line
// of a mirror that oscillates.
double scan_angle_rad(const LinePattern& pattern, double part, bool back) {
  const double from = back ? pattern.to_rad : pattern.from_rad;
  const double to = back ? pattern.from_rad : pattern.to_rad;
  if (pattern.mirror == Mirror::Sine) {
    return (from + to) / 2 + (from - to) / 2 * math::cos(pi * part);
  }
  if (pattern.mirror == Mirror::Triangle) return from + (to - from) * part;
  const double sweep_rad = std::copysign(4 * pi / pattern.facets, to - from);
  return (from + to) / 2 + sweep_rad * (part - 0.5);
}

FiringCycle::Firing firing_at(LinePattern::Plane plane, double angle_rad) {
  const double cosine = math::cos(angle_rad);
  const double sine = math::sin(angle_rad);
  FiringCycle::Firing firing;
  if (plane == LinePattern::Plane::Upright) {
    firing.shot.direction = {cosine, 0, sine};
    firing.horizontal = {0, 1, 0};
  } else {
    firing.shot.direction = {0, sine, -cosine};
    firing.horizontal = {0, cosine, sine};
  }
  return firing;
}

FiringCycle line_cycle(const LinePattern& pattern) {
  check_line_pattern(pattern);
  const auto pulses = static_cast<int>(pulses_of_line(pattern));
  const double period_s = 1 / pattern.line_rate_hz;
  const double begin_s = period_s * std::max(0., 1 - active_fraction(pattern)) / 2;
  std::vector<FiringCycle::Firing> firings;
  for (int line = 0; line < (pattern.mirror == Mirror::Polygon ? 1 : 2); ++line) {
    for (int pulse = 0; pulse < pulses; ++pulse) {
      const double time_s = begin_s + pulse / pattern.pulse_rate_hz;
      const double angle_rad = scan_angle_rad(pattern, time_s * pattern.line_rate_hz, line == 1);
      firings.push_back(firing_at(pattern.plane, angle_rad));
      firings.back().sequence = line;
      firings.back().firing_time_s = time_s;
    }
  }
  return {std::move(firings), period_s, HeadTurn{pattern.head_rate_hz, pattern.head_start_rad}};
}

}  // namespace

LineScan::LineScan(const LinePattern& pattern)
    : lines_per_sweep_(pattern.lines_per_sweep),
      cycle_(line_cycle(pattern)),
      pulses_per_line_(static_cast<std::int64_t>(pulses_of_line(pattern))) {}

}  // namespace groundray
