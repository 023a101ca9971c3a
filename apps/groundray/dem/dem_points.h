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
#include "core/trajectory.h"
#include "reconstruction/dem/measured_points.h"

namespace groundray {

/// From where beams came, if files do not tell: from their sensor's place, or straight from above
/// and far away, as for points of a survey from the air in the coordinates of a map.
enum class BeamOrigin { Sensor, Above };

/// What is known of the errors of lidar points besides the noise of their ranges.
struct PointNoise {
  BeamOrigin beams = BeamOrigin::Sensor;
  /// Full angle far from the sensor; none: what a dataset's calibration says of lidars with light.
  std::optional<double> divergence_rad;
  double position_sd_m = 0;    ///< of a scan's pose, each way
  double attitude_sd_rad = 0;  ///< of a scan's pose, about each axis
  double across_sd_m = 0;      ///< of places in plan, besides
  double longest_pose_gap_s = 1;
};

/// What became of a scan or a stereo pair.
struct PointTally {
  std::string name;
  std::size_t rows = 0;            ///< of the file, or pixels that were matched
  std::size_t points = 0;          ///< that measured the DEM
  bool is_noiseless = false;       ///< no standard deviation of ranges is known
  std::vector<std::string> notes;  ///< for people
};

/// Between poses that are far apart in time nobody knows where a sensor was.
/// @param name  of what it measured from `begin` to `end`.
/// @throws Error if the path has a gap within this time, or about it, that is longer.
void check_gap(const std::string& name, const Trajectory& path, std::chrono::nanoseconds begin,
               std::chrono::nanoseconds end, double longest_s);

/// Points with what is known of their errors, and where their beams began.
struct LidarBlock {
  MeasuredPoints points;
  std::vector<glm::dvec3> origins_m;
};

/// Reads the points of a scan with what is known of their errors, in blocks as PointReader. Of a
/// point at the slant range r along the unit vector d, with the range's sd s and the divergence a:
///     C = s^2 d d' + (r a / 4)^2 (1 - d d')                    of the point
///     sd^2 = C_zz = (s d_z)^2 + (r a / 4)^2 (1 - d_z^2)        of the height
///     lean = (C_xz, C_yz) / C_zz                               of the place with the height
///     across^2 = (C_xx + C_yy - lean^2 sd^2) / 2               of the rest of the place, each way
///     bias^2 = position^2 + (r attitude)^2 (1 - d_z^2)         that all of the scan have in common
class LidarPoints {
 public:
  /// @param files, scan  must outlive this.
  /// @param group        number of the scan among all that measured.
  LidarPoints(const ScanFiles& files, const ScanFile& scan, ScanTaking taking,
              const PointNoise& noise, std::uint32_t group);

  /// Returns false after the last.
  /// @throws Error as PointReader; if the path has a gap while the scan was made; or a point is too
  ///         far from a sensor that has no pose, as one in the coordinates of a map is.
  bool next(LidarBlock& block);

  /// What has been read so far.
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

/// Moves D's origin to height 0, so that heights in D are those in W.
void level_origin(ScanFiles& files);

/// Returns the divergence that the file of a dataset's lidar tells, rad: full angle between the
/// 1/e^2 points, both ways' mean, as much wider as the jitter of the beams makes it. Without light
/// there is only jitter: points lie where the axes of beams meet something. Nothing if `scan` is of
/// no dataset.
std::optional<double> calibrated_divergence_rad(const std::filesystem::path& dataset,
                                                const ScanFile& scan);

}  // namespace groundray
