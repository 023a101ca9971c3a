#pragma once

#include "core/image/image.h"
#include "reconstruction/stereo/pinhole_pair.h"
#include "reconstruction/stereo/stereo_view.h"

namespace groundray {

/// Image of one pinhole of a pair.
struct RectifiedImage {
  ImageF grey;  ///< 1 channel; 0 where unseen
  Image8 seen;  ///< 1 where the camera's own image shows the position
};

/// Returns an image as the pinhole of its side would have recorded it: interpolated at each pixel's
/// exact position by a Lanczos window of three lobes. Where the camera's pixels on the axis are
/// finer than the pinhole's, the window is wider by the same factor. Beyond the boundary, the
/// boundary's values are used.
/// @param grey  1 channel, as recorded by the camera; a pixel that is not finite makes those around
///        it unseen.
/// @throws Error if the image does not have 1 channel and the size of `view`.
/// @see Duchon, Lanczos filtering in one and two dimensions, Journal of Applied Meteorology 18
///      (1979)
RectifiedImage resample(const ImageF& grey, const PinholePair& pair, StereoSide side,
                        const StereoView& view);

/// Returns the luminance of an image of 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 channels (RGB,
/// alpha), with 255 as 1. It stays encoded for the eye, which suits matching best.
/// @throws Error for other numbers of channels.
ImageF grey_of(const Image8& image);

}  // namespace groundray
