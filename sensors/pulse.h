#pragma once

#include <vector>

namespace groundray {

/// Full width at half maximum of a Gaussian over its standard deviation: 2 sqrt(2 ln 2).
inline constexpr double fwhm_per_sigma = 2.3548200450309493;

/// A laser pulse as it leaves: a Gaussian by its width, or a measured table.
struct PulseSpec {
  double fwhm_s = 0;  ///< full width at half maximum of a Gaussian; 0 if there is a table
  /// Power on any scale at equal steps of time, linear between them and to 0 one step beyond the
  /// ends. Empty for a Gaussian.
  std::vector<double> shape;
  double shape_step_s = 0;
};

/// The system pulse s(t): what the receiver makes of an echo of unit energy from one point, the
/// emitted pulse convolved with a Gaussian response. Its integral is 1 and its centroid is time 0.
class SystemPulse {
 public:
  /// The pulse ends where it is below this part of its peak for good.
  static constexpr double cut_off = 1e-7;

  /// @param response_sigma_s  standard deviation of the receiver's response; 0 for instantaneous.
  /// @throws Error listing every field of `spec` that is out of bounds.
  SystemPulse(const PulseSpec& spec, double response_sigma_s);

  /// Returns s at a time, in 1/s: closed forms, also for a table (a sum of ramps, each convolved
  /// with the response).
  double operator()(double time_s) const;

  double begin_s() const { return begin_s_; }
  double end_s() const { return end_s_; }
  double peak_s() const { return peak_s_; }          ///< when it is highest
  double peak_per_s() const { return peak_per_s_; }  ///< and how high
  double fwhm_s() const { return fwhm_s_; }
  /// Returns when s first reaches this part of its peak, which is in (0, 1).
  double rise_s(double fraction) const;

 private:
  void sum_ramps(const PulseSpec& spec);
  void measure();
  double crossing_s(double low_s, double high_s, double level_per_s) const;

  // A table is a sum of ramps that begin at equal steps; a Gaussian has none.
  std::vector<double> ramps_;
  double first_ramp_s_ = 0;
  double step_s_ = 0;
  double sigma_s_;  // of the Gaussian, or of the response that smooths the ramps
  double begin_s_ = 0, end_s_ = 0;
  double peak_s_ = 0, peak_per_s_ = 0, fwhm_s_ = 0;
};

}  // namespace groundray
