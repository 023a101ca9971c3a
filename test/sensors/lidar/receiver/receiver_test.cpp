#include "sensors/lidar/receiver/receiver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/error.h"
#include "sensors/lidar/lidar.h"
#include "test/support/margin.h"

namespace groundray::receiver_test {
namespace {

using Timing = ReceiverSpec::Timing;
using Returns = ReceiverSpec::Returns;
using ::testing::AllOf;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double c_m_per_s = 299'792'458;
constexpr Timing timings[] = {Timing::LeadingEdge, Timing::ConstantFraction, Timing::Peak,
                              Timing::CentreOfGravity};
constexpr RangeGate gate{0, 5000};

// 4 ns pulse, 3 ns response: 5 ns together.
const PulseSpec laser{.fwhm_s = 4e-9};
const double sigma_s = 5e-9 / (2 * std::sqrt(2 * std::numbers::ln2));
const double sigma_m = sigma_s * c_m_per_s / 2;
const double joules_per_watt = sigma_s * std::sqrt(2 * std::numbers::pi);  // per watt of peak power

ReceiverSpec spec_of(Timing timing, double threshold_w = 0.5e-6) {
  return {.response_fwhm_s = 3e-9,
          .timing = timing,
          .threshold_w = threshold_w,
          .returns = Returns::All};
}

// Electronic noise and the shot noise of signal and background are all of the same order here.
ReceiverSpec noisy(Timing timing, double threshold_w) {
  ReceiverSpec spec = spec_of(timing, threshold_w);
  spec.noise = NoiseSpec{.nep_w_per_sqrt_hz = 1e-12,
                         .wavelength_m = 905e-9,
                         .quantum_efficiency = 0.8,
                         .excess_noise_factor = 3};
  return spec;
}

Detections detect(const Receiver& receiver, std::span<const Arrival> arrivals,
                  const PulseNoise& noise = {}) {
  Waveform waveform;
  Detections found;
  receiver.sample(arrivals, waveform);
  receiver.detect(waveform, gate, noise, found);
  return found;
}

std::vector<double> ranges_m(const Detections& found) {
  std::vector<double> ranges;
  for (const Detection& echo : found) ranges.push_back(echo.range_m);
  return ranges;
}

PulseNoise pulse_number(std::uint32_t pulse, double background_w = 0) {
  return {.key = {.seed = Seed{11}, .pulse = pulse}, .background_w = background_w};
}

// A footprint on a plane: energies of a Gaussian with this standard deviation in range. Steps are a
// thirtieth of it, so that the sum is a Gaussian to rounding.
std::vector<Arrival> plane(double range_m, double spread_m, double energy_j) {
  std::vector<Arrival> arrivals;
  double sum = 0;
  for (int i = -200; i <= 200; ++i) {
    const double z = i / 30.0;
    arrivals.push_back({range_m + z * spread_m, std::exp(-0.5 * z * z)});
    sum += arrivals.back().energy_j;
  }
  for (Arrival& arrival : arrivals) arrival.energy_j *= energy_j / sum;
  return arrivals;
}

TEST(Waveform, IsTheSumOfItsPulses) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> range_m(0, 12), energy_j(0, 1e-15);
  std::vector<Arrival> arrivals;
  for (int i = 0; i < 40; ++i) arrivals.push_back({range_m(random), energy_j(random)});
  for (int i = 0; i < 5; ++i) arrivals.push_back({3000 + range_m(random), energy_j(random)});
  ReceiverSpec spec = spec_of(Timing::Peak);
  spec.group_index = 1.00027;
  const Receiver receiver(laser, spec);
  Waveform waveform;
  receiver.sample(arrivals, waveform);
  ASSERT_EQ(waveform.segments().size(), 2u);
  double highest_w = 0, worst_w = 0;
  for (const Waveform::Segment& segment : waveform.segments()) {
    const auto power_w = waveform.power_w(segment);
    for (std::size_t i = 0; i < power_w.size(); ++i) {
      const double t_s = static_cast<double>(segment.bins.begin + static_cast<std::int64_t>(i)) *
                         waveform.interval_s();
      double expected_w = 0;
      for (const Arrival& arrival : arrivals) {
        const double z = (t_s - 2 * 1.00027 * arrival.range_m / c_m_per_s) / sigma_s;
        expected_w += arrival.energy_j / joules_per_watt * std::exp(-0.5 * z * z);
      }
      highest_w = std::max(highest_w, expected_w);
      worst_w = std::max(worst_w, std::abs(power_w[i] - expected_w));
    }
  }
  // Phase interpolation: (1 / 1024)^2 / 2 of a pulse. Samples: 45 roundings to 2^-24, halved.
  // Cut-off: at most 45 times 1e-7, where the power is low.
  EXPECT_LT(worst_w, 3e-6 * highest_w);
}

TEST(Waveform, BinsDoNotGrowWithDistance) {
  const Receiver receiver(laser, spec_of(Timing::Peak));
  Waveform waveform;
  const auto bins = [&](std::vector<Arrival> arrivals) {
    receiver.sample(arrivals, waveform);
    std::size_t sum = 0;
    for (const auto& segment : waveform.segments()) sum += waveform.power_w(segment).size();
    return sum;
  };
  const std::size_t one = bins({{5, 1e-15}});
  EXPECT_LE(one, 64u);  // 2 * 5.68 sigmas of 4 bins are 46
  EXPECT_EQ(bins({{5, 1e-15}, {4.9e6, 1e-15}}), 2 * one);
  EXPECT_EQ(bins({{5, 0}}), 0u);
  EXPECT_EQ(bins({}), 0u);
}

TEST(Waveform, KeepsBinsForPowerThatIsAddedLater) {
  const Receiver receiver(laser, spec_of(Timing::Peak, 0));
  const double interval_s = receiver.interval_s();
  std::vector<float> fog_w;  // a slow bump around bin 300
  for (int k = 100; k < 500; ++k) {
    fog_w.push_back(static_cast<float>(1e-6 * std::exp(-0.5 * std::pow((k - 300) / 30.0, 2))));
  }
  const Bins kept{100, 500};
  for (const double range_m : {2., 30., 60.}) {  // before, inside and behind
    Waveform waveform;
    Detections found;
    const std::vector<Arrival> arrivals{{range_m, 1e-6 * joules_per_watt}};
    receiver.sample(arrivals, waveform, kept);
    waveform.add(kept.begin, fog_w);
    receiver.detect(waveform, gate, {}, found);
    const double fog_m = 300 * interval_s * c_m_per_s / 2;
    std::vector<double> expected{range_m, fog_m};
    std::ranges::sort(expected);
    ASSERT_EQ(found.size(), 2u) << range_m;
    // Each echo's tail is below 1e-3 of the other's peak.
    EXPECT_NEAR(found[0].range_m, expected[0], 0.01);
    EXPECT_NEAR(found[1].range_m, expected[1], 0.01);
  }
}

TEST(Receiver, RangesASingleArrivalExactly) {
  for (const Timing timing : timings) {
    for (const double interval_s : {0.0, 0.5 * sigma_s}) {
      ReceiverSpec spec = spec_of(timing);
      spec.sample_interval_s = interval_s;
      const Receiver receiver(laser, spec);
      double worst_m = 0, worst_w = 0, worst_s = 0, worst_j = 0;
      for (const double base_m : {5., 100., 3000.}) {
        for (int i = 0; i < 500; ++i) {
          const double range_m = base_m + i * 0.0123456;  // 5 or 10 bins per metre
          // A peak of twice the threshold, where a leading edge has no range walk.
          const Arrival arrival{range_m, 1e-6 * joules_per_watt};
          const Detections found = detect(receiver, {&arrival, 1});
          ASSERT_EQ(found.size(), 1u);
          worst_m = std::max(worst_m, std::abs(found[0].range_m - range_m));
          worst_w = std::max(worst_w, std::abs(found[0].power_w - 1e-6));
          worst_s = std::max(worst_s, std::abs(found[0].width_s - 5e-9));
          worst_j = std::max(worst_j, std::abs(found[0].energy_j - arrival.energy_j));
          const double time_s = receiver.arrival_s(range_m);
          ASSERT_TRUE(found[0].begin_s <= time_s && time_s < found[0].end_s);
        }
      }
      // Phase interpolation widens a Gaussian's variance by at most (interval / 256)^2: 1e-6 of it
      // at a quarter of a sigma, 4e-6 at a half; peak and width change by half of that. Samples are
      // rounded to 2^-24, which an edge or a centroid divides by a slope of about 1 / sigma, and a
      // parabola by its curvature over a bin, 1 / 8 or 1 / 2.
      const double widened = interval_s > 0 ? 3.9e-6 : 9.6e-7;
      EXPECT_LT(worst_m, 1e-6) << static_cast<int>(timing) << ' ' << interval_s;
      testing::record_margin("range", worst_m, 1e-6, "m");
      EXPECT_LT(worst_w, (0.5 * widened + 0x1p-22) * 1e-6);
      EXPECT_LT(worst_s, (0.5 * widened + 0x1p-21) * 5e-9);
      EXPECT_LT(worst_j, (0x1p-22 + 1.4e-8) * 1e-6 * joules_per_watt);
    }
  }
}

TEST(Receiver, RangeWalkOfTheLeadingEdgeIsThatOfAGaussian) {
  const Receiver receiver(laser, spec_of(Timing::LeadingEdge, 1e-6));
  for (const double ratio : {1.0001, 1.01, 1.2, 2.0, 10.0, 100.0, 1e4}) {
    for (int i = 0; i < 50; ++i) {
      const Arrival arrival{50 + i * 0.0123456, ratio * 1e-6 * joules_per_watt};
      const Detections found = detect(receiver, {&arrival, 1});
      ASSERT_EQ(found.size(), 1u);
      const double before_s = sigma_s * std::sqrt(2 * std::log(ratio));
      const double walk_m = c_m_per_s / 2 * (2.5e-9 - before_s);
      // A power error of 2e-6 (half from phase interpolation, half from rounding and the parabola)
      // shifts the crossing at a peak that is 1e-4 above the threshold by 1e-6 / 0.014 of a sigma;
      // in the tail, at z sigma, the widening counts z^2 - 1 times as much.
      EXPECT_NEAR(found[0].range_m - arrival.range_m, walk_m, ratio < 1.001 ? 3e-5 : 4e-6) << ratio;
    }
  }
}

TEST(Receiver, EqualArrivalsSeparateWhereTheSumOfGaussiansHasTwoMaxima) {
  const Receiver receiver(laser, spec_of(Timing::Peak));
  for (int i = 0; i < 40; ++i) {
    const double range_m = 70 + i * 0.0123456;
    const auto at = [&](double apart) {
      const Arrival arrivals[] = {{range_m - apart * sigma_m / 2, 1e-6 * joules_per_watt},
                                  {range_m + apart * sigma_m / 2, 1e-6 * joules_per_watt}};
      return detect(receiver, arrivals);
    };
    EXPECT_EQ(at(1.99).size(), 1u);  // two Gaussians separate at 2 sigma
    EXPECT_EQ(at(2.1).size(), 2u);   // dips of less than 1e-3 between them are ripple
    for (const double apart : {2.355, 3.0, 5.0}) {  // the first is c FWHM / 2
      const Detections found = at(apart);
      ASSERT_EQ(found.size(), 2u);
      double x = apart / 2;  // the maxima: x = d/2 tanh(x d/2), in sigmas
      for (int k = 0; k < 200; ++k) x = apart / 2 * std::tanh(x * apart / 2);
      // At steps h a parabola through L = ln P misses its maximum by h^2 / 6 times the ratio of the
      // third derivative to the second, and by half as much again for higher ones. The first
      // derivative is -x + d/2 tanh(x d/2).
      const double half = apart / 2, sech2 = 1 - std::pow(x / half, 2);
      const double missed = 2 * half * half * x * sech2 / (1 - half * half * sech2) / 96;
      const double tolerance_m = (1.5 * missed + 1e-5) * sigma_m;
      EXPECT_NEAR(found[0].range_m, range_m - x * sigma_m, tolerance_m);
      EXPECT_NEAR(found[1].range_m, range_m + x * sigma_m, tolerance_m);
      EXPECT_NEAR(found[0].end_s, receiver.arrival_s(range_m), 0.51 * receiver.interval_s());
      EXPECT_EQ(found[0].end_s, found[1].begin_s);
      EXPECT_NEAR(found[0].energy_j + found[1].energy_j, 2e-6 * joules_per_watt,
                  1e-6 * 2e-6 * joules_per_watt);
    }
  }
}

// The sum over a plane is a Gaussian of variance sigma^2 + (2 spread / c)^2.
TEST(Receiver, TiltedPlaneIsOneEchoOfClosedForm) {
  for (const double spread_m : {0.01, 0.3, 2.0}) {
    const double broad_s = std::hypot(sigma_s, 2 * spread_m / c_m_per_s);
    const double peak_w = 1e-6;
    const double energy_j = peak_w * broad_s * std::sqrt(2 * std::numbers::pi);
    for (int i = 0; i < 20; ++i) {
      const double range_m = 100 + i * 0.0123456;
      const std::vector<Arrival> arrivals = plane(range_m, spread_m, energy_j);
      const auto expect = [&](Timing timing, double offset_s) {
        const Detections found = detect(Receiver(laser, spec_of(timing, 0.2e-6)), arrivals);
        ASSERT_EQ(found.size(), 1u);
        // 2e-6 of the power, as for one arrival, at slopes of 1 / sigma or more.
        EXPECT_NEAR(found[0].range_m, range_m + c_m_per_s / 2 * offset_s,
                    1e-5 * c_m_per_s / 2 * broad_s);
        EXPECT_NEAR(found[0].power_w, peak_w, 2e-6 * peak_w);
        EXPECT_NEAR(found[0].width_s, broad_s / sigma_s * 5e-9, 1e-5 * broad_s);
        EXPECT_NEAR(found[0].energy_j, energy_j, 1e-6 * energy_j);
      };
      expect(Timing::LeadingEdge, 2.5e-9 - broad_s * std::sqrt(2 * std::log(5)));
      expect(Timing::ConstantFraction, 2.5e-9 - broad_s * std::sqrt(2 * std::numbers::ln2));
      expect(Timing::CentreOfGravity, 0);
    }
  }
}

TEST(Receiver, CentreOfGravityIsTheCentroidOfTheEnergy) {
  std::mt19937_64 random(5);
  const Receiver receiver(laser, spec_of(Timing::CentreOfGravity, 0));
  for (int i = 0; i < 200; ++i) {
    // Skewed, and closer than the distance at which two pulses have a dip between them.
    std::gamma_distribution<double> beyond_m(2.0, 0.15);
    std::uniform_real_distribution<double> energy_j(0, 1e-15);
    std::vector<Arrival> arrivals;
    double sum_j = 0, moment = 0;
    for (int k = 0; k < 64; ++k) {
      arrivals.push_back({40 + std::min(beyond_m(random), 0.9), energy_j(random)});
      sum_j += arrivals.back().energy_j;
      moment += arrivals.back().energy_j * arrivals.back().range_m;
    }
    const Detections found = detect(receiver, arrivals);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].range_m, moment / sum_j, 1e-6);
    EXPECT_NEAR(found[0].energy_j, sum_j, 1e-6 * sum_j);
  }
}

std::vector<Arrival> arrivals_of(const std::vector<std::pair<double, double>>& range_and_peak_w) {
  std::vector<Arrival> arrivals;
  for (const auto& [range_m, peak_w] : range_and_peak_w) {
    arrivals.push_back({range_m, peak_w * joules_per_watt});
  }
  return arrivals;
}

std::vector<double> returned(Returns returns, const std::vector<Arrival>& arrivals,
                             int most_returns = 255) {
  ReceiverSpec spec = spec_of(Timing::Peak, 0.1e-6);
  spec.returns = returns;
  spec.most_returns = most_returns;
  return ranges_m(detect(Receiver(laser, spec), arrivals));
}

// In another simulator the second return of these sub-rays repeats the first, the strongest is that
// of a single sub-ray, and the last may be a mean.
TEST(Receiver, SelectsReturnsAmongSurfacesNotSubRays) {
  const auto near = [](double range_m) { return DoubleNear(range_m, 1e-6); };
  const auto arrivals = arrivals_of({{5, 1.4e-6}, {10, 1e-6}, {10, 1e-6}, {20, 1.6e-6}});
  EXPECT_THAT(returned(Returns::All, arrivals), ElementsAre(near(5), near(10), near(20)));
  EXPECT_THAT(returned(Returns::First, arrivals), ElementsAre(near(5)));
  EXPECT_THAT(returned(Returns::Last, arrivals), ElementsAre(near(20)));
  EXPECT_THAT(returned(Returns::Strongest, arrivals), ElementsAre(near(10)));
  EXPECT_THAT(returned(Returns::Second, arrivals), ElementsAre(near(20)));
  EXPECT_THAT(returned(Returns::Dual, arrivals), ElementsAre(near(10), near(20)));
  EXPECT_THAT(returned(Returns::All, arrivals, 2), ElementsAre(near(5), near(10)));

  const auto far_strongest = arrivals_of({{5, 1e-6}, {10, 0.5e-6}, {20, 3e-6}});
  EXPECT_THAT(returned(Returns::Dual, far_strongest), ElementsAre(near(5), near(20)));
  EXPECT_THAT(returned(Returns::Second, far_strongest), ElementsAre(near(5)));
  const auto two = arrivals_of({{5, 1e-6}, {100, 0.5e-6}});
  EXPECT_THAT(returned(Returns::Last, two), ElementsAre(near(100)));
  const auto one = arrivals_of({{5, 1e-6}});
  EXPECT_THAT(returned(Returns::Dual, one), ElementsAre(near(5)));
  EXPECT_THAT(returned(Returns::Second, one), ElementsAre());
  for (const Returns returns : {Returns::First, Returns::Last, Returns::Strongest, Returns::Second,
                                Returns::Dual, Returns::All}) {
    EXPECT_THAT(returned(returns, {}), ElementsAre());
  }
}

TEST(Receiver, LeadingEdgeTriggersOnceUntilTheSignalFallsBelowTheThreshold) {
  const auto arrivals = arrivals_of({{10, 1e-6}, {10 + 3 * sigma_m, 2e-6}});
  // Between them the power is 0.82e-6 W, at 1.3 sigmas.
  EXPECT_EQ(detect(Receiver(laser, spec_of(Timing::Peak, 0.5e-6)), arrivals).size(), 2u);
  EXPECT_EQ(detect(Receiver(laser, spec_of(Timing::LeadingEdge, 0.9e-6)), arrivals).size(), 2u);
  const Detections joined = detect(Receiver(laser, spec_of(Timing::LeadingEdge, 0.5e-6)), arrivals);
  ASSERT_EQ(joined.size(), 1u);
  // Half of the first peak: the second's tail of 2e-6 exp(-(3 + 1.18)^2 / 2) W shifts it 5e-4
  // forward.
  EXPECT_NEAR(joined[0].range_m, 10, 1e-3 * sigma_m);
  EXPECT_NEAR(joined[0].power_w, 2e-6 * (1 + 0.5 * std::exp(-4.5)), 1e-9);
}

TEST(Receiver, DetectsNothingOutsideItsGateOrDuringItsDeadTime) {
  ReceiverSpec spec = spec_of(Timing::Peak);
  const auto arrivals = arrivals_of({{5, 1e-6}, {7, 3e-6}, {9, 1e-6}, {20, 1e-6}});
  const auto near = [](double range_m) { return DoubleNear(range_m, 1e-6); };
  spec.dead_time_s = 2 * 2.5 / c_m_per_s;
  EXPECT_THAT(ranges_m(detect(Receiver(laser, spec), arrivals)),
              ElementsAre(near(5), near(9), near(20)));
  Waveform waveform;
  Detections found;
  const Receiver receiver(laser, spec);
  receiver.sample(arrivals, waveform);
  receiver.detect(waveform, {6, 15}, {}, found);
  EXPECT_THAT(ranges_m(found), ElementsAre(near(7)));
}

TEST(Receiver, SaturationClipsTheWaveform) {
  const double saturation_w = 1e-6, peak_w = 20e-6;
  const auto arrivals = arrivals_of({{30, peak_w}});
  for (const Timing timing : timings) {
    ReceiverSpec spec = spec_of(timing);
    const double free_m = detect(Receiver(laser, spec), arrivals).at(0).range_m;
    spec.saturation_w = saturation_w;
    const Receiver receiver(laser, spec);
    const Detections found = detect(receiver, arrivals);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].power_w, saturation_w, 0x1p-24 * saturation_w);
    const double half_s = sigma_s * std::sqrt(2 * std::log(2 * peak_w / saturation_w));
    // Without a peak the flank's curvature is unknown: a chord of the logarithm errs by 1 / 8 of a
    // bin's square, 1 / 128, over a slope of 2.7: 0.3 % of a sigma on each side.
    EXPECT_NEAR(found[0].width_s, 2 * half_s, 0.006 * sigma_s);
    const double crossed_s = -sigma_s * std::sqrt(2 * std::log(peak_w / (0.5 * saturation_w)));
    const bool early = timing == Timing::ConstantFraction;  // half of the clipped peak
    // At each corner, 2.4 sigmas out, a sum over bins h differs from an integral by at most h^2 / 8
    // of the slope, 2.4 / sigma of the saturation: 0.3 % of the area, 5.6 sigmas, on either side.
    const double tolerance_m = timing == Timing::CentreOfGravity ? 0.017 * sigma_m : 5e-6;
    EXPECT_NEAR(found[0].range_m,
                timing == Timing::LeadingEdge
                    ? free_m
                    : 30 + (early ? c_m_per_s / 2 * (crossed_s + 2.5e-9) : 0),
                tolerance_m);
    // Power above saturation is one plateau, regardless of the pulses that it hides.
    const auto pair = arrivals_of({{30, peak_w}, {30 + 4 * sigma_m, peak_w}});
    const Detections hidden = detect(receiver, pair);
    ASSERT_EQ(hidden.size(), 1u);
    if (timing == Timing::Peak || timing == Timing::CentreOfGravity) {
      EXPECT_NEAR(hidden[0].range_m, 30 + 2 * sigma_m, tolerance_m);
    }
  }
}

TEST(Receiver, RangesScaleWithTheAirsGroupIndex) {
  ReceiverSpec spec = spec_of(Timing::Peak);
  spec.group_index = 1.00027;
  const auto arrivals = arrivals_of({{1000, 1e-6}});
  EXPECT_NEAR(detect(Receiver(laser, spec), arrivals).at(0).range_m, 1000.27, 1e-6);
  spec.calibrated_group_index = 1.00027;
  EXPECT_NEAR(detect(Receiver(laser, spec), arrivals).at(0).range_m, 1000, 1e-6);
}

TEST(Receiver, DoesNotDependOnTheOrderOfArrivals) {
  std::mt19937_64 random(9);
  for (const std::size_t count : {2u, 16u, 31u, 33u, 300u}) {
    std::uniform_real_distribution<double> range_m(50, 54), energy_j(0, 1e-15);
    std::vector<Arrival> arrivals;
    for (std::size_t i = 0; i < count; ++i) {
      arrivals.push_back({range_m(random), energy_j(random)});
      if (i % 5 == 4) arrivals.back().range_m = arrivals[i - 1].range_m;
    }
    const Receiver receiver(laser, noisy(Timing::ConstantFraction, 1e-7));
    Waveform first, other;
    receiver.sample(arrivals, first);
    const Detections found = detect(receiver, arrivals, pulse_number(1));
    for (int k = 0; k < 10; ++k) {
      std::ranges::shuffle(arrivals, random);
      receiver.sample(arrivals, other);
      ASSERT_EQ(first.segments().size(), other.segments().size());
      for (std::size_t s = 0; s < first.segments().size(); ++s) {
        ASSERT_TRUE(std::ranges::equal(first.power_w(first.segments()[s]),
                                       other.power_w(other.segments()[s])));
      }
      ASSERT_EQ(ranges_m(found), ranges_m(detect(receiver, arrivals, pulse_number(1))));
    }
  }
}

TEST(Receiver, TableOfAGaussianYieldsTheGaussiansRanges) {
  constexpr double step_s = 0.05e-9;
  PulseSpec measured{.shape_step_s = step_s};
  for (int i = -240; i <= 240; ++i) {
    measured.shape.push_back(std::exp(-4 * std::numbers::ln2 * std::pow(i * step_s / 4e-9, 2)));
  }
  const auto arrivals = arrivals_of({{20, 1e-6}, {22, 3e-6}, {80, 0.7e-6}});
  for (const Timing timing : timings) {
    const Detections exact = detect(Receiver(laser, spec_of(timing)), arrivals);
    const Detections found = detect(Receiver(measured, spec_of(timing)), arrivals);
    ASSERT_EQ(found.size(), exact.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      // Linear interpolation widens the variance by step^2 / 6: 9e-5 of sigma^2.
      EXPECT_NEAR(found[i].range_m, exact[i].range_m, 2e-4 * sigma_m);
      EXPECT_NEAR(found[i].power_w, exact[i].power_w, 1e-4 * exact[i].power_w);
      EXPECT_NEAR(found[i].width_s, exact[i].width_s, 1e-4 * exact[i].width_s);
    }
  }
}

TEST(Receiver, RangesOfASkewedPulseAreAccurateToAFractionOfABin) {
  const PulseSpec skewed{.shape = {0, 2, 7, 10, 9, 7, 5, 3.5, 2.4, 1.6, 1, 0.5, 0.2, 0},
                         .shape_step_s = 0.7e-9};
  for (const Timing timing : timings) {
    const Receiver receiver(skewed, spec_of(timing));
    const double bin_m = receiver.interval_s() * c_m_per_s / 2;
    for (int i = 0; i < 300; ++i) {
      // Twice the threshold, for the leading edge.
      const Arrival arrival{40 + i * 0.0123456, 1e-6 / receiver.pulse().peak_per_s()};
      const Detections found = detect(receiver, {&arrival, 1});
      ASSERT_EQ(found.size(), 1u);
      // The centroid needs no interpolation. The other estimates keep the skewed logarithm's higher
      // derivatives over a quarter of a sigma: 3e-2 of a bin from the third, which a parabola
      // lacks; 1e-3 from the fourth, which a cubic lacks; and 3e-3 where the level is a fraction of
      // a parabola's peak.
      const double part = timing == Timing::CentreOfGravity    ? 1e-5
                          : timing == Timing::Peak             ? 3e-2
                          : timing == Timing::ConstantFraction ? 3e-3
                                                               : 1e-3;
      EXPECT_NEAR(found[0].range_m, arrival.range_m, part * bin_m) << static_cast<int>(timing);
    }
  }
}

TEST(Receiver, RejectsInvalidSpecs) {
  EXPECT_THAT(
      [] {
        Receiver(laser, {.response_fwhm_s = -1,
                         .fraction = 1,
                         .most_returns = 0,
                         .dead_time_s = -1,
                         .saturation_w = 0,
                         .group_index = 0.9});
      },
      ThrowsMessage<Error>(AllOf(
          HasSubstr("response_fwhm_s = -1"), HasSubstr("a leading edge needs a threshold"),
          HasSubstr("fraction = 1"), HasSubstr("most_returns = 0"), HasSubstr("dead_time_s = -1"),
          HasSubstr("saturation_w = 0"), HasSubstr("group_index = 0.9"))));
  ReceiverSpec spec = noisy(Timing::Peak, 1e-6);
  spec.response_fwhm_s = 0;
  spec.noise->wavelength_m = 905;
  spec.noise->quantum_efficiency = 1.1;
  spec.noise->excess_noise_factor = 0.5;
  spec.noise->nep_w_per_sqrt_hz = 0;
  spec.noise->false_alarm_rate_hz = 100;
  EXPECT_THAT([&] { Receiver(laser, spec); },
              ThrowsMessage<Error>(AllOf(
                  HasSubstr("must be positive with noise"), HasSubstr("is it in nanometres?"),
                  HasSubstr("quantum_efficiency = 1.1"), HasSubstr("excess_noise_factor = 0.5"),
                  HasSubstr("nep_w_per_sqrt_hz = 0"), HasSubstr("give one of them"))));
  spec = spec_of(Timing::Peak);
  spec.sample_interval_s = 0.51 * sigma_s;
  EXPECT_THAT([&] { Receiver(laser, spec); },
              ThrowsMessage<Error>(HasSubstr("half a sigma of the pulse")));
}

}  // namespace
}  // namespace groundray::receiver_test
