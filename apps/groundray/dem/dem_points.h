#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/scan_files.h"
#include "apps/dataset/scan_input.h"
#include "core/geometry/trajectory.h"
#include "reconstruction/dem/measured_points.h"

namespace groundray {

/// Origin of beams: the position of their sensor, or vertically above and far away, as for airborne
/// surveys in map coordinates.
enum class BeamOrigin { Sensor, Above };

/// Errors of lidar points other than the noise of their ranges.
struct PointNoise {
  BeamOrigin beams = BeamOrigin::Sensor;
  /// Full angle far from the sensor; if empty, calibrated_divergence_rad() of a dataset's lidar.
  std::optional<double> divergence_rad;
  double position_sd_m = 0;    ///< standard deviation of a scan's pose, along each axis
  double attitude_sd_rad = 0;  ///< standard deviation of a scan's pose, about each axis
  double across_sd_m = 0;      ///< additional standard deviation of points in plan, per axis
  double longest_pose_gap_s = 1;
};

/// Statistics of a scan or a stereo pair.
struct PointTally {
  std::string name;
  std::size_t rows = 0;            ///< rows of the file, or matched pixels
  std::size_t points = 0;          ///< number of points passed on to the DEM
  bool is_noiseless = false;       ///< true if no standard deviation of ranges is known
  std::vector<std::string> notes;  ///< messages for the user
};

/// Checks that poses have no long gap in time, in which the sensor's position is unknown.
/// @param name  name of the data measured from `begin` to `end`, for messages.
/// @throws Error if a gap of the trajectory that overlaps this interval is longer than `longest_s`.
void check_gap(const std::string& name, const Trajectory& path, std::chrono::nanoseconds begin,
               std::chrono::nanoseconds end, double longest_s);

/// Points with their errors, and the origins of their beams.
struct LidarBlock {
  MeasuredPoints points;
  std::vector<glm::dvec3> origins_m;
};

/// Reader for the points of a scan and their errors, in blocks as PointReader. For a point at slant
/// range r along the unit vector d, with the range's standard deviation s and the divergence a:
///     C = s^2 d d' + (r a / 4)^2 (1 - d d')               covariance of the point
///     sd^2 = C_zz = (s d_z)^2 + (r a / 4)^2 (1 - d_z^2)   variance of the height
///     lean = (C_xz, C_yz) / C_zz                          shift in plan per error of the height
///     across^2 = (C_xx + C_yy - lean^2 sd^2) / 2          remaining variance in plan, per axis
///     bias^2 = position^2 + (r attitude)^2 (1 - d_z^2)    variance common to the scan's points
class LidarPoints {
 public:
  /// @param files, scan  must outlive this.
  /// @param group        number of the scan among all scans and pairs of images.
  LidarPoints(const ScanFiles& files, const ScanFile& scan, ScanTaking taking,
              const PointNoise& noise, std::uint32_t group);

  /// Reads the next block; returns false after the last.
  /// @throws Error as PointReader; if the trajectory has a gap during the scan; or if a point is
  ///         too far from a sensor without a pose, which suggests map coordinates.
  bool next(LidarBlock& block);

  /// Statistics of the points read so far.
  const PointTally& tally() const noexcept { return tally_; }

 private:
  void check(const PointInput& input) const;
  void count(const PointInput& input);

  const ScanFiles& files_;
  const ScanFile& scan_;
  PointNoise noise_;
  std::uint32_t group_;
  PointReader reader_;
  PointTally tally_;
};

/// Moves D's origin to height 0, so that heights in D equal those in W.
void level_origin(ScanFiles& files);

/// Returns the divergence of a dataset's lidar according to its calibration, rad: full angle
/// between the 1/e^2 points, as the root mean square of both axes, widened by the jitter of the
/// beams. Without light, only the jitter counts: points lie where the axes of the beams hit.
/// Nothing if there is no calibration file, as when `scan` is not of a dataset.
std::optional<double> calibrated_divergence_rad(const std::filesystem::path& dataset,
                                                const ScanFile& scan);

}  // namespace groundray
