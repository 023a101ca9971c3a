#pragma once

#include <glm/vec2.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/random.h"
#include "sensors/lidar/receiver/waveform.h"

namespace groundray {

class EchoTrace;

/// Speed of light in vacuum; exact by the definition of the metre.
inline constexpr double speed_of_light_m_per_s = 299'792'458;

/// Closed interval of slant ranges that a receiver reports, metres along the beam.
struct RangeGate {
  double near_m = 0;
  double far_m = std::numeric_limits<double>::infinity();
};

/// Noise of a receiver, as power at its input.
struct NoiseSpec {
  double nep_w_per_sqrt_hz = 0;    ///< noise-equivalent power of detector and amplifier in the dark
  double wavelength_m = 0;         ///< wavelength of the laser
  double quantum_efficiency = 1;   ///< electrons for each photon, in (0, 1]
  double excess_noise_factor = 1;  ///< excess noise of avalanche gain; 1 without gain
  double false_alarm_rate_hz = 0;  ///< determines the threshold if the spec gives none
};

/// Conversion of received light to echoes. @see docs/theory/lidar_receiver.md
struct ReceiverSpec {
  enum class Timing { LeadingEdge, ConstantFraction, Peak, CentreOfGravity };
  /// Echoes that are reported. `Second` is the second strongest. `Dual` is the strongest and the
  /// last or, if these are the same, the strongest and the second strongest.
  enum class Returns { First, Last, Strongest, Second, Dual, All };

  double response_fwhm_s = 0;    ///< width of the Gaussian response; 0 for instantaneous
  double sample_interval_s = 0;  ///< 0 for a quarter of the system pulse's sigma, FWHM / 2.3548
  Timing timing = Timing::LeadingEdge;
  double threshold_w = 0;  ///< 0 with noise: follows the false alarm rate for any background
  double fraction = 0.5;   ///< fraction of the peak at which ConstantFraction triggers
  Returns returns = Returns::Strongest;
  int most_returns = 255;  ///< maximum number for `All`: the nearest
  double dead_time_s = 0;  ///< time after a detection during which no other is possible
  double saturation_w = std::numeric_limits<double>::infinity();  ///< power above it is clipped
  double group_index = 1;             ///< group index of the air along the path
  double calibrated_group_index = 1;  ///< group index for which the sensor is calibrated
  std::optional<NoiseSpec> noise;     ///< if absent, the receiver is the exact reference
};

/// Parameters of the noise of one pulse, besides its echoes.
struct PulseNoise {
  RandomKey key;            ///< key of the pulse; the receiver sets its sub_ray and stream
  double background_w = 0;  ///< steady light on the detector, which adds only shot noise
};

/// Event that the receiver reports.
struct Detection {
  enum class Kind { Echo, FalseAlarm };
  double range_m = 0;
  double range_sd_m = 0;  ///< standard deviation of range_m due to noise; 0 without noise
  double power_w = 0;     ///< peak power
  double width_s = 0;     ///< full width at half of the peak
  double energy_j = 0;    ///< energy between the minima beside the peak
  double snr = 0;      ///< peak over the noise's standard deviation there; infinite without noise
  double begin_s = 0;  ///< the echo's arrivals have their Receiver::arrival_s in [begin_s, end_s)
  double end_s = 0;
  Kind kind = Kind::Echo;
};
/// Detections of one pulse; to be reused for the next.
using Detections = std::vector<Detection>;

/// Receiver of a lidar: waveform, detection, noise. Immutable and therefore thread-safe.
class Receiver {
 public:
  /// @throws Error listing every field of `spec` that is out of bounds, or else every such field of
  ///         `pulse`.
  Receiver(const PulseSpec& pulse, const ReceiverSpec& spec);

  const SystemPulse& pulse() const { return pulse_; }
  double interval_s() const { return sampler_.interval_s(); }
  /// Returns the time from the emission of a pulse to the arrival of the centroid of an echo at
  /// this range.
  double arrival_s(double range_m) const noexcept { return range_m * s_per_m_; }
  /// Returns the standard deviation of the noise on a signal of `power_w`, W; 0 without noise.
  double noise_w(double power_w, double background_w) const noexcept;
  /// Returns the detection threshold, W.
  double threshold_w(double background_w) const noexcept;

  /// Sets `waveform` to the received power, independent of the order of `arrivals`.
  /// @param kept  bins to keep even without a pulse, for Waveform::add.
  void sample(std::span<const Arrival> arrivals, Waveform& waveform, Bins kept = {}) const {
    sampler_.sample(arrivals, s_per_m_, kept, waveform);
  }
  /// Replaces `found` by the detections in a waveform, by range.
  /// @param gate  gate of reported ranges; detections outside are ignored and start no dead time.
  ///        Its far end must be finite if there is noise.
  void detect(const Waveform& waveform, const RangeGate& gate, const PulseNoise& noise,
              Detections& found) const;

 private:
  struct Timed;
  Timed timed(const EchoTrace& trace, double threshold_w, double background_w,
              double normal) const noexcept;
  Timed centroid(const EchoTrace& trace, double threshold_w, double background_w) const noexcept;
  double edge_bin(const EchoTrace& trace, double threshold_w, double background_w,
                  double normal) const noexcept;
  Timed reported(const EchoTrace& trace, double threshold_w, double background_w,
                 const glm::dvec2& normal) const noexcept;
  void find_echoes(const Waveform& waveform, const PulseNoise& noise, Detections& found) const;
  void add_false_alarms(const RangeGate& gate, const PulseNoise& noise, Detections& found) const;

  ReceiverSpec spec_;
  double response_sigma_s_;
  SystemPulse pulse_;
  PulseSampler sampler_;
  double s_per_m_;               // two-way time per metre of range
  double m_per_s_;               // range per second of two-way time, by the calibrated index
  double offset_s_;              // from the centroid of a pulse to the instant that is timed
  double dark_w2_ = 0;           // variance of the noise without any light
  double shot_w_ = 0;            // variance of the shot noise per watt of light
  double crossings_hz_ = 0;      // Rice's rate of upward crossings at level 0
  double threshold_sigmas_ = 0;  // threshold over the noise's sigma, if the spec gives no threshold
};

}  // namespace groundray
