#pragma once

#include "core/image.h"
#include "reconstruction/stereo/pinhole_pair.h"
#include "reconstruction/stereo/stereo_view.h"

namespace groundray {

/// What one pinhole of a pair would have seen.
struct RectifiedImage {
  ImageF grey;  ///< 1 channel; 0 where it is not seen
  Image8 seen;  ///< 1 where the camera's own image shows the place
};

/// Returns an image as the pinhole of its side would have seen it: each pixel's exact place in it,
/// weighted by a Lanczos window of three lobes. Where the camera's pixels are finer, on the axis,
/// than the pinhole's the window is as much wider. Beside the rim the rim's values are taken.
/// @param grey  1 channel, as the camera gave it; a pixel that is not finite makes those round it
///              unseen.
/// @throws Error if the image has other than 1 channel or another size than `view`.
/// @see Duchon, Lanczos filtering in one and two dimensions, Journal of Applied Meteorology 18
///      (1979)
RectifiedImage resample(const ImageF& grey, const PinholePair& pair, StereoSide side,
                        const StereoView& view);

/// Returns the luminance of an image of 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 channels (RGB,
/// alpha), 255 as 1: as it is encoded for the eye, which is what matching does best with.
/// @throws Error if it has other channels.
ImageF grey_of(const Image8& image);

}  // namespace groundray
