#include "terrain/trail/bank_profile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "terrain/trail/line_noise.h"

namespace groundray {
namespace {

constexpr double long_wave_m = 6, short_wave_m = 1.5;  // distances of the setbacks' knots
constexpr std::uint32_t long_purpose = 1010, short_purpose = 1011, block_purpose = 1012,
                        joint_purpose = 1013;

}  // namespace

int BankProfile::beds_of(const std::optional<Benches>& benches) noexcept {
  if (!benches || !benches->blocks) return 1;
  return std::max(1, static_cast<int>(std::lround(benches->height_m / benches->blocks->height_m)));
}

// The joints of each bed are shifted at random, so that they do not line up.
double BankProfile::block_noise(RandomKey key, double along_m) const noexcept {
  key.sensor = joint_purpose;
  const double block = std::floor(along_m / benches_->blocks->length_m + random_uniform(key).x) + 1;
  key.sensor = block_purpose;
  key.pulse = static_cast<std::uint32_t>(block);
  return -1 + 2 * random_uniform(key).x;
}

// Faces of both sides vary independently, and so do those above each other. Both sides meet beyond
// the line's ends, where their setbacks must therefore agree.
double BankProfile::setback_m(double face, int bed, const LinePlace& at,
                              double to_end_m) const noexcept {
  if (benches_->roughness_m == 0) return 0;
  const std::uint32_t side = at.across_m > 0 ? 1 : 0;
  RandomKey key{.seed = variant_,
                .sensor = long_purpose,
                .sub_ray = 2 * static_cast<std::uint32_t>(face) + side,
                .stream = RandomStream::Relief};
  const double wide = line_noise(key, at.along_m / long_wave_m);
  key.sensor = short_purpose;
  double narrow;
  if (benches_->blocks) {
    key.sub_ray = 2 * static_cast<std::uint32_t>(face * beds_ + bed) + side;
    narrow = block_noise(key, at.along_m);
  } else {
    narrow = line_noise(key, at.along_m / short_wave_m);
  }
  const double both = (2 * wide + narrow) / 3;
  const double t = std::min(to_end_m / long_wave_m, 1.0), fade = t * t * (3 - 2 * t);
  return fade * benches_->roughness_m * (1 + both) / 2;
}

double BankProfile::rise_m(double beyond_m, const LinePlace& at, double to_end_m) const noexcept {
  if (!benches_) return beyond_m * slope_;
  const double step_m = benches_->height_m / slope_ + benches_->width_m;
  const double face = std::floor(beyond_m / step_m);
  const double bed_m = benches_->height_m / beds_;
  double rise_m = face * benches_->height_m;
  for (int bed = 0; bed < beds_; ++bed) {
    const double most_m = (beyond_m - face * step_m) * slope_ - bed * bed_m;
    if (most_m <= 0) break;
    const bool is_below = most_m - benches_->roughness_m * slope_ >= bed_m;
    rise_m += is_below
                  ? bed_m
                  : std::clamp(most_m - setback_m(face, bed, at, to_end_m) * slope_, 0.0, bed_m);
  }
  return rise_m;
}

double BankProfile::run_m(double height_m) const noexcept {
  if (!benches_) return height_m / slope_;
  const double below = std::max(0.0, std::ceil(height_m / benches_->height_m) - 1);
  return height_m / slope_ + below * benches_->width_m + benches_->roughness_m;
}

}  // namespace groundray
