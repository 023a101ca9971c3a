#include "sensors/lidar/pattern/firing_cycle.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include "core/math.h"

namespace groundray {
namespace {

using std::numbers::pi;

// Returns the angle wrapped to [0, 2 pi). A tiny negative angle would round up to the whole turn.
double wrapped(double angle_rad) {
  const bool inside = std::abs(angle_rad) < 2 * pi;  // fmod would return its argument
  const double angle = inside ? angle_rad : std::fmod(angle_rad, 2 * pi);
  const double from_zero = angle < 0 ? angle + 2 * pi : angle;
  return from_zero < 2 * pi ? from_zero : 0;
}

// std::fma is explicit because GCC 12 fuses this pair wherever it vectorises it (vfmaddsub), even
// with -ffp-contract=off: a pulse would then depend on its position in the loop.
glm::dvec3 turned(const glm::dvec3& v, double cosine, double sine) {
  return {std::fma(-sine, v.y, cosine * v.x), std::fma(sine, v.x, cosine * v.y), v.z};
}

// Writes the shots of a volley, rotated about z, to the rows of a batch from `row` on.
void turn(std::span<const FiringCycle::Shot> shots, const glm::dvec3* horizontal, double cosine,
          double sine, PulseBatch& batch, std::size_t row) {
  glm::dvec3* const directions = batch.direction.data() + row;
  glm::dvec3* const origins_m = batch.origin_m.data() + row;
  glm::dvec3* const horizontals = batch.horizontal.data() + row;
  std::uint16_t* const rings = batch.ring.data() + row;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    directions[i] = turned(shots[i].direction, cosine, sine);
    origins_m[i] = turned(shots[i].origin_m, cosine, sine);
    horizontals[i] = turned(horizontal[i], cosine, sine);
    rings[i] = shots[i].ring;
  }
}

}  // namespace

double turn_fraction(double rate_hz, double time_s) noexcept {
  const double whole_turns = std::floor(rate_hz * time_s);
  return std::fma(rate_hz, time_s, -whole_turns);
}

double slack_turns(double turns) noexcept {
  return 1e-9 + 4 * std::numeric_limits<double>::epsilon() * turns;
}

double HeadTurn::angle_rad(double time_s) const noexcept {
  return wrapped(start_rad + 2 * pi * turn_fraction(rate_hz, time_s));
}

FiringCycle::FiringCycle(std::vector<Firing> firings, double period_s, const HeadTurn& head)
    : period_s_(period_s),
      head_(head),
      fixed_cos_(math::cos(head.start_rad)),
      fixed_sin_(math::sin(head.start_rad)) {
  std::ranges::stable_sort(firings, {}, [](const Firing& firing) {
    return std::tuple(firing.sequence, firing.firing_time_s);
  });
  shots_.reserve(firings.size());
  for (const Firing& firing : firings) {
    const int index = static_cast<int>(shots_.size());
    const bool new_sequence = volleys_.empty() || volleys_.back().sequence != firing.sequence;
    if (new_sequence) first_shot_.push_back(index);
    if (new_sequence || volleys_.back().firing_time_s != firing.firing_time_s) {
      volleys_.push_back({firing.firing_time_s, index, index, firing.sequence});
    }
    volleys_.back().end = index + 1;
    shots_.push_back(firing.shot);
    horizontal_.push_back(firing.horizontal);
  }
  assert(!volleys_.empty() && volleys_.back().sequence + 1 == sequences());
}

std::int64_t FiringCycle::first_sequence(std::int64_t turn, double rate_hz) const noexcept {
  const double turns = static_cast<double>(turn);
  const double sequence = std::ceil((turns - slack_turns(turns)) / (rate_hz * period_s_));
  return std::max<std::int64_t>(0, static_cast<std::int64_t>(sequence));
}

std::int64_t FiringCycle::pulses_before(std::int64_t sequence) const noexcept {
  return sequence / sequences() * cycle_pulses() +
         first_shot_[static_cast<std::size_t>(sequence % sequences())];
}

FiringCycle::Place FiringCycle::place_of(std::int64_t pulse) const noexcept {
  const int shot = static_cast<int>(pulse % cycle_pulses());
  const auto volley = std::ranges::upper_bound(volleys_, shot, {}, &Volley::begin) - 1;
  return {pulse / cycle_pulses(), static_cast<std::size_t>(volley - volleys_.begin()), shot};
}

double FiringCycle::pulse_time_s(std::int64_t pulse) const noexcept {
  const Place place = place_of(pulse);
  return time_s(place.cycle, volleys_[place.volley]);
}

void FiringCycle::fill(NumberRange pulses, PulseBatch& batch, std::size_t row) const {
  if (pulses.begin >= pulses.end) return;
  auto [cycle, v, shot] = place_of(pulses.begin);
  double cosine = fixed_cos_;
  double sine = fixed_sin_;
  for (std::int64_t left = pulses.end - pulses.begin; left > 0;) {
    const Volley& volley = volleys_[v];
    const double time = time_s(cycle, volley);
    if (head_.rate_hz != 0) {
      const double angle_rad = head_.angle_rad(time);
      cosine = math::cos(angle_rad);
      sine = math::sin(angle_rad);
    }
    const auto count = static_cast<int>(std::min<std::int64_t>(left, volley.end - shot));
    const auto first = static_cast<std::size_t>(shot);
    const auto fired = static_cast<std::size_t>(count);
    batch.volleys.push_back({time, row, row + fired});
    turn({shots_.data() + first, fired}, horizontal_.data() + first, cosine, sine, batch, row);
    row += fired;
    shot += count;
    left -= count;
    if (++v < volleys_.size()) continue;
    v = 0;
    shot = 0;
    ++cycle;
  }
}

}  // namespace groundray
