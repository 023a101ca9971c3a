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
#include "terrain/area.h"

namespace groundray {

/// Reads what a dataset tells of the stereo pairs that are asked for; none if the input is none.
/// @throws Error as read_stereo_pairs; or if there is nothing else to measure with, but no pair; or
///         a pair is asked for by name of what is no dataset.
std::vector<RecordedPair> find_pairs(const DemRequest& request, const ScanFiles& files);

/// The points that a DEM is asked to be made of: those of stereo pairs, which are kept, and those
/// of scans, which are read whenever they are asked for.
class DemInput {
 public:
  /// Matches the images of stereo pairs. All three must outlive this.
  /// @throws Error if pairs are asked for and have no images, or there is nothing else to measure
  ///         with; and as add_stereo_points.
  DemInput(const DemRequest& request, const ScanFiles& files,
           const std::vector<RecordedPair>& pairs);

  /// Fills a block with the points of all pairs, then scan by scan, large ones in several blocks;
  /// false after the last.
  /// @throws Error as LidarPoints.
  bool next(MeasuredPoints& block);
  /// Begins anew.
  void rewind() noexcept;

  /// Reads all to find where points lie in plan. @throws Error if there are fewer than three.
  Area extent();

  /// The points of one scan, by its number.
  LidarPoints points_of(std::size_t scan);

  const std::vector<PointTally>& scans() const noexcept { return scans_; }
  const std::vector<PointTally>& pairs() const noexcept { return pairs_; }
  /// For people, once all is read.
  std::vector<std::string> notes() const;

 private:
  void match(const std::vector<RecordedPair>& pairs);
  PointNoise noise_of(const ScanFile& scan);

  const DemRequest& request_;
  const ScanFiles& files_;
  MeasuredPoints stereo_;
  std::size_t next_ = 0;  // 0: stereo's; then scans
  std::optional<LidarPoints> reading_;
  std::vector<PointTally> scans_, pairs_;
  std::map<std::string, std::optional<double>> divergences_rad_;  // by sensor
  std::vector<std::string> notes_;
};

/// @throws Error unless `points` make three or more.
void check_count(std::size_t points);

}  // namespace groundray
