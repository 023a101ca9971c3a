#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sensors/pulse.h"

namespace groundray {

/// What one sub-ray brings back.
struct Arrival {
  double range_m = 0;   ///< length of its path, one way; finite and not negative
  double energy_j = 0;  ///< received; an arrival without energy is none
};

/// Bins [begin, end) of the grid that all waveforms of a receiver share: bin k is at time
/// k * interval_s after the pulse left.
struct Bins {
  std::int64_t begin = 0, end = 0;
};

/// Received power over time where there is any: runs of bins with nothing but zeros between them,
/// so neither time nor memory grow with range. Its buffers serve pulse after pulse. Samples have
/// the 2^-24 of a float, which moves an echo by less than 1e-6 of the pulse's sigma.
class Waveform {
 public:
  /// A run of bins, and where their power begins.
  struct Segment {
    Bins bins;
    std::size_t first_sample = 0;
  };

  double interval_s() const { return interval_s_; }
  /// In order of time; never overlapping.
  std::span<const Segment> segments() const { return segments_; }
  /// Returns the power of each bin of a segment, W.
  std::span<const float> power_w(const Segment& segment) const {
    return std::span(samples_).subspan(segment.first_sample, count(segment.bins));
  }
  /// Adds power (of fog, say) from bin `first` on, W, in those bins that are kept.
  /// @see PulseSampler::sample for how to keep bins.
  void add(std::int64_t first, std::span<const float> power_w) noexcept;

 private:
  friend class PulseSampler;
  static std::size_t count(Bins bins) { return static_cast<std::size_t>(bins.end - bins.begin); }
  // The two rows of the table that make a pulse, and their shares of its energy.
  struct Pulse {
    std::int64_t begin;
    std::size_t first_sample;
    const float* row;
    float here_j, next_j;
  };
  void lay_out(Bins kept, std::int64_t width);

  double interval_s_ = 0;
  std::vector<Arrival> arrivals_;  // by range, where they were not
  std::vector<Pulse> pulses_;
  std::vector<Segment> segments_;
  std::vector<float> samples_;
};

/// Lays system pulses on the grid. Of each there is a table for every 1/128 of a bin; in between
/// the two nearest are mixed, which keeps energy and centroid and widens a Gaussian's variance by
/// at most (interval / 256)^2. Immutable.
class PulseSampler {
 public:
  static constexpr int phases = 128;

  /// @param interval_s  from bin to bin; at most the system pulse's FWHM / fwhm_per_sigma / 2.
  PulseSampler(const SystemPulse& pulse, double interval_s);

  double interval_s() const { return interval_s_; }

  /// Makes `waveform` the sum of E_i s(t - R_i s_per_m), the same for any order of `arrivals`; it
  /// is fastest if they come by range.
  /// @param s_per_m   two-way time per metre of range.
  /// @param kept      bins to keep, and some beside, even where no pulse is.
  void sample(std::span<const Arrival> arrivals, double s_per_m, Bins kept,
              Waveform& waveform) const noexcept;

 private:
  double interval_s_;
  std::int64_t first_bin_;  // of a pulse at bin 0
  std::int64_t width_;      // bins of a pulse, and some zeros to shift it
  std::vector<float> rows_;
};

}  // namespace groundray
