#include "terrain/trail/bank_profile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "terrain/trail/line_noise.h"

namespace groundray {
namespace {

constexpr double long_wave_m = 6, short_wave_m = 1.5;  // distances of the setbacks' knots
constexpr std::uint32_t long_purpose = 1010, short_purpose = 1011;

}  // namespace

// Faces of both sides vary independently, and so do those above each other. Both sides meet beyond
// the line's ends, where their setbacks must therefore agree.
double BankProfile::setback_m(double face, const LinePlace& at, double to_end_m) const noexcept {
  if (benches_->roughness_m == 0) return 0;
  const auto noise = [&](std::uint32_t purpose, double wave_m) {
    const RandomKey key{.seed = variant_,
                        .sensor = purpose,
                        .sub_ray = 2 * static_cast<std::uint32_t>(face) + (at.across_m > 0 ? 1 : 0),
                        .stream = RandomStream::Relief};
    return line_noise(key, at.along_m / wave_m);
  };
  const double both =
      (2 * noise(long_purpose, long_wave_m) + noise(short_purpose, short_wave_m)) / 3;
  const double t = std::min(to_end_m / long_wave_m, 1.0), fade = t * t * (3 - 2 * t);
  return fade * benches_->roughness_m * (1 + both) / 2;
}

double BankProfile::rise_m(double beyond_m, const LinePlace& at, double to_end_m) const noexcept {
  if (!benches_) return beyond_m * slope_;
  const double step_m = benches_->height_m / slope_ + benches_->width_m;
  const double face = std::floor(beyond_m / step_m);
  const double on_it_m = (beyond_m - face * step_m - setback_m(face, at, to_end_m)) * slope_;
  return face * benches_->height_m + std::clamp(on_it_m, 0.0, benches_->height_m);
}

double BankProfile::run_m(double height_m) const noexcept {
  if (!benches_) return height_m / slope_;
  const double below = std::max(0.0, std::ceil(height_m / benches_->height_m) - 1);
  return height_m / slope_ + below * benches_->width_m + benches_->roughness_m;
}

}  // namespace groundray
