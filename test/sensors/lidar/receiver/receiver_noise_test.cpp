// Effects of noise on a receiver, compared with formulas and with simulated noise: white noise
// sampled step by step and filtered by the receiver's response.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "sensors/lidar/lidar.h"
#include "sensors/lidar/receiver/receiver.h"
#include "test/support/margin.h"

namespace groundray::receiver_noise_test {
namespace {

using Timing = ReceiverSpec::Timing;

constexpr double c_m_per_s = 299'792'458;
constexpr double background_w = 20e-9;
constexpr RangeGate gate{2, 152};  // 1 us and 0.7 ns

const PulseSpec laser{.fwhm_s = 4e-9};
const double sigma_s = 5e-9 / (2 * std::sqrt(2 * std::numbers::ln2));
const double response_s = 3e-9 / (2 * std::sqrt(2 * std::numbers::ln2));

// At powers of 1 to 100 nW, the noise of the detector, of the signal and of the background are
// similar here.
ReceiverSpec noisy(Timing timing, double threshold_w, double false_alarm_rate_hz = 0) {
  return {.response_fwhm_s = 3e-9,
          .timing = timing,
          .threshold_w = threshold_w,
          .returns = ReceiverSpec::Returns::All,
          .noise = NoiseSpec{.nep_w_per_sqrt_hz = 1e-13,
                             .wavelength_m = 905e-9,
                             .quantum_efficiency = 0.8,
                             .excess_noise_factor = 3,
                             .false_alarm_rate_hz = false_alarm_rate_hz}};
}

// Calls `act` with the detections of pulse after pulse with the same echo at 75 m, of the given
// peak; no echo for 0.
template <typename Act>
void for_each_pulse(const Receiver& receiver, double peak_w, std::uint32_t pulses, const Act& act) {
  Waveform waveform;
  Detections found;
  const Arrival arrival{75, peak_w / receiver.pulse().peak_per_s()};
  receiver.sample({&arrival, 1}, waveform);
  for (std::uint32_t pulse = 0; pulse < pulses; ++pulse) {
    receiver.detect(waveform, gate, {{.seed = Seed{3}, .pulse = pulse}, background_w}, found);
    act(found);
  }
}

struct Statistics {
  double count = 0, sum = 0, square = 0;
  void add(double x) { count += 1, sum += x, square += x * x; }
  double mean() const { return sum / count; }
  double deviation() const { return std::sqrt(square / count - mean() * mean()); }
};

// Samples of white noise of unit variance after a Gaussian response, scaled to variance 1.
std::vector<double> filtered_noise(std::size_t count, double sigma_steps, std::mt19937_64& random) {
  const auto reach = static_cast<std::size_t>(std::ceil(6 * sigma_steps));
  std::vector<double> taps;
  double square = 0;
  for (std::size_t i = 0; i <= 2 * reach; ++i) {
    const double z = (static_cast<double>(i) - static_cast<double>(reach)) / sigma_steps;
    taps.push_back(std::exp(-0.5 * z * z));
    square += taps.back() * taps.back();
  }
  for (double& tap : taps) tap /= std::sqrt(square);
  std::normal_distribution<double> normal;
  std::vector<double> white(count + 2 * reach), filtered(count, 0);
  for (double& value : white) value = normal(random);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < taps.size(); ++j) filtered[i] += taps[j] * white[i + j];
  }
  return filtered;
}

TEST(ReceiverNoise, MatchesNepAndPhotonNoiseThroughTheResponse) {
  const Receiver receiver(laser, noisy(Timing::Peak, 1e-8));
  // Integral of the squared response: 2 B. NEP^2 is noise per hertz over positive and negative
  // frequencies; each photoelectron is a response of h nu / eta, with F times the square.
  double square = 0;
  const double step_s = response_s / 1000;
  for (int i = -10'000; i <= 10'000; ++i) {
    const double z = i / 1000.0;
    const double h = std::exp(-0.5 * z * z) / (response_s * std::sqrt(2 * std::numbers::pi));
    square += h * h * step_s;
  }
  const double photon_j = 6.62607015e-34 * c_m_per_s / 905e-9;
  for (const double signal_w : {0.0, 1e-9, 1e-7}) {
    const double electrons_hz = 0.8 * (signal_w + background_w) / photon_j;
    const double shot_w2 = electrons_hz * std::pow(photon_j / 0.8, 2) * 3 * square;
    const double expected_w = std::sqrt(0.5 * 1e-26 * square + shot_w2);
    EXPECT_NEAR(receiver.noise_w(signal_w, background_w), expected_w, 1e-12 * expected_w);
  }
}

// 2e5 responses: 3,000 upward crossings of 2 sigma. At such a level crossings scatter less than
// independent events, so 5 sqrt(3,000) is more than 5 standard errors. Steps of a tenth of the
// response miss 2e-4 of them.
TEST(ReceiverNoise, ThresholdYieldsItsFalseAlarmRate) {
  constexpr double steps = 10;
  std::mt19937_64 random(17);
  double crossings = 0, time_s = 0;
  for (int part = 0; part < 40; ++part) {
    const std::vector<double> noise = filtered_noise(50'000, steps, random);
    for (std::size_t i = 1; i < noise.size(); ++i) crossings += noise[i - 1] < 2 && noise[i] >= 2;
    time_s += 50'000 * response_s / steps;
  }
  const double rate_hz = crossings / time_s;
  const Receiver receiver(laser, noisy(Timing::Peak, 0, rate_hz));
  for (const double light_w : {0.0, background_w, 100 * background_w}) {
    const double sigmas = receiver.threshold_w(light_w) / receiver.noise_w(0, light_w);
    // d ln rate / d T = -T / sigma^2
    EXPECT_NEAR(sigmas, 2, 0.5 * (5 / std::sqrt(crossings) + 1e-3));
  }
}

TEST(ReceiverNoise, DetectionProbabilityFollowsTheAmplitude) {
  constexpr std::uint32_t pulses = 20'000;
  for (const Timing timing : {Timing::LeadingEdge, Timing::Peak}) {
    for (const double above : {-2.0, -1.0, 0.0, 0.5, 2.0}) {
      const double peak_w = 30e-9;
      const double sigma_w = Receiver(laser, noisy(timing, 1e-8)).noise_w(peak_w, background_w);
      const Receiver receiver(laser, noisy(timing, peak_w - above * sigma_w));
      double detected = 0;
      for_each_pulse(receiver, peak_w, pulses, [&](const Detections& found) {
        detected += std::ranges::any_of(
            found, [](const Detection& echo) { return echo.kind == Detection::Kind::Echo; });
      });
      const double expected = 0.5 * std::erfc(-above / std::numbers::sqrt2);
      // 5 standard errors: p = 6e-7 each, 6e-6 for ten. Peaks are exact to 1e-6, which is
      // negligible.
      const double error = std::sqrt(expected * (1 - expected) / pulses);
      EXPECT_NEAR(detected / pulses, expected, 5 * error) << above;
    }
  }
}

TEST(ReceiverNoise, FalseAlarmsAreAPoissonProcessOverTheGate) {
  constexpr std::uint32_t pulses = 40'000;
  const double window_s = 2 * (gate.far_m - gate.near_m) / c_m_per_s;
  const double expected = 0.4;
  const Receiver receiver(laser, noisy(Timing::LeadingEdge, 0, expected / window_s));
  const double threshold_w = receiver.threshold_w(background_w);
  const double sigma_w = receiver.noise_w(0, background_w);
  Statistics counts, excess;
  std::vector<double> positions;
  for_each_pulse(receiver, 0, pulses, [&](const Detections& found) {
    counts.add(static_cast<double>(found.size()));
    ASSERT_TRUE(std::ranges::is_sorted(found, {}, &Detection::range_m));
    for (const Detection& alarm : found) {
      ASSERT_EQ(alarm.kind, Detection::Kind::FalseAlarm);
      positions.push_back((alarm.range_m - gate.near_m) / (gate.far_m - gate.near_m));
      excess.add((alarm.power_w * alarm.power_w - threshold_w * threshold_w) /
                 (2 * sigma_w * sigma_w));
    }
  });
  // A Poisson distribution has equal mean and variance; 5 standard errors each (p = 6e-7).
  const double variance = counts.deviation() * counts.deviation();
  EXPECT_NEAR(counts.mean(), expected, 5 * std::sqrt(expected / pulses));
  EXPECT_NEAR(variance, expected, 5 * std::sqrt((expected + 2 * expected * expected) / pulses));
  // Kolmogorov-Smirnov: 2 exp(-2 x^2) = 6e-7 at x = 2.74.
  std::ranges::sort(positions);
  const auto n = static_cast<double>(positions.size());
  double distance = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    distance = std::max(distance, std::abs(positions[i] - (static_cast<double>(i) + 0.5) / n));
  }
  EXPECT_LT(distance * std::sqrt(n), 2.74);
  EXPECT_NEAR(excess.mean(), 1,
              5 / std::sqrt(n));  // an exponential distribution's standard deviation is its mean
}

TEST(ReceiverNoise, FalseAlarmsOfAGivenThresholdFollowRicesRate) {
  constexpr std::uint32_t pulses = 40'000;
  const double window_s = 2 * (gate.far_m - gate.near_m) / c_m_per_s;
  const double sigma_w = Receiver(laser, noisy(Timing::Peak, 1e-8)).noise_w(0, background_w);
  const Receiver receiver(laser, noisy(Timing::Peak, 3 * sigma_w));
  double alarms = 0;
  for_each_pulse(receiver, 0, pulses,
                 [&](const Detections& found) { alarms += static_cast<double>(found.size()); });
  // Rice: sqrt(-r'') / (2 pi) exp(-T^2 / 2), where the autocorrelation r of noise with a Gaussian
  // response is a Gaussian of twice the variance.
  const double expected = pulses * window_s * std::exp(-4.5) /
                          (2 * std::numbers::pi * std::numbers::sqrt2 * response_s);
  EXPECT_NEAR(alarms, expected, 5 * std::sqrt(expected));
}

// Estimate of time from a pulse and noise at steps of `step_s`, with the peak at index `peak`.
using Estimate = std::function<double(const std::vector<double>& power, std::size_t peak)>;

double rise(const std::vector<double>& power, std::size_t peak, double level) {
  std::size_t i = peak;
  while (power[i] >= level) --i;
  return static_cast<double>(i) + (level - power[i]) / (power[i + 1] - power[i]);
}

std::size_t top(const std::vector<double>& power, std::size_t peak) {
  const auto around = power.begin() + static_cast<std::ptrdiff_t>(peak);
  return static_cast<std::size_t>(std::max_element(around - 15, around + 15) - power.begin());
}

// The receiver computes its jitter by formulas; here noise is added to the pulse, which is then
// timed. 6,000 trials of each: the standard deviations differ by 5 sqrt(2 / (2 * 6,000)) = 6.5 %
// with p = 6e-7, and second-order terms at a signal of 40 sigmas change them by some percent of a
// percent. The detector's noise dominates, so the noise is stationary, as in the simulation.
TEST(ReceiverNoise, JitterMatchesThatOfAPulseInNoise) {
  constexpr double steps = 10;  // per sigma of the response
  constexpr int trials = 6000;
  constexpr double snr = 40;
  const double scale = steps * sigma_s / response_s;  // sigma of the pulse in steps
  const std::size_t count = 300, peak = 150;
  std::vector<double> clean;
  for (std::size_t i = 0; i < count; ++i) {
    clean.push_back(snr * std::exp(-0.5 * std::pow((static_cast<double>(i) - peak) / scale, 2)));
  }
  const double threshold = 0.4 * snr;
  const auto parabola = [](const std::vector<double>& p, std::size_t near) {
    const std::size_t i = top(p, near);
    return static_cast<double>(i) + 0.5 * (p[i - 1] - p[i + 1]) / (p[i - 1] - 2 * p[i] + p[i + 1]);
  };
  const auto centroid = [&](const std::vector<double>& p, std::size_t) {
    double moment = 0;  // of the samples whose signal is above the threshold; energy of all
    double energy = 0;
    for (std::size_t i = 0; i < count; ++i) {
      energy += clean[i];
      const double x = static_cast<double>(i) - peak;
      if (clean[i] >= threshold) moment += x * (p[i] - clean[i]);
    }
    return moment / energy;
  };
  const std::pair<Timing, Estimate> methods[] = {
      {Timing::LeadingEdge,
       [&](const auto& p, std::size_t near) { return rise(p, near, threshold); }},
      {Timing::ConstantFraction,
       [&](const auto& p, std::size_t near) { return rise(p, near, 0.5 * p[top(p, near)]); }},
      {Timing::Peak, parabola},
      {Timing::CentreOfGravity, centroid}};
  std::mt19937_64 random(23);
  std::vector<Statistics> simulated(4);
  for (int trial = 0; trial < trials; ++trial) {
    std::vector<double> power = filtered_noise(count, steps, random);
    for (std::size_t i = 0; i < count; ++i) power[i] += clean[i];
    for (std::size_t m = 0; m < 4; ++m) simulated[m].add(methods[m].second(power, peak));
  }
  for (std::size_t m = 0; m < 4; ++m) {
    ReceiverSpec spec = noisy(methods[m].first, 0.4e-3);
    spec.noise->nep_w_per_sqrt_hz =
        1e-3 / snr / std::sqrt(1 / (4 * std::sqrt(std::numbers::pi) * response_s));
    const Receiver receiver(laser, spec);
    Statistics ranges, deviations;
    for_each_pulse(receiver, 1e-3, trials, [&](const Detections& found) {
      ASSERT_EQ(found.size(), 1u);
      ranges.add(found[0].range_m);
      deviations.add(found[0].range_sd_m);
    });
    const double step_m = response_s / steps * c_m_per_s / 2;
    EXPECT_NEAR(ranges.deviation() / (simulated[m].deviation() * step_m), 1, 0.07) << m;
    // Only the simulated noise is random: 5 / sqrt(2 * 6,000) = 4.6 %, and the same second-order
    // terms as above.
    EXPECT_NEAR(deviations.mean() / (simulated[m].deviation() * step_m), 1, 0.05) << m;
    testing::record_margin("sd of a pulse in noise",
                           deviations.mean() / (simulated[m].deviation() * step_m) - 1, 0.05);
    // The leading edge is not at half of the peak, so it has range walk.
    if (m > 0) {
      EXPECT_NEAR(ranges.mean(), 75, 5 * ranges.deviation() / std::sqrt(trials)) << m;
    }
  }
}

// Two echoes 0.9 m apart: the valley between them is above half of the second's peak, so no rising
// edge crosses the level there. With a signal-to-noise ratio of 500 or more an edge of 5 ns shifts
// by millimetres.
TEST(ReceiverNoise, DoesNotMoveStrongOverlappingEchoes) {
  for (const Timing timing :
       {Timing::LeadingEdge, Timing::ConstantFraction, Timing::Peak, Timing::CentreOfGravity}) {
    ReceiverSpec spec = noisy(timing, 1e-6);
    const Receiver receiver(laser, spec);
    spec.noise.reset();
    const Receiver quiet(laser, spec);
    const double joules_per_watt = 1 / receiver.pulse().peak_per_s();
    const Arrival arrivals[] = {{75, 1e-3 * joules_per_watt}, {75.9, 1.1e-3 * joules_per_watt}};
    Waveform waveform;
    receiver.sample(arrivals, waveform);
    Detections exact, found;
    quiet.detect(waveform, gate, {}, exact);
    ASSERT_EQ(exact.size(), timing == Timing::LeadingEdge ? 1u : 2u);
    for (std::uint32_t pulse = 0; pulse < 500; ++pulse) {
      receiver.detect(waveform, gate, {{.seed = Seed{3}, .pulse = pulse}, background_w}, found);
      ASSERT_EQ(found.size(), exact.size());
      for (std::size_t i = 0; i < found.size(); ++i)
        ASSERT_NEAR(found[i].range_m, exact[i].range_m, 0.02) << int(timing) << ' ' << i;
    }
  }
}

// Stated standard deviation of the first arrival's echo, and the spread of 20,000 such echoes.
struct Spread {
  double claimed_m = 0;
  double found_m = 0;
  double error = 0;  // relative standard error of found_m
};

Spread spread_of(const Receiver& receiver, std::span<const Arrival> arrivals) {
  constexpr std::uint32_t pulses = 20'000;
  Waveform waveform;
  receiver.sample(arrivals, waveform);
  Detections found;
  std::vector<double> ranges_m;
  Statistics ranges, fourth;
  std::set<double> claimed_m;
  for (std::uint32_t pulse = 0; pulse < pulses; ++pulse) {
    receiver.detect(waveform, gate, {{.seed = Seed{3}, .pulse = pulse}, background_w}, found);
    const double arrival_s = receiver.arrival_s(arrivals[0].range_m);
    const auto echo = std::ranges::find_if(found, [&](const Detection& one) {
      return one.begin_s <= arrival_s && arrival_s < one.end_s;
    });
    if (echo == found.end()) continue;
    ranges_m.push_back(echo->range_m - 75);
    ranges.add(ranges_m.back());
    claimed_m.insert(echo->range_sd_m);
  }
  EXPECT_GT(ranges.count, 100);
  EXPECT_EQ(claimed_m.size(), 1u);  // the value belongs to the echo, not to the noise
  const double variance = ranges.deviation() * ranges.deviation();
  for (const double range_m : ranges_m) fourth.add(std::pow(range_m - ranges.mean(), 4));
  return {*claimed_m.begin(), ranges.deviation(),
          0.5 * std::sqrt((fourth.mean() / (variance * variance) - 1) / ranges.count)};
}

// From echoes that barely pass the threshold of 20 nW, about 10 standard deviations of the noise,
// to strong ones. 5 standard errors: p = 6e-7 each, 3e-5 for all. The 16-node quadrature errs by 2
// % near the threshold, by 0.1 % elsewhere.
TEST(ReceiverNoise, EchoesReportTheStandardDeviationOfTheirRanges) {
  constexpr double threshold_w = 20e-9;
  for (const Timing timing :
       {Timing::LeadingEdge, Timing::ConstantFraction, Timing::Peak, Timing::CentreOfGravity}) {
    for (const double saturation_w : {std::numeric_limits<double>::infinity(), 60e-9}) {
      ReceiverSpec spec = noisy(timing, threshold_w);
      spec.saturation_w = saturation_w;
      const Receiver receiver(laser, spec);
      for (const double peak_w : {18e-9, 20e-9, 21e-9, 25e-9, 50e-9, 400e-9, 4e-6}) {
        const Arrival arrival{75, peak_w / receiver.pulse().peak_per_s()};
        const Spread spread = spread_of(receiver, {&arrival, 1});
        const double tolerance = 5 * spread.error + (peak_w < 24e-9 ? 0.02 : 1e-3);
        EXPECT_NEAR(spread.found_m / spread.claimed_m, 1, tolerance)
            << int(timing) << ' ' << peak_w;
        testing::record_margin("sd", (spread.found_m / spread.claimed_m - 1) / tolerance, 1);
      }
    }
  }
}

// Two echoes whose valley is above the threshold, and so many standard deviations of the noise high
// that they stay within it: jitter that a neighbour limits is smaller.
TEST(ReceiverNoise, OverlappingEchoesReportTheirReducedJitter) {
  for (const Timing timing : {Timing::ConstantFraction, Timing::Peak, Timing::CentreOfGravity}) {
    const Receiver receiver(laser, noisy(timing, 5e-9));
    const double joules_per_watt = 1 / receiver.pulse().peak_per_s();
    for (const double apart_m : {0.7, 0.8, 0.9}) {
      const Arrival arrivals[] = {{75, 12e-9 * joules_per_watt},
                                  {75 + apart_m, 13e-9 * joules_per_watt}};
      const Spread spread = spread_of(receiver, arrivals);
      EXPECT_NEAR(spread.found_m / spread.claimed_m, 1, 5 * spread.error + 1e-3)
          << int(timing) << ' ' << apart_m;
    }
  }
}

// Power from other sources may be arbitrarily irregular, up to the last bin that is kept: echoes
// without a width still have their range, and all their reported values are finite.
TEST(ReceiverNoise, EchoesOfOneBinHaveFiniteRangesAndDeviations) {
  const Receiver receiver(laser, noisy(Timing::CentreOfGravity, 20e-9));
  Waveform waveform;
  Detections found;
  const Arrival arrival{75, 1e-60};  // keeps bins, and adds nothing to them
  const auto detect = [&](const std::function<float(std::int64_t)>& power_w) {
    receiver.sample({&arrival, 1}, waveform);
    const Bins bins = waveform.segments()[0].bins;
    std::vector<float> more_w;
    for (std::int64_t i = bins.begin; i < bins.end; ++i)
      more_w.push_back(power_w(bins.end - 1 - i));
    waveform.add(bins.begin, more_w);
    receiver.detect(waveform, gate, {{.seed = Seed{3}}, 0}, found);
    for (const Detection& echo : found) {
      EXPECT_TRUE(gate.near_m <= echo.range_m && echo.range_m <= gate.far_m);
      EXPECT_TRUE(echo.range_sd_m >= 0 && std::isfinite(echo.range_sd_m)) << echo.range_sd_m;
    }
  };
  for (const std::int64_t place : {0, 1, 5}) {  // counted from the last bin
    detect([place](std::int64_t i) { return i == place ? 1e-6f : 0.f; });
    ASSERT_EQ(found.size(), 1u) << place;
  }
  for (const int period : {2, 3, 4}) {
    detect([period](std::int64_t i) { return i % period == 0 ? 1e-6f : 0.f; });
    EXPECT_FALSE(found.empty()) << period;
  }
}

// Noise after the response has the response's autocorrelation, sqrt(2) times as wide: the shape of
// the echo of a pulse as wide as the response. Noise that the signal itself adds to the echo is
// part of its snr.
TEST(ReceiverNoise, FalseAlarmsHaveTheRangeDeviationOfEchoesOfTheirShape) {
  const Receiver peak({.fwhm_s = 3e-9}, noisy(Timing::Peak, 20e-9));
  double echo_m = 0;
  for_each_pulse(peak, 100e-9, 1,
                 [&](const Detections& found) { echo_m = found[0].range_sd_m * found[0].snr; });
  for (const Timing timing : {Timing::LeadingEdge, Timing::Peak}) {
    std::size_t alarms = 0;
    for_each_pulse(Receiver(laser, noisy(timing, 0, 1e6)), 0, 100, [&](const Detections& found) {
      alarms += found.size();
      for (const Detection& alarm : found)
        ASSERT_NEAR(alarm.range_sd_m * alarm.snr, echo_m, 1e-3 * echo_m);
    });
    EXPECT_GT(alarms, 10u);
  }
}

TEST(ReceiverNoise, RangeDeviationIsZeroWithoutNoise) {
  for (const Timing timing :
       {Timing::LeadingEdge, Timing::ConstantFraction, Timing::Peak, Timing::CentreOfGravity}) {
    ReceiverSpec spec = noisy(timing, 20e-9);
    spec.noise.reset();
    for_each_pulse(Receiver(laser, spec), 100e-9, 1, [](const Detections& found) {
      ASSERT_EQ(found.size(), 1u);
      EXPECT_EQ(found[0].range_sd_m, 0);
    });
  }
}

TEST(ReceiverNoise, AmplitudeVariesByTheNoiseAtThePeak) {
  constexpr std::uint32_t pulses = 20'000;
  const Receiver receiver(laser, noisy(Timing::Peak, 20e-9));
  const double peak_w = 200e-9;
  const double sigma_w = receiver.noise_w(peak_w, background_w);
  Statistics powers;
  for_each_pulse(receiver, peak_w, pulses, [&](const Detections& found) {
    for (const Detection& echo : found) {
      if (echo.kind != Detection::Kind::Echo) continue;
      powers.add(echo.power_w);
      ASSERT_NEAR(echo.snr, peak_w / sigma_w, 1e-5 * echo.snr);
    }
  });
  EXPECT_NEAR(powers.mean(), peak_w, 5 * sigma_w / std::sqrt(pulses));
  EXPECT_NEAR(powers.deviation(), sigma_w, 5 * sigma_w / std::sqrt(2.0 * pulses));
}

TEST(ReceiverNoise, IsAPureFunctionOfItsKey) {
  const Receiver receiver(laser, noisy(Timing::ConstantFraction, 0, 1e6));
  const Arrival arrivals[] = {{20, 1e-15}, {40, 1e-15}};
  Waveform waveform;
  receiver.sample(arrivals, waveform);
  const auto first = [&](const RandomKey& key) {
    Detections found;
    receiver.detect(waveform, gate, {key}, found);
    std::vector<double> ranges;
    for (const Detection& echo : found) ranges.push_back(echo.range_m);
    return ranges;
  };
  std::set<std::vector<double>> seen;
  for (const RandomKey& key : {RandomKey{}, RandomKey{.seed = Seed{1}}, RandomKey{.sensor = 1},
                               RandomKey{.frame = 1}, RandomKey{.pulse = 1}}) {
    EXPECT_EQ(first(key), first(key));
    seen.insert(first(key));
  }
  EXPECT_EQ(seen.size(), 5u);
  const auto ranges = first({});
  ASSERT_GE(ranges.size(), 2u);
  EXPECT_NE(ranges[0] - 20, ranges[1] - 40);  // each echo has its own noise
}

}  // namespace
}  // namespace groundray::receiver_noise_test
