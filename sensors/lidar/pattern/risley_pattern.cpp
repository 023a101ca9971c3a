#include "sensors/lidar/pattern/risley_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

using std::numbers::pi;
constexpr std::size_t most_prisms = 3;
constexpr double sequence_tolerance = 1e-9;

// Returns a bound on the angle between x and light that leaves a prism after entering it at
// `angle_rad` or less; NaN or more than a right angle if light might not pass. A face deflects
// light by an angle that increases with the angle of incidence, so the worst case is light in the
// plane of the tilt.
double greatest_angle_rad(const WedgePrism& prism, double angle_rad) {
  const double index = prism.refractive_index;
  if (prism.tilted == WedgePrism::Tilted::Exit) {
    const double inside = math::asin(math::sin(angle_rad) / index) + prism.wedge_rad;
    return math::asin(index * math::sin(inside)) - prism.wedge_rad;
  }
  const double incidence = angle_rad + prism.wedge_rad;
  if (!(incidence < pi / 2)) return std::numeric_limits<double>::quiet_NaN();
  const double inside = angle_rad + incidence - math::asin(math::sin(incidence) / index);
  return math::asin(index * math::sin(inside));
}

void check_prisms(const RisleyPattern& pattern, Violations& broken) {
  broken.unless(!pattern.prisms.empty() && pattern.prisms.size() <= most_prisms,
                "prisms: there are {}, but there must be 1 to {}", pattern.prisms.size(),
                most_prisms);
  double angle_rad = 0;
  for (const Beam& beam : pattern.beams) {
    const double cosine = math::cos(beam.elevation_rad) * math::cos(beam.azimuth_offset_rad);
    angle_rad = std::max(angle_rad, math::acos(std::clamp(cosine, -1., 1.)));
  }
  broken.unless(angle_rad < pi / 2, "beams: one is {} rad off the x axis and misses the prisms",
                angle_rad);
  for (std::size_t i = 0; i < pattern.prisms.size(); ++i) {
    const WedgePrism& prism = pattern.prisms[i];
    broken.unless(prism.refractive_index >= 1 && prism.refractive_index <= 5,
                  "prisms[{}].refractive_index = {} must be from 1 to 5", i,
                  prism.refractive_index);
    broken.unless(prism.wedge_rad >= 0 && prism.wedge_rad < pi / 2,
                  "prisms[{}].wedge_rad = {} must be in [0, pi/2): is it in degrees?", i,
                  prism.wedge_rad);
    broken.unless(std::isfinite(prism.rate_hz), "prisms[{}].rate_hz = {} must be finite", i,
                  prism.rate_hz);
    broken.unless(std::isfinite(prism.base_rad), "prisms[{}].base_rad = {} must be finite", i,
                  prism.base_rad);
    angle_rad = greatest_angle_rad(prism, angle_rad);
    broken.unless(
        angle_rad < pi / 2,
        "prisms[{}]: total internal reflection may occur at a face: make the wedges thinner", i);
  }
}

void check_risley_pattern(const RisleyPattern& pattern) {
  Violations broken("RisleyPattern");
  const double period_s = pattern.firing_period_s;
  broken.unless(period_s > 0 && std::isfinite(period_s),
                "firing_period_s = {} must be positive and finite", period_s);
  broken.unless(pattern.sweep_rate_hz > 0 && std::isfinite(pattern.sweep_rate_hz),
                "sweep_rate_hz = {} must be positive and finite", pattern.sweep_rate_hz);
  const double sequences = 1 / (pattern.sweep_rate_hz * period_s);
  broken.unless(sequences >= 1 - sequence_tolerance && sequences <= RisleyScan::most_sequences,
                "a sweep has {} firing sequences, but must have 1 to {}: is the period in seconds?",
                sequences, RisleyScan::most_sequences);
  broken.unless(!pattern.beams.empty(), "beams: there must be at least one");
  for (std::size_t i = 0; i < pattern.beams.size(); ++i) {
    const Beam& beam = pattern.beams[i];
    broken.unless(
        std::abs(beam.elevation_rad) <= pi / 2 && std::abs(beam.azimuth_offset_rad) <= pi / 2,
        "beams[{}]: its angles ({}, {}) must be in [-pi/2, pi/2]: are they in degrees?", i,
        beam.azimuth_offset_rad, beam.elevation_rad);
    broken.unless(beam.firing_time_s >= 0 && beam.firing_time_s < period_s,
                  "beams[{}].firing_time_s = {} must be in [0, firing_period_s)", i,
                  beam.firing_time_s);
    broken.unless(beam.loop == 0 && beam.origin_m == glm::dvec3(0),
                  "beams[{}]: loop and origin_m must be 0 with prisms", i);
  }
  check_prisms(pattern, broken);
  broken.throw_if_any();
}

FiringCycle sequence_of(const RisleyPattern& pattern) {
  check_risley_pattern(pattern);
  std::vector<FiringCycle::Firing> firings;
  for (const Beam& beam : pattern.beams) {
    firings.push_back(firing_towards(beam.azimuth_offset_rad, beam.elevation_rad));
    firings.back().firing_time_s = beam.firing_time_s;
    firings.back().shot.ring = beam.ring;
  }
  return {std::move(firings), pattern.firing_period_s, {}};
}

// Normals of a prism's two faces at a time, pointing along the light.
struct Faces {
  glm::dvec3 entry{1, 0, 0};
  glm::dvec3 exit{1, 0, 0};
  double index = 1;

  Faces() = default;
  Faces(const WedgePrism& prism, double time_s) : index(prism.refractive_index) {
    const double base_rad = prism.base_rad + 2 * pi * turn_fraction(prism.rate_hz, time_s);
    const double sine = math::sin(prism.wedge_rad);
    const glm::dvec3 to_base(0, sine * math::cos(base_rad), sine * math::sin(base_rad));
    const glm::dvec3 axis(math::cos(prism.wedge_rad), 0, 0);
    if (prism.tilted == WedgePrism::Tilted::Exit) {
      exit = axis - to_base;
    } else {
      entry = axis + to_base;
    }
  }
};

// Returns the horizontal unit vector perpendicular to `direction`, to the left: towards increasing
// azimuth.
glm::dvec3 level_left(const glm::dvec3& direction) {
  const double level = math::hypot(direction.x, direction.y);
  return level > 0 ? glm::dvec3(-direction.y / level, direction.x / level, 0) : glm::dvec3(0, 1, 0);
}

}  // namespace

glm::dvec3 refracted(const glm::dvec3& direction, const glm::dvec3& normal, double ratio) noexcept {
  const double cosine = glm::dot(direction, normal);
  const double squared = 1 - ratio * ratio * (1 - cosine * cosine);
  return glm::normalize(ratio * direction +
                        (std::sqrt(std::max(squared, 0.)) - ratio * cosine) * normal);
}

RisleyScan::RisleyScan(const RisleyPattern& pattern)
    : prisms_(pattern.prisms),
      sweep_rate_hz_(pattern.sweep_rate_hz),
      sequence_(sequence_of(pattern)) {}

SweepPulses RisleyScan::runs(std::int64_t sweep) const noexcept {
  const auto first = [&](std::int64_t number) {
    return sequence_.pulses_before(sequence_.first_sequence(number, sweep_rate_hz_));
  };
  return {{{first(sweep), first(sweep + 1)}, {}}};
}

void RisleyScan::refract(PulseBatch& batch) const noexcept {
  for (const PulseBatch::Volley& volley : batch.volleys) {
    std::array<Faces, most_prisms> faces;
    for (std::size_t i = 0; i < prisms_.size(); ++i) faces[i] = Faces(prisms_[i], volley.time_s);
    for (std::size_t row = volley.begin; row < volley.end; ++row) {
      glm::dvec3 direction = batch.direction[row];
      for (std::size_t i = 0; i < prisms_.size(); ++i) {
        direction = refracted(direction, faces[i].entry, 1 / faces[i].index);
        direction = refracted(direction, faces[i].exit, faces[i].index);
      }
      batch.direction[row] = direction;
      batch.horizontal[row] = level_left(direction);
    }
  }
}

}  // namespace groundray
