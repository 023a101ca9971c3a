#pragma once

#include <cstddef>
#include <filesystem>

#include "core/image.h"

namespace groundray {

/// Writes optical flow as Middlebury's .flo. What is unknown, a component that is not finite or
/// beyond 1e9 px, becomes 1e10 in both components, as that format's tools have it.
/// @param flow_px  u (to the right) and v (down) of each pixel, px.
/// @throws Error as write_whole, or unless there are 2 channels.
/// @see Baker et al., A database and evaluation methodology for optical flow, IJCV 92 (2011).
void write_flo(const std::filesystem::path& path, const ImageF& flow_px);

/// Writes optical flow as KITTI's PNG of 3 x 16 bits: round(64 u) + 2^15, round(64 v) + 2^15, and 1
/// where both are known, all 0 elsewhere: -512 to 511.98 px in steps of 1/64 px.
/// @param flow_px  as of write_flo.
/// @return how many known flows are left out since they are beyond that.
/// @throws Error likewise.
/// @see Geiger et al., Are we ready for autonomous driving? CVPR (2012), development kit.
std::size_t write_kitti_flow(const std::filesystem::path& path, const ImageF& flow_px);

}  // namespace groundray
