#pragma once

#include <span>

#include "core/image/image.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/camera_spec.h"

namespace groundray {

/// Exposure of one image.
struct ExposureSetting {
  double exposure_s = 0;  ///< exposure time
  double gain = 1;        ///< factor of ImagerSpec::gain_dn_e
};

/// Returns the exposure time and the gain that bring the measured light to the requested level, as
/// near as their limits permit. The exposure time is lengthened before the gain is raised. The dark
/// current is neglected. Without any light, the result is the longest time and the largest gain.
/// @param camera    with an imager and automatic exposure.
/// @param metered   result of Camera::meter.
/// @param pupil_sr  result of pupil_sr() for the same camera.
/// @throws Error listing every field of the automatic exposure that is out of bounds.
/// @see docs/theory/camera_imager.md
ExposureSetting choose_exposure(const CameraSpec& camera, std::span<const MeteredPixel> metered,
                                const ImageF& pupil_sr);

}  // namespace groundray
