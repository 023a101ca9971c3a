#pragma once

#include <array>
#include <chrono>
#include <filesystem>
#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "apps/dataset/dataset_reader.h"
#include "core/geometry/trajectory.h"
#include "sensors/camera/lens/lens_models.h"

namespace groundray {

/// Camera of a stereo pair in a dataset.
struct RecordedCamera {
  std::string name;
  Trajectory X_DC;
  LensModel lens;
  glm::ivec2 size_px{0};
  double exposure_s = 0, row_s = 0;
  std::vector<RecordedFrame> frames;  ///< sorted by number; files: .png, or else .exr (radiance)

  /// Returns the middle of an image's exposure: that of its middle row.
  std::chrono::nanoseconds middle(const RecordedFrame& frame) const;
};

/// Stereo pair in a dataset: its left and right cameras.
struct RecordedPair {
  std::string name;
  std::array<RecordedCamera, 2> cameras;
};

/// Reads the stereo pairs of a dataset folder (docs/reference/formats.md); does not open the
/// images.
/// @param names  pairs to read, or LEFT,RIGHT for two cameras that form no pair; empty for all.
/// @throws Error naming file, line and rule of each fault, or if a named pair does not exist.
std::vector<RecordedPair> read_stereo_pairs(const std::filesystem::path& dataset,
                                            const std::vector<std::string>& names);

}  // namespace groundray
