#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/groundray/dem_points.h"
#include "apps/groundray/dem_request.h"
#include "apps/groundray/scan_files.h"
#include "reconstruction/dem/measured_points.h"
#include "terrain/area.h"

namespace groundray {

/// The points that a DEM is asked to be made of: those of stereo pairs, which are kept, and those
/// of scans, which are read whenever they are asked for.
class DemInput {
 public:
  /// Matches the images of stereo pairs. `request` and `files` must outlive this.
  /// @throws Error as read_stereo_pairs and add_stereo_points.
  DemInput(const DemRequest& request, const ScanFiles& files);

  /// Fills a block with the points of all pairs, then scan by scan; false after the last.
  /// @throws Error as lidar_points.
  bool next(MeasuredPoints& block);
  /// Begins anew.
  void rewind() noexcept;

  /// Reads all to find where points lie in plan. @throws Error if there are fewer than three.
  Area extent();

  const std::vector<PointTally>& scans() const noexcept { return scans_; }
  const std::vector<PointTally>& pairs() const noexcept { return pairs_; }
  const std::vector<std::string>& notes() const noexcept { return notes_; }

 private:
  void match_pairs();
  PointNoise noise_of(const ScanFile& scan);

  const DemRequest& request_;
  const ScanFiles& files_;
  MeasuredPoints stereo_;
  std::size_t next_ = 0;  // 0: stereo's; then scans
  std::vector<PointTally> scans_, pairs_;
  std::map<std::string, std::optional<double>> divergences_rad_;  // by sensor
  std::vector<std::string> notes_;
};

/// @throws Error unless `points` make three or more.
void check_count(std::size_t points);

}  // namespace groundray
