#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/recorded_stereo.h"
#include "apps/dataset/scan_files.h"
#include "apps/dataset/scan_input.h"
#include "apps/groundray/dem/dem_report.h"
#include "apps/groundray/dem/dem_request.h"
#include "apps/groundray/progress_stage.h"
#include "core/geometry/trajectory.h"
#include "terrain/dem/density_map.h"

namespace groundray {

/// Checks that poses have no long gap in time, in which the sensor's position is unknown.
/// @param name  name of the data measured from `begin` to `end`, for messages.
/// @throws Error if a gap of the trajectory that overlaps this interval is longer than `longest_s`.
void check_gap(const std::string& name, const Trajectory& path, std::chrono::nanoseconds begin,
               std::chrono::nanoseconds end, double longest_s);

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

/// Appends the points of two images.
/// @throws Error naming the images, as `append` of their views; if an image cannot be read or has
///         another size than its camera; or if there is no pose for an image.
PointTally add_stereo_points(const ImagePair& images, const StereoOptions& options,
                             const MeasurementNoise& noise, std::uint32_t group,
                             MeasuredPoints& to);

/// Reads the requested stereo pairs of a dataset; returns none if the input is not a dataset.
/// @throws Error as read_stereo_pairs; or if there are neither scans nor pairs; or if pairs are
///         named, but the input is not a dataset.
std::vector<RecordedPair> find_pairs(const DemRequest& request, const ScanFiles& files);

/// Points for a DEM: those of stereo pairs, which are kept in memory, and those of scans, which are
/// read anew in each pass.
class DemInput {
 public:
  /// Matches the images of the stereo pairs. All arguments must outlive this.
  /// @throws Error if there are no images of pairs, but pairs are named or there are no scans; and
  ///         as add_stereo_points.
  DemInput(const DemRequest& request, const ScanFiles& files,
           const std::vector<RecordedPair>& pairs, StageProgress& progress);

  /// Fills a block: first with the points of all pairs, without origins, then scan by scan, with
  /// several blocks for large scans. Returns false after the last block.
  /// @throws Error as PointReader; if a trajectory has a gap during the scan; or if a point is too
  ///         far from a sensor without a pose, which suggests map coordinates.
  bool next(LidarBlock& block);
  /// Restarts at the first block, or at the first one of scans.
  void rewind() noexcept { go_to(0); }
  void rewind_to_scans() noexcept { go_to(1); }

  /// Reads all points and returns the rectangle that bounds them in plan.
  /// @throws Error if there are fewer than three.
  Area extent();

  /// Checks the number of points of all scans and pairs.
  /// @throws Error unless there are three or more.
  void check_count(std::size_t points) const;

  const std::vector<PointTally>& scans() const noexcept { return scans_; }
  const std::vector<PointTally>& pairs() const noexcept { return pairs_; }
  /// Notes for the user; complete after all points are read.
  std::vector<std::string> notes() const;

 private:
  void match(const std::vector<RecordedPair>& pairs);
  MeasurementNoise noise_of(const ScanFile& scan);
  void go_to(std::size_t block) noexcept;

  const DemRequest& request_;
  const ScanFiles& files_;
  StageProgress& progress_;
  MeasuredPoints stereo_;
  std::size_t next_ = 0;  // 0: stereo; i > 0: scan i - 1
  std::optional<PointReader> reader_;
  MeasurementNoise noise_;  // of the scan being read
  std::vector<PointTally> scans_, pairs_;
  std::map<std::string, std::optional<double>> divergences_rad_;  // by the sensor's name
  std::vector<std::string> notes_;
};

}  // namespace groundray
