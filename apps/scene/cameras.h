#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/image.h"
#include "core/trajectory.h"
#include "sensors/camera/calibration.h"
#include "sensors/camera/camera.h"
#include "sensors/scene_spec.h"

namespace groundray {

/// One camera of a run: what it is, where it goes, when it sees.
struct PlacedCamera {
  MountedCamera spec;
  Camera camera;
  Trajectory X_DC;
  std::vector<std::chrono::nanoseconds> begins;  ///< of its images, those that end within the run
  std::optional<Rectification> rectification;    ///< of a camera of a stereo pair
  ImageF pupil_sr;                               ///< as the function, if there is an imager
};

/// Returns the cameras of a scene on their ways.
/// @param X_DB  of the platform.
/// @throws Error if a stereo pair cannot be rectified, a camera is in two of them, sees no whole
///         image in the run or is triggered while it exposes, or as pupil_sr.
std::vector<PlacedCamera> place_cameras(const SceneSpec& spec, const Trajectory& X_DB);

}  // namespace groundray
