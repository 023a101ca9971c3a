#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "apps/scene/world.h"

namespace groundray {

/// What the comment of a scan with its convergence begins with; a YAML mapping follows.
inline constexpr std::string_view convergence_comment = "convergence ";

/// The folder that a run fills (docs/formats.md). Made anew, or taken up again where an earlier run
/// of the same scene, seed and version stopped.
class Dataset {
 public:
  /// Writes poses, calibration and dataset.yaml.
  /// @throws Error if the folder cannot be written, or holds anything else than a dataset of this
  /// very run.
  Dataset(const std::filesystem::path& folder, const World& world);

  /// Returns the file of a product: `suffix` follows the frame's number.
  std::filesystem::path product_path(const PlacedLidar& lidar, std::int64_t frame,
                                     std::string_view suffix) const;
  std::filesystem::path product_path(const PlacedCamera& camera, std::int64_t frame,
                                     std::string_view suffix) const;

  /// Whether a frame is there: its scan, which comes last, or all that its image has.
  bool has(const PlacedLidar& lidar, std::int64_t frame) const;
  bool has(const PlacedCamera& camera, std::int64_t frame) const;

  /// Brings dataset.yaml's record of which frames are done up to date.
  void record() const;

 private:
  std::filesystem::path folder_;
  const World& world_;
  std::string header_;  // what dataset.yaml says of the run itself
};

}  // namespace groundray
