#pragma once

#include <array>
#include <chrono>
#include <filesystem>
#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "apps/dataset/dataset_listing.h"
#include "core/trajectory.h"
#include "sensors/camera/lens_models.h"

namespace groundray {

/// A camera of a stereo pair in a dataset.
struct RecordedCamera {
  std::string name;
  Trajectory X_DC;
  LensModel lens;
  glm::ivec2 size_px{0};
  double exposure_s = 0, row_s = 0;
  std::vector<RecordedFrame> frames;  ///< by number; pictures (.png), else light (.exr)

  /// Returns the middle of an image's exposure: of its middle row.
  std::chrono::nanoseconds middle(const RecordedFrame& frame) const;
};

/// A stereo pair in a dataset: its left and its right camera.
struct RecordedPair {
  std::string name;
  std::array<RecordedCamera, 2> cameras;
};

/// Reads what a dataset folder tells of its stereo pairs (docs/formats.md); images are not looked
/// into.
/// @param names  pairs to read, or LEFT,RIGHT: two cameras that are none; all pairs if there are
///               none.
/// @throws Error naming file, line and rule of each fault; or if there is no pair of a name.
std::vector<RecordedPair> read_stereo_pairs(const std::filesystem::path& dataset,
                                            const std::vector<std::string>& names);

}  // namespace groundray
