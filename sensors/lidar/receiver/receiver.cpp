#include "sensors/lidar/receiver/receiver.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/math.h"
#include "sensors/lidar/receiver/echo_trace.h"
#include "sensors/lidar/receiver/normal_spread.h"

namespace groundray {

// Instant in bins of a segment, and the standard deviation of its noise.
struct Receiver::Timed {
  double bin = 0, sigma_bins = 0;
};

namespace {

using Timing = ReceiverSpec::Timing;
using Returns = ReceiverSpec::Returns;

constexpr double planck_j_s = 6.62607015e-34;  // exact by the definition of the kilogram
constexpr double infinity = std::numeric_limits<double>::infinity();
// In sigmas of the system pulse:
constexpr double automatic_interval = 0.25, longest_interval = 0.5, least_interval = 1e-3;
constexpr double least_crossing = 0.1;  // of the threshold; stronger noise triggers by itself
constexpr double hopeless_sigmas = 6;  // below the threshold: only 1e-9 of such echoes are detected
constexpr std::uint32_t most_alarms = 1u << 20;  // per pulse; RandomKey::sub_ray has 20 bits
// Bound on the ratio of an interpolated peak to its highest sample. The parabola rises above the
// sample by at most exp(curvature / 8), 3 % for a Gaussian with bins of half a sigma; this bound is
// ample for pulses of any shape.
constexpr double highest_top = 3;

bool finite_from(double least, double value) { return value >= least && std::isfinite(value); }

// Returns the rate of upward crossings of level 0 by white noise after a Gaussian response.
double rice_rate_hz(double response_sigma_s) {
  return 1 / (2 * std::numbers::pi * std::numbers::sqrt2 * response_sigma_s);
}

// Returns the variance of the first moment of such noise over a window of width
// 2 x response_sigma_s, relative to that of white noise of the same density: the integral of
// u v exp(-(u - v)^2 / 4) over u and v in [-x, x], over that of 2 sqrt(pi) u^2.
double correlated_share(double x) {
  // For a narrow window the terms below nearly cancel; their series expansion does not.
  constexpr double narrow = 0.1;
  if (x < narrow) {
    const double square = x * x;
    return x * square * (1. / 6 - square / 20 + 3 * square * square / 280) *
           std::numbers::inv_sqrtpi;
  }
  const double tail = math::exp(-x * x);
  const double m0 = 0.5 * math::erf(x) / std::numbers::inv_sqrtpi;
  const double m1 = 0.5 * (1 - tail);
  const double m3 = 0.5 * (1 - (1 + x * x) * tail);
  return (2 * m0 - 6 * m1 / x + 4 * m3 / (x * x * x)) * std::numbers::inv_sqrtpi;
}

void check_noise(const ReceiverSpec& spec, Violations& broken) {
  const NoiseSpec& noise = *spec.noise;
  broken.unless(
      spec.response_fwhm_s > 0,
      "response_fwhm_s = {} must be positive with noise: it determines the noise bandwidth",
      spec.response_fwhm_s);
  broken.unless(noise.nep_w_per_sqrt_hz > 0 && std::isfinite(noise.nep_w_per_sqrt_hz),
                "noise.nep_w_per_sqrt_hz = {} must be positive and finite",
                noise.nep_w_per_sqrt_hz);
  broken.unless(noise.wavelength_m >= 1e-7 && noise.wavelength_m <= 1e-4,
                "noise.wavelength_m = {} must be in [1e-7, 1e-4]: is it in nanometres?",
                noise.wavelength_m);
  broken.unless(noise.quantum_efficiency > 0 && noise.quantum_efficiency <= 1,
                "noise.quantum_efficiency = {} must be in (0, 1]", noise.quantum_efficiency);
  broken.unless(finite_from(1, noise.excess_noise_factor),
                "noise.excess_noise_factor = {} must be finite and at least 1",
                noise.excess_noise_factor);
  const double rate_hz = noise.false_alarm_rate_hz;
  broken.unless((spec.threshold_w > 0) != (rate_hz > 0),
                "threshold_w = {} and noise.false_alarm_rate_hz = {}: give one of them, positive",
                spec.threshold_w, rate_hz);
  if (!(rate_hz > 0 && spec.response_fwhm_s > 0)) return;
  const double highest_hz = rice_rate_hz(spec.response_fwhm_s / fwhm_per_sigma);
  broken.unless(rate_hz < highest_hz,
                "noise.false_alarm_rate_hz = {} must be below {}, at which the noise crosses 0",
                rate_hz, highest_hz);
}

ReceiverSpec checked_receiver(const ReceiverSpec& spec) {
  Violations broken("receiver");
  broken.unless(finite_from(0, spec.response_fwhm_s),
                "response_fwhm_s = {} must be finite and not negative", spec.response_fwhm_s);
  broken.unless(finite_from(0, spec.sample_interval_s),
                "sample_interval_s = {} must be finite and not negative", spec.sample_interval_s);
  broken.unless(finite_from(0, spec.threshold_w),
                "threshold_w = {} must be finite and not negative", spec.threshold_w);
  broken.unless(spec.threshold_w > 0 || spec.noise || spec.timing != Timing::LeadingEdge,
                "threshold_w = 0: a leading edge needs a threshold");
  broken.unless(spec.fraction > 0 && spec.fraction < 1, "fraction = {} must be in (0, 1)",
                spec.fraction);
  broken.unless(spec.most_returns >= 1, "most_returns = {} must be at least 1", spec.most_returns);
  broken.unless(finite_from(0, spec.dead_time_s),
                "dead_time_s = {} must be finite and not negative", spec.dead_time_s);
  broken.unless(spec.saturation_w > spec.threshold_w,
                "saturation_w = {} must be above threshold_w = {}", spec.saturation_w,
                spec.threshold_w);
  broken.unless(finite_from(1, spec.group_index), "group_index = {} must be finite and at least 1",
                spec.group_index);
  broken.unless(finite_from(1, spec.calibrated_group_index),
                "calibrated_group_index = {} must be finite and at least 1",
                spec.calibrated_group_index);
  if (spec.noise) check_noise(spec, broken);
  broken.throw_if_any();
  return spec;
}

double interval_of(const ReceiverSpec& spec, const SystemPulse& pulse) {
  const double sigma_s = pulse.fwhm_s() / fwhm_per_sigma;
  Violations broken("receiver");
  broken.unless(spec.sample_interval_s <= longest_interval * sigma_s,
                "sample_interval_s = {} must be at most {}, half a sigma of the pulse as received: "
                "0 selects a quarter",
                spec.sample_interval_s, longest_interval * sigma_s);
  broken.unless(spec.sample_interval_s == 0 || spec.sample_interval_s >= least_interval * sigma_s,
                "sample_interval_s = {} must be at least {}, a thousandth of that sigma",
                spec.sample_interval_s, least_interval * sigma_s);
  broken.throw_if_any();
  return spec.sample_interval_s > 0 ? spec.sample_interval_s : automatic_interval * sigma_s;
}

double offset_of(const ReceiverSpec& spec, const SystemPulse& pulse) {
  switch (spec.timing) {
    case Timing::LeadingEdge:
      return pulse.rise_s(0.5);
    case Timing::ConstantFraction:
      return pulse.rise_s(spec.fraction);
    case Timing::Peak:
      return pulse.peak_s();
    case Timing::CentreOfGravity:
      return 0;
  }
  return 0;
}

// Returns the index of the strongest detection other than `except`, the nearer of equals, or
// found.size() if there is none.
std::size_t strongest(const Detections& found, std::size_t except) {
  std::size_t best = found.size();
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (i == except) continue;
    if (best == found.size() || found[i].power_w > found[best].power_w) best = i;
  }
  return best;
}

// Keeps two detections, in order; an index past the end represents none.
void keep(std::size_t i, std::size_t j, Detections& found) {
  const auto [near, far] = std::minmax(i, j);
  std::size_t kept = 0;
  for (const std::size_t k : {near, far}) {
    if (k < found.size()) found[kept++] = found[k];
  }
  found.resize(kept);
}

void choose(Returns returns, std::size_t most, Detections& found) {
  if (found.empty()) return;
  const std::size_t none = found.size(), last = none - 1;
  switch (returns) {
    case Returns::First:
      return found.resize(1);
    case Returns::Last:
      return keep(last, none, found);
    case Returns::Strongest:
      return keep(strongest(found, none), none, found);
    case Returns::Second:
      return keep(strongest(found, strongest(found, none)), none, found);
    case Returns::Dual: {
      const std::size_t first = strongest(found, none);
      return keep(first, first == last ? strongest(found, first) : last, found);
    }
    case Returns::All:
      return found.resize(std::min(most, found.size()));
  }
}

// Returns the shift in bins that noise causes in the crossing of a level; 0 if there is no
// crossing.
double moved(double noise_w, double slope_w) { return slope_w > 0 ? noise_w / slope_w : 0; }

// Removes detections within the dead time of an earlier one.
void blank(double dead_m, Detections& found) {
  double ready_m = -infinity;
  std::erase_if(found, [&](const Detection& echo) {
    if (echo.range_m < ready_m) return true;
    ready_m = echo.range_m + dead_m;
    return false;
  });
}

}  // namespace

Receiver::Receiver(const PulseSpec& pulse, const ReceiverSpec& spec)
    : spec_(checked_receiver(spec)),
      response_sigma_s_(spec.response_fwhm_s / fwhm_per_sigma),
      pulse_(pulse, response_sigma_s_),
      sampler_(pulse_, interval_of(spec, pulse_)),
      s_per_m_(2 * spec.group_index / speed_of_light_m_per_s),
      m_per_s_(0.5 * speed_of_light_m_per_s / spec.calibrated_group_index),
      offset_s_(offset_of(spec, pulse_)) {
  spec_.saturation_w = static_cast<float>(spec.saturation_w);  // comparable with samples
  if (!spec.noise) return;
  const NoiseSpec& noise = *spec.noise;
  const double bandwidth_hz = 0.25 * std::numbers::inv_sqrtpi / response_sigma_s_;
  const double photon_j = planck_j_s * speed_of_light_m_per_s / noise.wavelength_m;
  dark_w2_ = noise.nep_w_per_sqrt_hz * noise.nep_w_per_sqrt_hz * bandwidth_hz;
  shot_w_ = 2 * photon_j * noise.excess_noise_factor * bandwidth_hz / noise.quantum_efficiency;
  crossings_hz_ = rice_rate_hz(response_sigma_s_);
  if (noise.false_alarm_rate_hz > 0) {
    threshold_sigmas_ = std::sqrt(2 * math::log(crossings_hz_ / noise.false_alarm_rate_hz));
  }
}

double Receiver::noise_w(double power_w, double background_w) const noexcept {
  return std::sqrt(dark_w2_ + shot_w_ * (power_w + background_w));
}

double Receiver::threshold_w(double background_w) const noexcept {
  return spec_.threshold_w > 0 ? spec_.threshold_w : threshold_sigmas_ * noise_w(0, background_w);
}

// Returns the bin at which a leading edge triggers. `normal` is the noise there over its standard
// deviation.
double Receiver::edge_bin(const EchoTrace& trace, double threshold_w, double background_w,
                          double normal) const noexcept {
  const double level_w = threshold_w - noise_w(threshold_w, background_w) * normal;
  return trace.first_rise(std::max(level_w, least_crossing * threshold_w)).bin;
}

// Returns the timed instant. A leading edge already includes its noise; for other methods only its
// standard deviation is returned.
Receiver::Timed Receiver::timed(const EchoTrace& trace, double threshold_w, double background_w,
                                double normal) const noexcept {
  const auto noise_at = [&](double power_w) { return noise_w(power_w, background_w); };
  const double peak_w = trace.peak_w();
  const double response_bins = response_sigma_s_ / interval_s();
  switch (spec_.timing) {
    case Timing::LeadingEdge:
      return {edge_bin(trace, threshold_w, background_w, normal)};
    case Timing::ConstantFraction: {
      const double level_w = spec_.fraction * peak_w;
      const auto edge = trace.last_rise(level_w);
      if (!spec_.noise) return {edge.bin};
      const double at_edge_w = noise_at(level_w), at_peak_w = spec_.fraction * noise_at(peak_w);
      const double apart = (trace.peak_bin() - edge.bin) / response_bins;
      const double together = math::exp(-0.25 * apart * apart);
      const double variance_w2 =
          at_edge_w * at_edge_w + at_peak_w * at_peak_w - 2 * together * at_edge_w * at_peak_w;
      const double slope_w =
          edge.slope_w > 0 ? edge.slope_w : trace.rise_before_peak(level_w).slope_w;
      return {edge.bin, moved(std::sqrt(variance_w2), slope_w)};
    }
    case Timing::Peak:
      if (!spec_.noise) return {trace.peak_bin()};
      if (trace.clipped()) {
        const double left_w = trace.first_rise(peak_w).slope_w,
                     right_w = trace.fall(peak_w).slope_w;
        const double noise_w = noise_at(peak_w);
        return {trace.peak_bin(),
                0.5 * math::hypot(moved(noise_w, left_w), moved(noise_w, right_w))};
      }
      return {trace.peak_bin(),
              moved(noise_at(peak_w), std::numbers::sqrt2 * response_bins * trace.curvature_w())};
    case Timing::CentreOfGravity:
      return centroid(trace, threshold_w, background_w);
  }
  return {};
}

Receiver::Timed Receiver::centroid(const EchoTrace& trace, double threshold_w,
                                   double background_w) const noexcept {
  const double mean_bin = trace.mean_bin();
  if (!spec_.noise) return {mean_bin};
  const EchoTrace::Extent window = trace.above(std::min(threshold_w, 0.5 * trace.peak_w()));
  const double begin = window.begin_bin - mean_bin, end = window.end_bin - mean_bin;
  const double variance_w2 = trace.mean(window, mean_bin, [&](double power_w) {
    return dark_w2_ + shot_w_ * (power_w + background_w);
  });
  const double spread = (end * end * end - begin * begin * begin) / 3;
  const double response_bins = response_sigma_s_ / interval_s();
  const double coherence = 2 * response_bins / std::numbers::inv_sqrtpi *
                           correlated_share(0.5 * (end - begin) / response_bins);
  return {mean_bin, std::sqrt(coherence * variance_w2 * spread) / trace.sum_w()};
}

// Returns the timed instant with its noise. The standard deviation refers to all pulses in which
// the echo is detected.
Receiver::Timed Receiver::reported(const EchoTrace& trace, double threshold_w, double background_w,
                                   const glm::dvec2& normal) const noexcept {
  const Timed at = timed(trace, threshold_w, background_w, normal.x);
  if (!spec_.noise) return at;
  if (spec_.timing == Timing::LeadingEdge) {
    const double peak_w = trace.peak_w();
    return {at.bin, deviation_above((threshold_w - peak_w) / noise_w(peak_w, background_w),
                                    [&](double other) {
                                      return edge_bin(trace, threshold_w, background_w, other);
                                    })};
  }
  if (!(at.sigma_bins > 0)) return {at.bin};  // also if it is NaN
  const auto begin = static_cast<double>(trace.lobe().begin);
  const auto end = static_cast<double>(trace.lobe().end);
  return {std::clamp(at.bin + at.sigma_bins * normal.y, begin, end),
          clamped_normal_deviation(at.sigma_bins, begin - at.bin, end - at.bin)};
}

void Receiver::detect(const Waveform& waveform, const RangeGate& gate, const PulseNoise& noise,
                      Detections& found) const {
  found.clear();
  find_echoes(waveform, noise, found);
  if (spec_.noise) add_false_alarms(gate, noise, found);
  std::erase_if(found, [&](const Detection& echo) {
    return !(gate.near_m <= echo.range_m && echo.range_m <= gate.far_m);
  });
  std::ranges::sort(found, {}, &Detection::range_m);
  blank(spec_.dead_time_s * m_per_s_, found);
  choose(spec_.returns, static_cast<std::size_t>(spec_.most_returns), found);
}

void Receiver::find_echoes(const Waveform& waveform, const PulseNoise& noise,
                           Detections& found) const {
  const double background = noise.background_w;
  const double threshold = threshold_w(background);
  const double floor_w =
      std::max(0.0, threshold - hopeless_sigmas * noise_w(threshold, background));
  const double joining_w = spec_.timing == Timing::LeadingEdge ? threshold : infinity;
  RandomKey key = noise.key;
  key.stream = RandomStream::EchoNoise;
  key.sub_ray = 0;
  for (const Waveform::Segment& segment : waveform.segments()) {
    const auto power_w = waveform.power_w(segment);
    for_each_lobe(power_w, spec_.saturation_w, joining_w, [&](const EchoTrace::Lobe& lobe) {
      if (highest_top * power_w[lobe.peak] <= floor_w) return;
      const EchoTrace trace(power_w, spec_.saturation_w, lobe);
      if (trace.peak_w() <= floor_w) return;
      const glm::dvec2 normal = spec_.noise ? random_normal(key) : glm::dvec2(0);
      ++key.sub_ray;
      const double sigma_w = noise_w(trace.peak_w(), background);
      const double noisy_w = trace.peak_w() + sigma_w * normal.x;
      if (!(noisy_w > threshold)) return;
      const double reported_w = std::min(noisy_w, spec_.saturation_w);
      const Timed at = reported(trace, threshold, background, normal);
      const auto begin = static_cast<double>(lobe.begin), end = static_cast<double>(lobe.end);
      const auto first = static_cast<double>(segment.bins.begin);
      found.push_back({.range_m = m_per_s_ * ((first + at.bin) * interval_s() - offset_s_),
                       .range_sd_m = m_per_s_ * at.sigma_bins * interval_s(),
                       .power_w = reported_w,
                       .width_s = trace.width_bins() * interval_s(),
                       .energy_j = trace.sum_w() * interval_s() * reported_w / trace.peak_w(),
                       .snr = sigma_w > 0 ? trace.peak_w() / sigma_w : infinity,
                       .begin_s = (first + begin) * interval_s(),
                       .end_s = (first + end) * interval_s()});
    });
  }
}

// Crossings of the threshold by noise alone are a Poisson process with exponential gaps. A high
// crossing has the shape of the noise's autocorrelation, and the square of its peak exceeds that of
// the threshold by an exponentially distributed amount. The sensor takes it for an echo, so its
// standard deviation is that of a peak of the same shape.
void Receiver::add_false_alarms(const RangeGate& gate, const PulseNoise& noise,
                                Detections& found) const {
  assert(std::isfinite(gate.far_m));
  const double sigma_w = noise_w(0, noise.background_w);
  const double threshold = threshold_w(noise.background_w);
  const double sigmas = threshold / sigma_w;
  const double rate_hz = threshold_sigmas_ > 0 ? spec_.noise->false_alarm_rate_hz
                                               : crossings_hz_ * math::exp(-0.5 * sigmas * sigmas);
  const double rate_per_m = rate_hz / m_per_s_;
  const double width_s = std::numbers::sqrt2 * spec_.response_fwhm_s;
  const std::size_t echoes = found.size();
  RandomKey key = noise.key;
  key.stream = RandomStream::FalseAlarm;
  double range_m = gate.near_m;
  for (key.sub_ray = 0; key.sub_ray < most_alarms; ++key.sub_ray) {
    const glm::dvec2 uniform = random_uniform(key);
    if (1 - uniform.x > rate_per_m * (gate.far_m - range_m)) return;  // -ln u > 1 - u: beyond
    range_m -= math::log(uniform.x) / rate_per_m;
    if (!(range_m < gate.far_m)) return;
    const auto hidden = [&](const Detection& echo) {
      return std::abs(range_m - echo.range_m) < m_per_s_ * echo.width_s;
    };
    if (std::any_of(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(echoes), hidden))
      continue;
    const double power_w =
        std::min(std::sqrt(threshold * threshold - 2 * sigma_w * sigma_w * math::log(uniform.y)),
                 spec_.saturation_w);
    const double time_s = range_m / m_per_s_ + offset_s_;
    const double sd_s = std::numbers::sqrt2 * response_sigma_s_ * sigma_w / power_w;
    found.push_back({range_m, m_per_s_ * sd_s, power_w, width_s,
                     power_w * 2 * response_sigma_s_ / std::numbers::inv_sqrtpi, power_w / sigma_w,
                     time_s, time_s, Detection::Kind::FalseAlarm});
  }
}

}  // namespace groundray
