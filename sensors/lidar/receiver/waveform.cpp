#include "sensors/lidar/receiver/waveform.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

const double cut_off_sigmas = std::sqrt(-2 * math::log(SystemPulse::cut_off));  // 5.678
constexpr int scan_steps = 4096;    // over a table's support, to find its peak and edges
constexpr int halvings = 64;        // bisections of a bracket: to the last bit
constexpr double sharp_sigmas = 9;  // beyond it a smooth ramp equals a sharp one: Phi(-9) = 1e-19

void check_pulse(const PulseSpec& spec) {
  Violations broken("pulse");
  if (spec.shape.empty()) {
    broken.unless(spec.fwhm_s > 0 && std::isfinite(spec.fwhm_s),
                  "fwhm_s = {} must be positive and finite without a shape", spec.fwhm_s);
  } else {
    broken.unless(spec.fwhm_s == 0, "fwhm_s = {} and a shape: give one of them", spec.fwhm_s);
    broken.unless(spec.shape_step_s > 0 && std::isfinite(spec.shape_step_s),
                  "shape_step_s = {} must be positive and finite", spec.shape_step_s);
    broken.unless(std::ranges::all_of(
                      spec.shape, [](double power) { return power >= 0 && std::isfinite(power); }),
                  "shape: every value must be finite and not negative");
    broken.unless(std::ranges::any_of(spec.shape, [](double power) { return power > 0; }),
                  "shape: at least one value must be positive");
  }
  broken.throw_if_any();
}

double normal_density(double x) {
  return math::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
}

// Returns max(x, 0) convolved with a Gaussian.
double smooth_ramp(double x, double sigma) {
  if (std::abs(x) >= sharp_sigmas * sigma) return std::max(x, 0.0);
  const double z = x / sigma;
  return x * 0.5 * math::erfc(-z / std::numbers::sqrt2) + sigma * normal_density(z);
}

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

SystemPulse::SystemPulse(const PulseSpec& spec, double response_sigma_s)
    : sigma_s_(response_sigma_s) {
  check_pulse(spec);
  if (spec.shape.empty()) {
    sigma_s_ = math::hypot(spec.fwhm_s / fwhm_per_sigma, response_sigma_s);
    end_s_ = cut_off_sigmas * sigma_s_;
    begin_s_ = -end_s_;
    peak_per_s_ = (*this)(0);
    fwhm_s_ = fwhm_per_sigma * sigma_s_;
  } else {
    sum_ramps(spec);
    measure();
  }
}

// Linear interpolation is a sum of hat functions, each of which is a sum of three ramps.
void SystemPulse::sum_ramps(const PulseSpec& spec) {
  double sum = 0, moment = 0;
  for (std::size_t i = 0; i < spec.shape.size(); ++i) {
    sum += spec.shape[i];
    moment += spec.shape[i] * static_cast<double>(i);
  }
  step_s_ = spec.shape_step_s;
  first_ramp_s_ = -(moment / sum + 1) * step_s_;
  ramps_.assign(spec.shape.size() + 2, 0);
  for (std::size_t i = 0; i < spec.shape.size(); ++i) {
    const double slope = spec.shape[i] / (sum * step_s_ * step_s_);
    ramps_[i] += slope;
    ramps_[i + 1] -= 2 * slope;
    ramps_[i + 2] += slope;
  }
}

double SystemPulse::operator()(double time_s) const {
  if (ramps_.empty()) return normal_density(time_s / sigma_s_) / sigma_s_;
  double sum = 0;
  for (std::size_t i = 0; i < ramps_.size(); ++i) {
    const double since_s = time_s - (first_ramp_s_ + static_cast<double>(i) * step_s_);
    if (since_s <= -sharp_sigmas * sigma_s_) break;
    sum += ramps_[i] * smooth_ramp(since_s, sigma_s_);
  }
  return std::max(sum, 0.0);  // far behind the table the ramps cancel except for rounding
}

// Finds the begin, peak, end and width of a table's pulse by a scan with refinement.
void SystemPulse::measure() {
  const double margin_s = cut_off_sigmas * sigma_s_;
  const double first_s = first_ramp_s_ - margin_s;
  const double last_s = first_ramp_s_ + static_cast<double>(ramps_.size() - 1) * step_s_ + margin_s;
  const double step_s = (last_s - first_s) / scan_steps;
  std::vector<double> values(scan_steps + 1);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = (*this)(first_s + static_cast<double>(i) * step_s);
  }
  const auto top = std::ranges::max_element(values);
  const auto at = [&](auto i) {
    return first_s + static_cast<double>(i - values.begin()) * step_s;
  };
  double low_s = at(top) - step_s, high_s = at(top) + step_s;
  for (int k = 0; k < 2 * halvings; ++k) {
    const double third_s = (high_s - low_s) / 3;
    if ((*this)(low_s + third_s) < (*this)(high_s - third_s)) {
      low_s += third_s;
    } else {
      high_s -= third_s;
    }
  }
  peak_s_ = 0.5 * (low_s + high_s);
  peak_per_s_ = (*this)(peak_s_);
  const auto holds = [&](double value) { return value >= cut_off * peak_per_s_; };
  begin_s_ = at(std::ranges::find_if(values, holds)) - step_s;
  end_s_ = at(std::find_if(values.rbegin(), values.rend(), holds).base());
  const double half_per_s = 0.5 * peak_per_s_;
  auto last_half = values.end() - 1;
  while (*last_half < half_per_s) --last_half;
  fwhm_s_ = crossing_s(at(last_half) + step_s, at(last_half), half_per_s) - rise_s(0.5);
}

double SystemPulse::rise_s(double fraction) const {
  if (ramps_.empty()) return -sigma_s_ * std::sqrt(-2 * math::log(fraction));
  const double level_per_s = fraction * peak_per_s_;
  const double step_s = (peak_s_ - begin_s_) / scan_steps;
  int k = 1;
  while (k < scan_steps && (*this)(begin_s_ + k * step_s) < level_per_s) ++k;
  return crossing_s(begin_s_ + (k - 1) * step_s, begin_s_ + k * step_s, level_per_s);
}

double SystemPulse::even_spacing_s(double least_s) const {
  constexpr int shifts = 16;
  constexpr double ripple = 1e-4;
  for (double spacing_s = fwhm_s_ / fwhm_per_sigma; spacing_s > least_s; spacing_s /= 2) {
    double low_per_s = std::numeric_limits<double>::infinity(), high_per_s = 0;
    for (int i = 0; i < shifts; ++i) {
      double sum_per_s = 0;
      for (double time_s = begin_s_ + i * spacing_s / shifts; time_s < end_s_; time_s += spacing_s)
        sum_per_s += (*this)(time_s);
      low_per_s = std::min(low_per_s, sum_per_s);
      high_per_s = std::max(high_per_s, sum_per_s);
    }
    if (high_per_s - low_per_s <= ripple * high_per_s) return spacing_s;
  }
  return least_s;
}

// Bisects between a time at which s is below the level and one at which it is not.
double SystemPulse::crossing_s(double low_s, double high_s, double level_per_s) const {
  for (int k = 0; k < halvings; ++k) {
    const double middle_s = 0.5 * (low_s + high_s);
    ((*this)(middle_s) < level_per_s ? low_s : high_s) = middle_s;
  }
  return high_s;
}

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
                          Waveform& waveform) const {
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
