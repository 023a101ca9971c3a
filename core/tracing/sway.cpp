// The wind is frozen turbulence: a field of speeds that travels with the mean wind. It consists of
// plane waves at quantiles of Kaimal's spectrum, each with the same variance. Plants lean in
// proportion to the speed. They follow the waves at once, and resonate with the part of the
// spectrum at their natural frequency.
#include "core/tracing/sway.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/elementary.h"
#include "core/error.h"
#include "core/math.h"
#include "core/mixed_bits.h"
#include "core/pack.h"

namespace groundray {
namespace {

constexpr double wind_height_m = 10;      // of the wind's speed
constexpr double reference_m_s = 10;      // wind of Flexibility::lean_rad
constexpr double damping_ratio = 0.1;     // of plants
constexpr double variance_of_wave = 0.2;  // share of the spectrum's
// Standard deviation of the speed across the wind, over that along it: the root of the ratio of the
// integrals of Kaimal's spectra, 17 / 9.5 and 105 / 33.
constexpr double across_share = 0.7498;

// Returns the reduced frequency, f z / U, below which the spectrum 105 n / (1 + 33 n)^(5/3) has a
// share of its variance.
double quantile(double share) { return (math::pow(1 - share, -1.5) - 1) / 33; }

// Returns the variance of an oscillator's response to the spectrum near its own frequency, over the
// variance of the spectrum: density times bandwidth.
double resonance(double reduced_frequency) {
  const double density = 22 * reduced_frequency * math::pow(1 + 33 * reduced_frequency, -5.0 / 3);
  return density * std::numbers::pi / (4 * damping_ratio);
}

// Returns a number in [0, 1).
double uniform(std::uint64_t variant, std::size_t index) {
  const std::uint64_t bits = mixed_bits(mixed_bits(variant) + (index + 1) * golden_step);
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

void check_sway(const Wind& wind, const Flexibility& plant) {
  Violations broken("Wind");
  broken.unless(wind.speed_m_s == 0 || (0.1 <= wind.speed_m_s && wind.speed_m_s <= 30),
                "speed_m_s = {} must be 0, or from 0.1 to 30", wind.speed_m_s);
  broken.unless(std::abs(glm::length(wind.towards) - 1) <= 1e-9,
                "towards = ({}, {}) must be a unit vector", wind.towards.x, wind.towards.y);
  broken.unless(0 <= wind.turbulence && wind.turbulence <= 0.5,
                "turbulence = {} must be from 0 to 0.5", wind.turbulence);
  broken.unless(0.01 <= plant.frequency_hz && plant.frequency_hz <= 100,
                "frequency_hz = {} of a plant must be from 0.01 to 100", plant.frequency_hz);
  broken.unless(0 <= plant.lean_rad && plant.lean_rad <= 1,
                "lean_rad = {} of a plant must be from 0 to 1", plant.lean_rad);
  broken.throw_if_any();
}

glm::dvec2 left_of(const glm::dvec2& v) noexcept { return {-v.y, v.x}; }

}  // namespace

Sway::Sway(const Wind& wind, const Flexibility& plant)
    : speed_m_s_(wind.speed_m_s), towards_(wind.towards), origin_w_m_(wind.origin_w_m) {
  check_sway(wind, plant);
  if (wind.speed_m_s == 0) return;
  tangent_per_m_s_ = math::tan(plant.lean_rad) / reference_m_s;
  const double deviation_m_s = wind.turbulence * wind.speed_m_s;
  const double per_reduced_hz = wind.speed_m_s / wind_height_m;
  const double shaken = resonance(plant.frequency_hz / per_reduced_hz);
  for (std::size_t i = 0; i < waves_.size(); ++i) {
    Wave& wave = waves_[i];
    if (i < gusts) {
      const double middle = (static_cast<double>(i) + 0.5) * variance_of_wave;
      wave.rate_hz = quantile(middle) * per_reduced_hz;
      wave.amplitude_m_s = deviation_m_s * std::sqrt(2 * variance_of_wave);
    } else {
      const double side = i == gusts ? -0.5 : 0.5;  // within the width of the resonance
      wave.rate_hz = plant.frequency_hz * (1 + side * damping_ratio);
      wave.amplitude_m_s = deviation_m_s * std::sqrt(2 * shaken / resonances);
    }
    const double slant = uniform(wind.variant, 2 * i) * 1.2 - 0.6;  // at most 31 degrees
    wave.turns_per_m =
        wave.rate_hz / wind.speed_m_s * (wind.towards + slant * left_of(wind.towards));
    wave.turn = uniform(wind.variant, 2 * i + 1);
  }
}

auto Sway::phases(const glm::dvec2& p_D, double scale) const noexcept -> Phases {
  Phases phases;
  for (std::size_t i = 0; i < waves_.size(); ++i) {
    const Wave& wave = waves_[i];
    const double factor = i < gusts ? 1 : 1 / scale;
    const double turn = wave.turn - factor * glm::dot(wave.turns_per_m, p_D + origin_w_m_);
    phases[i] = {factor * wave.rate_hz, turn - std::floor(turn)};
  }
  return phases;
}

template <typename Real>
void Sway::tangent(const Phases& phases, const Real& time_s, Real& x, Real& y) const noexcept {
  using std::floor;
  Real along(speed_m_s_), across(0.0);
  for (std::size_t i = 0; i < waves_.size(); ++i) {
    const Real turns = time_s * phases[i].rate_hz + phases[i].turn;
    const Vec2<Real> point = on_circle(Real(turns - floor(turns)));
    along += waves_[i].amplitude_m_s * point.x;
    across += across_share * waves_[i].amplitude_m_s * point.y;
  }
  x = tangent_per_m_s_ * (along * towards_.x - across * towards_.y);
  y = tangent_per_m_s_ * (along * towards_.y + across * towards_.x);
}

void Sway::lean(const glm::dvec2& p_D, double scale, std::span<const double> times_s,
                std::span<Lean> leans) const noexcept {
  const Phases waves = phases(p_D, scale);
  for (std::size_t begin = 0; begin < times_s.size(); begin += pack_size) {
    const std::size_t count = std::min(pack_size, times_s.size() - begin);
    const Pack time_s =
        pack_of([&](std::size_t lane) { return times_s[begin + std::min(lane, count - 1)]; });
    Pack x, y;
    tangent(waves, time_s, x, y);
    const Pack secant = sqrt(x * x + y * y + 1.0);
    for (std::size_t lane = 0; lane < count; ++lane)
      leans[begin + lane] = {{x[lane], y[lane]}, secant[lane]};
  }
}

Lean Sway::lean(const glm::dvec2& p_D, double scale, double time_s) const noexcept {
  Lean lean;
  this->lean(p_D, scale, std::span(&time_s, 1), std::span(&lean, 1));
  return lean;
}

glm::dvec3 Sway::velocity_m_s(const glm::dvec2& p_D, double scale, double time_s,
                              double height_m) const noexcept {
  const Phases waves = phases(p_D, scale);
  double along = 0, across = 0;  // derivatives by time
  for (std::size_t i = 0; i < waves_.size(); ++i) {
    const double turns = time_s * waves[i].rate_hz + waves[i].turn;
    const glm::dvec2 point = on_circle(turns - std::floor(turns));
    const double speed = 2 * std::numbers::pi * waves[i].rate_hz * waves_[i].amplitude_m_s;
    along -= speed * point.y;
    across += across_share * speed * point.x;
  }
  const glm::dvec2 change = tangent_per_m_s_ * (along * towards_ + across * left_of(towards_));
  const auto [slope, secant] = lean(p_D, scale, time_s);
  const double sinking = glm::dot(slope, change) / (secant * secant);  // of the height, relative
  return height_m * glm::dvec3(change - slope * sinking, -sinking);
}

Sway::Range Sway::range() const noexcept {
  double amplitude_m_s = 0;
  for (const Wave& wave : waves_) amplitude_m_s += wave.amplitude_m_s * (1 + 1e-9);
  const glm::dvec2 middle = tangent_per_m_s_ * speed_m_s_ * towards_;
  const glm::dvec2 across = across_share * left_of(towards_);
  const glm::dvec2 reach =
      tangent_per_m_s_ * amplitude_m_s * glm::sqrt(towards_ * towards_ + across * across);
  return {middle - reach, middle + reach};
}

}  // namespace groundray
