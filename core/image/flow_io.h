#pragma once

#include <cstddef>
#include <filesystem>

#include "core/image/image.h"

namespace groundray {

/// Writes optical flow in Middlebury's .flo format. Unknown flow, with a component that is not
/// finite or beyond 1e9 px, is written as 1e10 in both components, as that format's tools expect.
/// @param flow_px  u (to the right) and v (down) of each pixel, px.
/// @throws Error as write_whole, or unless there are 2 channels.
/// @see Baker et al., A database and evaluation methodology for optical flow, IJCV 92 (2011).
void write_flo(const std::filesystem::path& path, const ImageF& flow_px);

/// Writes optical flow in KITTI's PNG format of 3 x 16 bits: round(64 u) + 2^15, round(64 v) +
/// 2^15, and 1 where both are known; all 0 elsewhere. The range is -512 to 511.98 px in steps of
/// 1/64 px.
/// @param flow_px  as for write_flo.
/// @return number of known flows that are omitted because they exceed that range.
/// @throws Error as write_flo.
/// @see Geiger et al., Are we ready for autonomous driving? CVPR (2012), development kit.
std::size_t write_kitti_flow(const std::filesystem::path& path, const ImageF& flow_px);

}  // namespace groundray
