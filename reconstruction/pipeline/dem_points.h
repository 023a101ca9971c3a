#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>

#include "core/image/image.h"
#include "reconstruction/dem/measured_points.h"
#include "reconstruction/stereo/disparity.h"
#include "reconstruction/stereo/pinhole_pair.h"
#include "reconstruction/stereo/stereo_points.h"

namespace groundray {

/// Origin of beams: the position of their sensor, or vertically above and far away, as for airborne
/// surveys in map coordinates.
enum class BeamOrigin { Sensor, Above };

/// Errors of lidar points other than the noise of their ranges.
struct PointNoise {
  BeamOrigin beams = BeamOrigin::Sensor;
  /// Divergence: full angle between the 1/e^2 points, far from the sensor. Empty: unknown, as 0.
  std::optional<double> divergence_rad;
  double position_sd_m = 0;    ///< standard deviation of a scan's pose, along each axis
  double attitude_sd_rad = 0;  ///< standard deviation of a scan's pose, about each axis
  double across_sd_m = 0;      ///< additional standard deviation of points in plan, per axis
};

/// Measured point of a lidar, in D.
struct LidarPoint {
  glm::dvec3 p_m{0};
  glm::dvec3 origin_m{0};  ///< origin of the beam
  double range_sd_m = 0;   ///< standard deviation of the range
};

/// Appends a point with its errors, as derived in docs/theory/dem.md.
/// @param group  number of the scan, whose points share the errors of its pose.
void append(const LidarPoint& point, std::uint32_t group, const PointNoise& noise,
            MeasuredPoints& to);

/// Simultaneous images of the left and the right camera of a pair.
struct StereoImages {
  std::array<StereoView, 2> views;
  std::array<ImageF, 2> greys;  ///< 1 channel, encoded for the eye, 0 to 1
};

/// Options for measuring points by stereo pairs.
struct StereoOptions {
  MatchOptions matching;
  StereoPointOptions points;
};

/// Numbers of pixels of a rectified left image by their use: the sum of all is the size of the
/// image.
struct StereoTally {
  UnmatchedCounts unmatched;
  std::uint64_t between = 0;        ///< matches between the rows and columns of points
  std::uint64_t too_uncertain = 0;  ///< matches omitted by StereoPointOptions::most_relative_sd
  std::uint64_t out_of_limits = 0;  ///< matches omitted by depth or confidence
  std::uint64_t points = 0;         ///< matches that became points

  std::uint64_t matched() const noexcept {
    return between + too_uncertain + out_of_limits + points;
  }
};

/// Rectifies and matches two images and appends their points. The standard deviations of the poses
/// (`noise`) are added to the bias that all points of a pair have in common.
/// @param group  number of the pair of images among all scans and pairs.
/// @throws Error as pinhole_pair, resample, match and stereo_points; `to` is then unchanged.
StereoTally append(const StereoImages& images, const StereoOptions& options,
                   const PointNoise& noise, std::uint32_t group, MeasuredPoints& to);

/// Appends points.
void append(const MeasuredPoints& points, MeasuredPoints& to);

}  // namespace groundray
