#pragma once

#include <limits>
#include <optional>
#include <string>

#include "sensors/atmosphere.h"
#include "sensors/beam.h"
#include "sensors/pulse.h"
#include "sensors/radar_equation.h"
#include "sensors/range_gate.h"
#include "sensors/receiver.h"
#include "sensors/scan_pattern.h"

namespace groundray {

/// The number that a sensor gives with an echo.
struct IntensitySpec {
  enum class Scale {
    Power,        ///< peak power at the detector, W, times `gain`
    Reflectance,  ///< of a perpendicular Lambertian plane that would give this peak in a vacuum
    EightBit,     ///< as Velodyne's: 0 to 100 for reflectances of 0 to 1, above it 101 to 255
  };
  Scale scale = Scale::Power;
  double gain = 1;  ///< per watt
  /// Reflectance of a Lambertian plane that would be as bright as what EightBit gives 255; above
  /// 100 its steps are equal in the logarithm.
  double full_scale_reflectance = 100;
};

/// How a lidar makes light, and what it makes of the light that comes back.
struct LightSpec {
  double wavelength_nm = 0;
  LidarOptics optics;
  PulseSpec pulse;
  ReceiverSpec receiver;
  Overlap overlap;
  SolarBackground sun;
  IntensitySpec intensity;
  double range_step_m = 0;  ///< reported ranges are multiples of it; 0 for none
};

/// Everything that makes one lidar.
struct LidarSpec {
  /// Whether scans bound how far each range is from the reference surface, which takes two more
  /// rays where the terrain is simplified.
  enum class ErrorBound { Omit, Report };
  /// Whether scans tell of the pulses without echoes, and why they have none.
  enum class NoReturns { Omit, Report };
  /// Whether scans keep the power received over time.
  enum class WaveformOutput { Omit, Keep };
  /// In which frame x, y, z are: S as each beam fired, or S at the scan's stamp.
  enum class Points { AsFired, AtStamp };

  std::string model;  ///< for people: "Velodyne VLP-16"
  PatternSpec pattern;
  RangeGate gate;
  BeamSpec beam;
  /// Without it every ray that meets a surface returns, at its exact range.
  std::optional<LightSpec> light;
  double range_noise_sigma_m = 0;  ///< of a Gaussian along the beam, besides what light brings
  double angular_jitter_rad = 0;   ///< standard deviation, both across the beam
  ErrorBound error_bound = ErrorBound::Omit;
  NoReturns no_returns = NoReturns::Omit;
  WaveformOutput waveforms = WaveformOutput::Omit;
  Points points = Points::AsFired;
};

}  // namespace groundray
