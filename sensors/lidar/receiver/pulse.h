#pragma once

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

}  // namespace groundray
