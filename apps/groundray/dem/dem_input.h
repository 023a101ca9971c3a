#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/recorded_stereo.h"
#include "apps/dataset/scan_files.h"
#include "apps/groundray/dem/dem_points.h"
#include "apps/groundray/dem/dem_request.h"
#include "reconstruction/dem/measured_points.h"
#include "terrain/dem/density_map.h"

namespace groundray {

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
           const std::vector<RecordedPair>& pairs);

  /// Fills a block: first with the points of all pairs, then scan by scan, with several blocks for
  /// large scans. Returns false after the last block.
  /// @throws Error as LidarPoints.
  bool next(MeasuredPoints& block);
  /// Restarts at the first block.
  void rewind() noexcept;

  /// Reads all points and returns the rectangle that bounds them in plan.
  /// @throws Error if there are fewer than three.
  Area extent();

  /// Returns a reader for the points of the scan with index `scan`.
  LidarPoints points_of(std::size_t scan);

  const std::vector<PointTally>& scans() const noexcept { return scans_; }
  const std::vector<PointTally>& pairs() const noexcept { return pairs_; }
  /// Notes for the user; complete after all points are read.
  std::vector<std::string> notes() const;

 private:
  void match(const std::vector<RecordedPair>& pairs);
  PointNoise noise_of(const ScanFile& scan);

  const DemRequest& request_;
  const ScanFiles& files_;
  MeasuredPoints stereo_;
  std::size_t next_ = 0;  // 0: stereo; i > 0: scan i - 1
  std::optional<LidarPoints> reading_;
  std::vector<PointTally> scans_, pairs_;
  std::map<std::string, std::optional<double>> divergences_rad_;  // by the sensor's name
  std::vector<std::string> notes_;
};

/// Checks the number of points.
/// @throws Error unless there are three or more.
void check_count(std::size_t points);

}  // namespace groundray
