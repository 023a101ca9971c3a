#include "sensors/lidar/receiver/waveform.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace groundray {
namespace {

// Pulses begin at multiples of a vector of floats and are shifted within the first vector. Each
// vector of a sum is then stored and loaded at the same position; a processor stalls if they
// straddle.
constexpr std::int64_t vector_bins = 8;

std::int64_t vectors_down(std::int64_t bin) { return bin & -vector_bins; }
std::int64_t vectors_up(std::int64_t bin) { return vectors_down(bin + vector_bins - 1); }

// Orders by range, then energy, so that a sum does not depend on the order of its input.
bool arrival_precedes(const Arrival& a, const Arrival& b) {
  return a.range_m != b.range_m ? a.range_m < b.range_m : a.energy_j < b.energy_j;
}

}  // namespace

void Waveform::add(std::int64_t first, std::span<const float> power_w) noexcept {
  const std::int64_t end = first + static_cast<std::int64_t>(power_w.size());
  for (const Segment& segment : segments_) {
    const Bins common{std::max(first, segment.bins.begin), std::min(end, segment.bins.end)};
    if (common.begin >= common.end) continue;
    float* sum = samples_.data() + segment.first_sample + (common.begin - segment.bins.begin);
    const float* part = power_w.data() + (common.begin - first);
    const std::size_t bins = count(common);
#pragma omp simd
    for (std::size_t j = 0; j < bins; ++j) sum[j] += part[j];
  }
}

PulseSampler::PulseSampler(const SystemPulse& pulse, double interval_s)
    : interval_s_(interval_s),
      first_bin_(static_cast<std::int64_t>(std::floor(pulse.begin_s() / interval_s))) {
  const auto past = static_cast<std::int64_t>(std::ceil(pulse.end_s() / interval_s)) + 2;
  width_ = vectors_up(past - first_bin_ + vector_bins - 1);
  rows_.assign(static_cast<std::size_t>((phases + 1) * (vector_bins + width_)), 0);
  auto row = rows_.begin() + vector_bins;
  for (int phase = 0; phase <= phases; ++phase) {
    for (std::int64_t j = 0; first_bin_ + j < past; ++j) {
      const double bin = static_cast<double>(first_bin_ + j) - static_cast<double>(phase) / phases;
      row[j] = static_cast<float>(pulse(bin * interval_s));
    }
    row += vector_bins + width_;
  }
}

// Divides the sorted pulses into segments, and assigns each pulse its position in the samples.
void Waveform::lay_out(Bins kept, std::int64_t width) {
  constexpr std::int64_t never = std::numeric_limits<std::int64_t>::max();
  segments_.clear();
  Segment open;
  const auto extend = [&](Bins bins) {
    if (bins.begin > open.bins.end || open.bins.begin == open.bins.end) {
      if (open.bins.begin < open.bins.end) segments_.push_back(open);
      open = {bins, open.first_sample + count(open.bins)};
    } else {
      open.bins.end = std::max(open.bins.end, bins.end);
    }
  };
  const Bins whole{vectors_down(kept.begin), vectors_up(kept.end)};
  std::int64_t next_kept = kept.begin < kept.end ? whole.begin : never;
  for (Pulse& pulse : pulses_) {
    const Bins bins{pulse.begin, pulse.begin + width};
    if (next_kept <= bins.begin) {
      extend(whole);
      next_kept = never;
    }
    extend(bins);
    pulse.first_sample =
        open.first_sample + static_cast<std::size_t>(pulse.begin - open.bins.begin);
  }
  if (next_kept != never) extend(whole);
  if (open.bins.begin < open.bins.end) segments_.push_back(open);
  samples_.assign(open.first_sample + count(open.bins), 0);
}

void PulseSampler::sample(std::span<const Arrival> arrivals, double s_per_m, Bins kept,
                          Waveform& waveform) const noexcept {
  waveform.interval_s_ = interval_s_;
  if (!std::ranges::is_sorted(arrivals, arrival_precedes)) {
    waveform.arrivals_.assign(arrivals.begin(), arrivals.end());
    std::ranges::sort(waveform.arrivals_, arrival_precedes);
    arrivals = waveform.arrivals_;
  }
  waveform.pulses_.resize(arrivals.size());
  auto pulse = waveform.pulses_.begin();
  const double bins_per_m = s_per_m / interval_s_;
  const std::int64_t row_width = vector_bins + width_;
  for (const Arrival& arrival : arrivals) {
    if (!(arrival.energy_j > 0)) continue;
    const double position = arrival.range_m * bins_per_m;
    const auto bin = static_cast<std::int64_t>(position);
    const double phase = (position - static_cast<double>(bin)) * phases;
    const std::int64_t row = std::min(static_cast<std::int64_t>(phase), std::int64_t{phases - 1});
    const double of_next = arrival.energy_j * (phase - static_cast<double>(row));
    const std::int64_t begin = vectors_down(bin + first_bin_);
    const float* here = rows_.data() + row * row_width + vector_bins - (bin + first_bin_ - begin);
    *pulse++ = {begin, 0, here, static_cast<float>(arrival.energy_j - of_next),
                static_cast<float>(of_next)};
  }
  waveform.pulses_.erase(pulse, waveform.pulses_.end());
  waveform.lay_out(kept, width_);
  // Two pulses that begin at the same sample are added in one loop.
  const auto end = waveform.pulses_.end();
  for (auto part = waveform.pulses_.begin(); part != end;) {
    const Waveform::Pulse one = *part++;
    Waveform::Pulse two = one;
    two.here_j = two.next_j = 0;
    if (part != end && part->first_sample == one.first_sample) two = *part++;
    const float *a = one.row, *b = a + row_width, *c = two.row, *d = c + row_width;
    float* const sum = waveform.samples_.data() + one.first_sample;
    const std::int64_t width = width_ / vector_bins * vector_bins;
#pragma omp simd
    for (std::int64_t j = 0; j < width; ++j) {
      const float with_one = std::fma(one.next_j, b[j], std::fma(one.here_j, a[j], sum[j]));
      sum[j] = std::fma(two.next_j, d[j], std::fma(two.here_j, c[j], with_one));
    }
  }
}

}  // namespace groundray
