#pragma once

#include <glm/vec2.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/random.h"
#include "sensors/pulse.h"
#include "sensors/range_gate.h"
#include "sensors/waveform.h"

namespace groundray {

class EchoTrace;

/// In vacuum; exact by the definition of the metre.
inline constexpr double speed_of_light_m_per_s = 299'792'458;

/// What disturbs a receiver, as power at its input.
struct NoiseSpec {
  double nep_w_per_sqrt_hz = 0;    ///< noise-equivalent power of detector and amplifier in the dark
  double wavelength_m = 0;         ///< of the laser
  double quantum_efficiency = 1;   ///< electrons for each photon, in (0, 1]
  double excess_noise_factor = 1;  ///< of an avalanche's gain; 1 without one
  double false_alarm_rate_hz = 0;  ///< what the threshold is to keep to, if the spec gives none
};

/// Everything that turns received light into echoes. See docs/lidar_receiver.md.
struct ReceiverSpec {
  enum class Timing { LeadingEdge, ConstantFraction, Peak, CentreOfGravity };
  /// `Second` is the second strongest; `Dual` the strongest and the last and, where these are one,
  /// the second strongest too.
  enum class Returns { First, Last, Strongest, Second, Dual, All };

  double response_fwhm_s = 0;    ///< of a Gaussian; 0 for instantaneous
  double sample_interval_s = 0;  ///< 0 for a quarter of the system pulse's sigma, FWHM / 2.3548
  Timing timing = Timing::LeadingEdge;
  double threshold_w = 0;  ///< 0 with noise: kept at the false alarm rate, whatever the background
  double fraction = 0.5;   ///< of the peak, where a constant fraction discriminator triggers
  Returns returns = Returns::Strongest;
  int most_returns = 255;  ///< of `All`: those that come first
  double dead_time_s = 0;  ///< after a detection, until the next is possible
  double saturation_w = std::numeric_limits<double>::infinity();  ///< all above is clipped to it
  double group_index = 1;             ///< of the air that the light goes through
  double calibrated_group_index = 1;  ///< that the sensor divides by
  std::optional<NoiseSpec> noise;     ///< none: the exact reference
};

/// What the noise of one pulse depends on besides its echoes.
struct PulseNoise {
  RandomKey key;            ///< names the pulse; its sub_ray and stream are set here
  double background_w = 0;  ///< steady light on the detector, which adds shot noise alone
};

/// One event that the receiver reports.
struct Detection {
  enum class Kind { Echo, FalseAlarm };
  double range_m = 0;
  double range_sd_m = 0;  ///< standard deviation of range_m by noise; 0 without it
  double power_w = 0;     ///< at its peak
  double width_s = 0;     ///< full width at half of the peak
  double energy_j = 0;    ///< between the minima beside it
  double snr = 0;      ///< peak over the noise's standard deviation there; infinite without noise
  double begin_s = 0;  ///< arrivals whose Receiver::arrival_s is in [begin_s, end_s) made it
  double end_s = 0;
  Kind kind = Kind::Echo;
};
/// To be used again for pulse after pulse.
using Detections = std::vector<Detection>;

/// A lidar's receiver: waveform, detection, noise. Immutable, so any number of threads may use one.
class Receiver {
 public:
  /// @throws Error listing every field of `spec`, or else of `pulse`, that is out of bounds.
  Receiver(const PulseSpec& pulse, const ReceiverSpec& spec);

  const SystemPulse& pulse() const { return pulse_; }
  double interval_s() const { return sampler_.interval_s(); }
  /// Returns when the centroid of an echo from this far comes in, after the pulse left.
  double arrival_s(double range_m) const noexcept { return range_m * s_per_m_; }
  /// Returns the standard deviation of the noise on `power_w` of signal, W; 0 for no noise.
  double noise_w(double power_w, double background_w) const noexcept;
  double threshold_w(double background_w) const noexcept;

  /// Makes `waveform` the power received: the same for any order of `arrivals`.
  /// @param kept  bins to keep even where no pulse is, for Waveform::add.
  void sample(std::span<const Arrival> arrivals, Waveform& waveform,
              Bins kept = {}) const noexcept {
    sampler_.sample(arrivals, s_per_m_, kept, waveform);
  }
  /// Replaces `found` by what the receiver reports of a waveform, by range.
  /// @param gate  of reported ranges; nothing outside is seen or starts the dead time. It must end
  ///              if there is noise.
  void detect(const Waveform& waveform, const RangeGate& gate, const PulseNoise& noise,
              Detections& found) const noexcept;

 private:
  struct Timed;
  Timed timed(const EchoTrace& trace, double threshold_w, double background_w,
              double normal) const noexcept;
  Timed centroid(const EchoTrace& trace, double threshold_w, double background_w) const noexcept;
  double edge_bin(const EchoTrace& trace, double threshold_w, double background_w,
                  double normal) const noexcept;
  Timed reported(const EchoTrace& trace, double threshold_w, double background_w,
                 const glm::dvec2& normal) const noexcept;
  void find_echoes(const Waveform& waveform, const PulseNoise& noise,
                   Detections& found) const noexcept;
  void add_false_alarms(const RangeGate& gate, const PulseNoise& noise,
                        Detections& found) const noexcept;

  ReceiverSpec spec_;
  double response_sigma_s_;
  SystemPulse pulse_;
  PulseSampler sampler_;
  double s_per_m_;               // of range, there and back
  double m_per_s_;               // as the sensor reckons
  double offset_s_;              // from the centroid of a pulse to the event that is timed
  double dark_w2_ = 0;           // variance of the noise without any light
  double shot_w_ = 0;            // variance of the shot noise for each watt of light
  double crossings_hz_ = 0;      // Rice's rate of upward crossings at level 0
  double threshold_sigmas_ = 0;  // where the spec gives no threshold
};

}  // namespace groundray
