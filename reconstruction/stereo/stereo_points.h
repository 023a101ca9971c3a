#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "reconstruction/dem/measured_points.h"
#include "reconstruction/stereo/disparity.h"
#include "reconstruction/stereo/pinhole_pair.h"

namespace groundray {

/// Assumed errors of matches: standard deviations.
struct StereoNoise {
  /// Error of all disparities; none: each has its own, or usual_match_px if it has none.
  std::optional<double> match_px = {};
  double bias_px = 0.1;   ///< error common to all disparities of a pair
  double place_px = 0.3;  ///< error of a match's position in the image, each way
};

/// Standard deviation of disparities that do not have their own.
inline constexpr double usual_match_px = 0.3;

/// Selection of the matches that become points.
struct StereoPointOptions {
  StereoNoise noise = {};
  double least_confidence = 0.5;
  double nearest_m = 0, farthest_m = std::numeric_limits<double>::infinity();  ///< range of depths
  /// Largest standard deviation of a disparity, including the bias, as a fraction of the disparity.
  /// Points beyond it are omitted: their error of depth is neither symmetric nor linear in that of
  /// the disparity.
  double most_relative_sd = 0.1;
  /// Spacing of points in columns and rows: windows overlap, so that errors of neighbours are
  /// correlated.
  int stride_px = 6;
};

/// Points in D measured by a pair of images, one entry of each column per point.
struct StereoPoints {
  std::vector<glm::dvec3> p_m;
  std::vector<glm::mat3> covariance_m2;  ///< covariance of the noise, in axes of D
  /// One standard deviation of the pair's common bias, in axes of D: it moves all points together,
  /// each by its own vector times the same number. Not included in the covariance.
  std::vector<glm::vec3> bias_m;
  std::vector<glm::vec2> pixels;   ///< positions in the left camera's own image
  std::vector<float> depth_m;      ///< depth along the axis of the rectified pair
  std::vector<float> depth_sd_m;   ///< sd of the depth's noise
  std::vector<float> confidence;   ///< see DisparityMap
  std::vector<float> footprint_m;  ///< width of a pixel at the point, across the line of sight
  /// Factor by which the variance of the mean of a few neighbouring points exceeds that of
  /// independent ones.
  double together = 1;
  std::uint64_t too_uncertain = 0;  ///< matches omitted by most_relative_sd
  std::uint64_t out_of_limits = 0;  ///< matches omitted by depth or confidence

  std::size_t size() const noexcept { return p_m.size(); }
};

/// Disparity as a point of the left pinhole's frame.
struct StereoPoint {
  glm::dvec3 p_m{0};
  glm::dmat3 covariance_m2{0};
  glm::dvec3 by_disparity_m{0};  ///< derivative by the disparity, m/px
};

/// Returns the point that corresponds to a pixel of the left pinhole and its disparity, and its
/// noise to first order: J diag(place, place, match)^2 J^T.
/// @param disparity_px  positive.
/// @see Matthies, Shafer, Error modeling in stereo navigation (1987)
StereoPoint stereo_point(const PinholePair& pair, glm::dvec2 pixel, double disparity_px,
                         double match_px, double place_px);

/// Returns the points of a pair's disparities, in row order.
/// @param left  camera whose image was resampled.
/// @throws Error naming every option that is out of bounds, or if the map does not have the pair's
///         size.
StereoPoints stereo_points(const PinholePair& pair, const StereoView& left, const DisparityMap& map,
                           const StereoPointOptions& options = {});

/// Appends points to those of a DEM: of the noise, the sd of the height, its lean, and the
/// remainder in plan, averaged over both directions, with the pixel's footprint; of the bias, the
/// vertical component. Variances of noise are multiplied by `together`, because means assume
/// independent points.
/// @param group  number of the pair, whose points have one common bias.
void append(const StereoPoints& points, std::uint32_t group, MeasuredPoints& to);

}  // namespace groundray
