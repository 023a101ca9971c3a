#pragma once

#include <limits>
#include <optional>
#include <string>

#include "sensors/lidar/beam/beam.h"
#include "sensors/lidar/pattern/scan_pattern.h"
#include "sensors/lidar/receiver/radar_equation.h"
#include "sensors/lidar/receiver/receiver.h"
#include "sensors/lidar/receiver/waveform.h"
#include "sensors/sky/atmosphere.h"

namespace groundray {

/// Intensity that a sensor reports for an echo.
struct IntensitySpec {
  enum class Scale {
    Power,        ///< peak power at the detector, W, times `gain`
    Reflectance,  ///< reflectance of a perpendicular Lambertian plane with this peak in a vacuum
    EightBit,     ///< as Velodyne's: 0 to 100 for reflectances of 0 to 1, above that 101 to 255
  };
  Scale scale = Scale::Power;
  double gain = 1;  ///< 1/W
  /// Reflectance of the Lambertian plane that EightBit maps to 255. Above 100 the steps of EightBit
  /// are equal in the logarithm of reflectance.
  double full_scale_reflectance = 100;
};

/// Emitted light of a lidar and the processing of the received light.
struct LightSpec {
  double wavelength_nm = 0;
  LidarOptics optics;
  PulseSpec pulse;
  ReceiverSpec receiver;
  Overlap overlap;
  SolarBackground sun;
  IntensitySpec intensity;
  double range_step_m = 0;  ///< reported ranges are rounded to multiples of it; 0 for no rounding
};

/// Specification of a lidar.
struct LidarSpec {
  /// Output of a bound on each range's difference from the reference surface. Where the terrain is
  /// simplified, bounds take several times as long as tracing.
  enum class ErrorBound { Omit, Report };
  /// Output of the pulses without an echo, with the reason.
  enum class NoReturns { Omit, Report };
  /// Output of the power received over time.
  enum class WaveformOutput { Omit, Keep };
  /// Output of the boxes of the instances that a scan hit.
  enum class Boxes { Omit, Report };
  /// Frame of x, y, z: S as each pulse fired, or S at the scan's stamp.
  enum class Points { AsFired, AtStamp };

  std::string model;  ///< for human readers: "Velodyne VLP-16"
  PatternSpec pattern;
  RangeGate gate;
  BeamSpec beam;
  /// EchoSimulator simulation. If absent, every ray that hits a surface returns at its exact range.
  std::optional<LightSpec> light;
  double range_noise_sigma_m = 0;  ///< along the beam, Gaussian, added to the receiver's noise
  double angular_jitter_rad = 0;   ///< standard deviation, in both directions across the beam
  ErrorBound error_bound = ErrorBound::Omit;
  NoReturns no_returns = NoReturns::Omit;
  WaveformOutput waveforms = WaveformOutput::Omit;
  Boxes boxes = Boxes::Omit;
  Points points = Points::AsFired;
};

}  // namespace groundray
