#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sensors/lidar/receiver/pulse.h"

namespace groundray {

/// Return of one sub-ray.
struct Arrival {
  double range_m = 0;   ///< one-way length of the path; finite and not negative
  double energy_j = 0;  ///< received energy; arrivals without energy are ignored
};

/// Bins [begin, end) of the grid that all waveforms of a receiver share: bin k is at time
/// k * interval_s after the emission of the pulse.
struct Bins {
  std::int64_t begin = 0, end = 0;
};

/// Received power over time: segments of bins with only zeros between them, so neither time nor
/// memory grows with range. The buffers are reused for every pulse. Samples have the relative
/// precision of a float, 2^-24, which moves an echo by less than 1e-6 of the pulse's sigma.
class Waveform {
 public:
  /// Contiguous bins, and the index of their first sample.
  struct Segment {
    Bins bins;
    std::size_t first_sample = 0;
  };

  double interval_s() const { return interval_s_; }
  /// Returns the segments in order of time; they do not overlap.
  std::span<const Segment> segments() const { return segments_; }
  /// Returns the power of each bin of a segment, W.
  std::span<const float> power_w(const Segment& segment) const {
    return std::span(samples_).subspan(segment.first_sample, count(segment.bins));
  }
  /// Adds power, W, for example that of fog, from bin `first` on, to those bins that are kept.
  /// @see PulseSampler::sample for how to keep bins.
  void add(std::int64_t first, std::span<const float> power_w) noexcept;

 private:
  friend class PulseSampler;
  static std::size_t count(Bins bins) { return static_cast<std::size_t>(bins.end - bins.begin); }
  // The two rows of the table that are mixed to a pulse, and the energy of each.
  struct Pulse {
    std::int64_t begin;
    std::size_t first_sample;
    const float* row;
    float here_j, next_j;
  };
  void lay_out(Bins kept, std::int64_t width);

  double interval_s_ = 0;
  std::vector<Arrival> arrivals_;  // sorted copy, if the input is not sorted
  std::vector<Pulse> pulses_;
  std::vector<Segment> segments_;
  std::vector<float> samples_;
};

/// Sampler of system pulses on the grid. The pulse is tabulated for every 1/128 of a bin, with
/// linear interpolation between the two nearest tables. This keeps energy and centroid exact and
/// increases a Gaussian's variance by at most (interval / 256)^2. Immutable.
class PulseSampler {
 public:
  static constexpr int phases = 128;

  /// @param interval_s  time between bins; at most the system pulse's FWHM / fwhm_per_sigma / 2.
  PulseSampler(const SystemPulse& pulse, double interval_s);

  double interval_s() const { return interval_s_; }

  /// Sets `waveform` to the sum of E_i s(t - R_i s_per_m), independent of the order of `arrivals`;
  /// it is fastest if they are sorted by range.
  /// @param s_per_m  two-way time per metre of range.
  /// @param kept  bins to keep even without a pulse; rounded outwards.
  void sample(std::span<const Arrival> arrivals, double s_per_m, Bins kept,
              Waveform& waveform) const noexcept;

 private:
  double interval_s_;
  std::int64_t first_bin_;  // first bin of a pulse at bin 0
  std::int64_t width_;      // bins of a pulse, and zeros that allow it to be shifted
  std::vector<float> rows_;
};

}  // namespace groundray
