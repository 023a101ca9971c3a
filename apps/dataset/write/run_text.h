#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/dataset/run_part.h"
#include "apps/scene/simulation.h"

namespace groundray {

/// Input of a run that files outside of the scene file determine.
struct RunInput {
  std::string name;  ///< such as "terrain" or "lidar 'roof'"
  std::uint64_t fingerprint = 0;
};

/// Returns all inputs of a run, the terrain first, on which the others may depend. Runs with equal
/// scene files, seeds and inputs make equal frames.
/// @throws Error if an image of the sky cannot be read.
std::vector<RunInput> run_inputs(const Simulation& simulation);

/// Returns the part of dataset.yaml that describes the run (docs/reference/formats.md). Runs with
/// equal texts make equal frames. Only chosen sensors are listed.
/// @throws Error if an image of the sky cannot be read.
std::string run_header(const Simulation& simulation, const FrameChoice& choice = {});

/// Returns the text of calibration/<sensor>.yaml (docs/reference/formats.md).
std::string calibration_text(const PlacedLidar& lidar);
std::string calibration_text(const PlacedCamera& camera);

/// Writes a camera's calibration as <stem>.ros.yaml and <stem>.kalibr.yaml, unless the format
/// cannot describe its lens.
/// @return suffixes of the written files.
/// @throws Error as write_text.
std::vector<std::string> write_exchange_calibrations(const std::filesystem::path& stem,
                                                     const PlacedCamera& camera);

}  // namespace groundray
