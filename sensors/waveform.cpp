#include "sensors/waveform.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace groundray {
namespace {

// Pulses begin at whole vectors of floats and are shifted within the first, so that each vector of
// a sum is stored and loaded at the same place: a processor waits where these straddle.
constexpr std::int64_t vector_bins = 8;

std::int64_t vectors_down(std::int64_t bin) { return bin & -vector_bins; }
std::int64_t vectors_up(std::int64_t bin) { return vectors_down(bin + vector_bins - 1); }

// Puts each of at most `most` where as many are nearer, without a branch to mispredict; false if
// two are equally far.
template <std::size_t most>
bool sort_by_counting(std::span<const Arrival> arrivals, std::span<Arrival> sorted) {
  std::array<double, most> range_m{};
  for (std::size_t i = 0; i < arrivals.size(); ++i) range_m[i] = arrivals[i].range_m;
  std::array<std::int64_t, most> nearer{};
  for (const Arrival& arrival : arrivals) {
#pragma omp simd
    for (std::size_t i = 0; i < most; ++i) nearer[i] += arrival.range_m < range_m[i] ? 1 : 0;
  }
  std::uint64_t taken = 0;
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    sorted[static_cast<std::size_t>(nearer[i])] = arrivals[i];
    taken |= std::uint64_t{1} << nearer[i];
  }
  return taken == (std::uint64_t{1} << arrivals.size()) - 1;
}

// By range, then energy, so that a sum does not depend on how its parts were listed.
void sort_arrivals(std::span<const Arrival> arrivals, std::vector<Arrival>& sorted) {
  sorted.resize(arrivals.size());
  if (arrivals.size() <= 16 && sort_by_counting<16>(arrivals, sorted)) return;
  if (arrivals.size() <= 32 && sort_by_counting<32>(arrivals, sorted)) return;
  std::ranges::copy(arrivals, sorted.begin());
  std::ranges::sort(sorted, [](const Arrival& a, const Arrival& b) {
    return a.range_m != b.range_m ? a.range_m < b.range_m : a.energy_j < b.energy_j;
  });
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

// Cuts sorted bins into segments, and says where in the samples each pulse goes.
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
  sort_arrivals(arrivals, waveform.arrivals_);
  waveform.pulses_.resize(arrivals.size());
  auto pulse = waveform.pulses_.begin();
  const double bins_per_m = s_per_m / interval_s_;
  const std::int64_t row_width = vector_bins + width_;
  for (const Arrival& arrival : waveform.arrivals_) {
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
  for (const Waveform::Pulse& part : waveform.pulses_) {
    const float* here = part.row;
    const float* next = here + row_width;
    const float of_this = part.here_j, of_next = part.next_j;
    float* sum = waveform.samples_.data() + part.first_sample;
    const std::int64_t width = width_;
#pragma omp simd
    for (std::int64_t j = 0; j < width; ++j) sum[j] += of_this * here[j] + of_next * next[j];
  }
}

}  // namespace groundray
