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

/// How the pairs of a dataset become points.
struct StereoTaking {
  FrameRange frames;
  MatchOptions matching;
  StereoPointOptions points;
};

/// Two images of a pair, taken at one time.
struct ImagePair {
  std::string name;  ///< for people
  const RecordedPair* pair = nullptr;
  std::size_t left = 0, right = 0;  ///< numbers in the cameras' lists
};

/// Returns the images of pairs that belong together: of one number and within a microsecond.
/// @param notes  gets a sentence of images that have no partner.
std::vector<ImagePair> image_pairs(const std::vector<RecordedPair>& pairs, const FrameRange& frames,
                                   std::vector<std::string>& notes);

/// Rectifies and matches two images, and adds their points. Poses' standard deviations add to the
/// bias that the points of a pair have in common.
/// @throws Error naming the image, as pinhole_pair and match.
PointTally add_stereo_points(const ImagePair& images, const StereoTaking& taking,
                             const PointNoise& noise, std::uint32_t group, MeasuredPoints& to);

}  // namespace groundray
