#pragma once

#include "core/image/image.h"
#include "sensors/camera/camera_spec.h"
#include "sensors/camera/lens/lens.h"

namespace groundray {

/// Returns the irradiance of each pixel, W/m^2, for a scene of uniform radiance 1 W/(m^2 sr), hence
/// in sr: the solid angle of the pupil as seen from the pixel, times the cosine there, transmission
/// and vignetting. One channel; 0 where a pixel has no viewing direction.
/// @param pixel_pitch_m  side of a pixel.
/// @throws Error listing every field that is out of bounds; if the vignetting is negative anywhere
///         in the image; or if the focal length is not within a factor of 1.5 of the lens' own for
///         pixels of this pitch.
/// @see docs/theory/camera_imager.md
ImageF pupil_sr(const Lens& lens, const ApertureSpec& aperture, double pixel_pitch_m);

/// Returns the irradiance of the sensor, W/m^2: each channel of `radiance`, W/(m^2 sr), times
/// `pupil_sr`.
/// @throws Error if their sizes differ, or if `pupil_sr` does not have one channel.
ImageF irradiance(const ImageF& radiance, const ImageF& pupil_sr);

}  // namespace groundray
