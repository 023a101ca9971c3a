#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/scene/simulation.h"

namespace groundray {

/// Resources that a run is expected to take on this machine.
struct RunEstimate {
  /// Cost of one frame of a sensor.
  struct Frame {
    std::chrono::duration<double> time{0};
    std::uint64_t bytes = 0;
  };
  std::vector<Frame> scans;                      ///< by lidar
  std::vector<Frame> images;                     ///< by camera
  std::chrono::duration<double> preparation{0};  ///< of the scene that is traced
  std::chrono::duration<double> total{0};        ///< including the preparation
  std::uint64_t total_bytes = 0;
};

/// Measures what a run will take: generates and writes one scan of each lidar and four bands of
/// rows of one image of each camera, from the middle of the run, in a temporary folder.
/// @throws Error as the run itself would, or if the temporary folder cannot be written;
///         Interrupted.
RunEstimate estimate_run(Simulation simulation);

}  // namespace groundray
