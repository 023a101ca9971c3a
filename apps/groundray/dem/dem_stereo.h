#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/recorded_stereo.h"
#include "apps/groundray/dem/dem_points.h"
#include "reconstruction/dem/measured_points.h"
#include "reconstruction/stereo/disparity.h"
#include "reconstruction/stereo/stereo_points.h"

namespace groundray {

/// Options for measuring points by stereo pairs.
struct StereoTaking {
  FrameRange frames;
  MatchOptions matching;
  StereoPointOptions points;
};

/// Two simultaneous images of a stereo pair.
struct ImagePair {
  std::string name;  ///< name in messages
  const RecordedPair* pair = nullptr;
  std::size_t left = 0, right = 0;  ///< indices in RecordedCamera::frames
};

/// Returns the pairs of images with the same frame number and stamps within a microsecond.
/// @param notes  receives a note about images without a partner.
std::vector<ImagePair> image_pairs(const std::vector<RecordedPair>& pairs, const FrameRange& frames,
                                   std::vector<std::string>& notes);

/// Rectifies and matches two images, and adds their points. The standard deviations of the poses
/// are added to the bias that all points of a pair have in common.
/// @throws Error naming the images, as pinhole_pair and match.
PointTally add_stereo_points(const ImagePair& images, const StereoTaking& taking,
                             const PointNoise& noise, std::uint32_t group, MeasuredPoints& to);

}  // namespace groundray
