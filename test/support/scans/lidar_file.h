#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

#include "sensors/lidar/lidar_spec.h"

namespace groundray::testing {

/// A small lidar file.
inline constexpr const char* lidar_text = R"(groundray_lidar: 1
model: Two beams
rotation:
  rate_hz: 10
  sense: counter_clockwise
  start_azimuth_deg: 180
firing_period_us: 100
range_gate_m:
  near: 0.3
beam_columns: [ring, elevation_deg, azimuth_offset_deg, origin_z_m, firing_time_us]
beams:
  - [1, -30, 2, 0.01, 0]
  - [0, +3.0e1, -2, 0, 50]
sources:
  beams: a made-up lidar
)";

/// Returns `text` with the first occurrence of `old` replaced; both must hold whole lines if line
/// numbers are to be preserved.
inline std::string with(std::string text, std::string_view old, std::string_view fresh) {
  const auto place = text.find(old);
  if (place == std::string::npos) throw std::logic_error("no such text: " + std::string(old));
  return text.replace(place, old.size(), fresh);
}

/// Returns the pattern of a lidar with a spinning head.
inline const SpinningPattern& spinning(const LidarSpec& lidar) {
  return std::get<SpinningPattern>(lidar.pattern);
}

}  // namespace groundray::testing
