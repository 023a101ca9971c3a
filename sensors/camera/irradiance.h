#pragma once

#include "core/image.h"
#include "sensors/camera/camera_spec.h"
#include "sensors/camera/lens.h"

namespace groundray {

/// Returns what the sensor makes of a radiance of 1 W/(m^2 sr) that all of the scene has: the
/// irradiance of each pixel, W/m^2, so in sr: the solid angle of the pupil as a pixel sees it,
/// times the cosine there, transmission and vignetting. One channel; 0 where a pixel looks nowhere.
/// @param pixel_pitch_m  side of a pixel.
/// @throws Error listing every field that is out of bounds; vignetting that is negative somewhere
///         in the image; or if the focal length is not about that of the lens, in pixels of this
///         pitch.
/// @see docs/camera_imager.md
ImageF pupil_sr(const Lens& lens, const ApertureSpec& aperture, double pixel_pitch_m);

/// Returns the light on the sensor, W/m^2: each channel of `radiance`, W/(m^2 sr), times
/// `pupil_sr`.
/// @throws Error if their sizes differ.
ImageF irradiance(const ImageF& radiance, const ImageF& pupil_sr);

}  // namespace groundray
