#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "apps/scene/calibration/camera_calibration.h"
#include "apps/scene/scene_spec.h"
#include "core/geometry/trajectory.h"
#include "core/image/image.h"
#include "sensors/camera/camera.h"

namespace groundray {

/// Camera of a run, with its trajectory and the times of its images.
struct PlacedCamera {
  MountedCamera spec;
  Camera camera;
  Trajectory X_DC;
  std::vector<std::chrono::nanoseconds> begins;  ///< start times of its images within the run
  std::optional<Rectification> rectification;    ///< present for a camera of a stereo pair
  ImageF pupil_sr;  ///< result of pupil_sr(), if there is an imager and an aperture
};

/// Returns the cameras of a scene with their trajectories.
/// @param X_DB  trajectory of the platform.
/// @throws Error if a stereo pair cannot be rectified; if a camera is in two pairs, has no complete
///         image in the run or is triggered during an exposure; or as pupil_sr.
std::vector<PlacedCamera> place_cameras(const SceneSpec& spec, const Trajectory& X_DB);

}  // namespace groundray
