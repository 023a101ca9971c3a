#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "apps/scene/world.h"

namespace groundray {

/// Returns a text as a double-quoted YAML scalar.
std::string yaml_text(std::string_view text);

/// Returns what calibration/<sensor>.yaml says of a sensor (docs/formats.md).
std::string calibration_text(const PlacedLidar& lidar);
std::string calibration_text(const PlacedCamera& camera);

/// Writes a camera's calibration in the formats of others that can say it, as <stem>.ros.yaml and
/// <stem>.kalibr.yaml. @return what the names of those that were written end with.
/// @throws Error as write_text.
std::vector<std::string> write_exchange_calibrations(const std::filesystem::path& stem,
                                                     const PlacedCamera& camera);

}  // namespace groundray
