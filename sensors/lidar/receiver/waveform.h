#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace groundray {

/// Full width at half maximum of a Gaussian over its standard deviation: 2 sqrt(2 ln 2).
inline constexpr double fwhm_per_sigma = 2.3548200450309493;

/// Emitted laser pulse: a Gaussian given by its width, or a measured table.
struct PulseSpec {
  double fwhm_s = 0;  ///< full width at half maximum of a Gaussian; 0 if a table is given
  /// Power on any scale at equal steps of time, linear in between and falling to 0 one step beyond
  /// the ends. Empty for a Gaussian.
  std::vector<double> shape;
  double shape_step_s = 0;
};

/// System pulse s(t): the receiver's response to an echo of unit energy from a single point, which
/// is the emitted pulse convolved with a Gaussian response. Its integral is 1 and its centroid is
/// at time 0.
class SystemPulse {
 public:
  /// Fraction of the peak; s stays below it outside [begin_s(), end_s()].
  static constexpr double cut_off = 1e-7;

  /// @param response_sigma_s  standard deviation of the receiver's response; 0 for instantaneous.
  /// @throws Error listing every field of `spec` that is out of bounds.
  SystemPulse(const PulseSpec& spec, double response_sigma_s);

  /// Returns s at a time, 1/s, in closed form. A table is a sum of ramps, each convolved with the
  /// response.
  double operator()(double time_s) const;

  double begin_s() const { return begin_s_; }
  double end_s() const { return end_s_; }
  double peak_s() const { return peak_s_; }          ///< time of the maximum
  double peak_per_s() const { return peak_per_s_; }  ///< maximum, 1/s
  double fwhm_s() const { return fwhm_s_; }
  /// Returns the time at which s first reaches `fraction`, in (0, 1), of its peak.
  double rise_s(double fraction) const;
  /// Returns a spacing at which equal pulses add up to a constant, to 1e-4 of it: a fraction 2^-k
  /// of fwhm_s() / fwhm_per_sigma, or `least_s` if none above that is short enough.
  double even_spacing_s(double least_s) const;

 private:
  void sum_ramps(const PulseSpec& spec);
  void measure();
  double crossing_s(double low_s, double high_s, double level_per_s) const;

  // Slopes of the ramps, which begin at equal steps and add up to the table; empty for a Gaussian.
  std::vector<double> ramps_;
  double first_ramp_s_ = 0;
  double step_s_ = 0;
  double sigma_s_;  // sigma of the Gaussian, or of the response that smooths the ramps
  double begin_s_ = 0, end_s_ = 0;
  double peak_s_ = 0, peak_per_s_ = 0, fwhm_s_ = 0;
};

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
              Waveform& waveform) const;

 private:
  double interval_s_;
  std::int64_t first_bin_;  // first bin of a pulse at bin 0
  std::int64_t width_;      // bins of a pulse, and zeros that allow it to be shifted
  std::vector<float> rows_;
};

}  // namespace groundray
