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
#include "reconstruction/stereo/stereo_view.h"

namespace groundray {

/// What is taken for the errors of matches, standard deviations.
struct StereoNoise {
  /// Of all disparities alike; without it each has its own, or this much where it has none:
  std::optional<double> match_px = {};
  double bias_px = 0.1;   ///< of what all disparities of a pair have in common
  double place_px = 0.3;  ///< of where in the image a match belongs to, each way
};

/// The match noise of disparities that do not tell their own.
inline constexpr double usual_match_px = 0.3;

/// Which matches become points.
struct StereoPointOptions {
  StereoNoise noise = {};
  double least_confidence = 0.5;
  double nearest_m = 0, farthest_m = std::numeric_limits<double>::infinity();  ///< depth
  /// Points whose disparity's standard deviation, with the bias', is more than this of it are left
  /// out: beyond, an error of depth is neither symmetric nor linear in the disparity's.
  double most_relative_sd = 0.1;
  /// Every so many columns and rows: windows overlap, and so neighbours' errors are alike.
  int stride_px = 6;
};

/// Points in D that a pair of images measured, one entry of each column for each.
struct StereoPoints {
  std::vector<glm::dvec3> p_m;
  std::vector<glm::mat3> covariance_m2;  ///< of the noise, axes of D
  /// One standard deviation of the pair's common bias: it moves all points together, each by its
  /// own vector here times the same number. Not in the covariance.
  std::vector<glm::vec3> bias_m;
  std::vector<glm::vec2> pixels;   ///< where in the left camera's own image
  std::vector<float> depth_m;      ///< along the axis of the rectified pair
  std::vector<float> depth_sd_m;   ///< of its noise
  std::vector<float> confidence;   ///< see DisparityMap
  std::vector<float> footprint_m;  ///< how wide a pixel is there, across the line of sight
  /// By which factor the mean of a few neighbouring points varies more than if each erred apart.
  double together = 1;
  std::uint64_t too_uncertain = 0;  ///< matches that most_relative_sd left out
  std::uint64_t out_of_limits = 0;  ///< that depth or confidence left out

  std::size_t size() const noexcept { return p_m.size(); }
};

/// A disparity as a point of the left pinhole's frame.
struct StereoPoint {
  glm::dvec3 p_m{0};
  glm::dmat3 covariance_m2{0};
  glm::dvec3 by_disparity_m{0};  ///< derivative, m/px
};

/// Returns the point that a pixel of the left pinhole and its disparity stand for, and its noise to
/// first order: J diag(place, place, match)^2 J^T.
/// @param disparity_px  positive.
/// @see Matthies, Shafer, Error modeling in stereo navigation (1987)
StereoPoint stereo_point(const PinholePair& pair, glm::dvec2 pixel, double disparity_px,
                         double match_px, double place_px);

/// Returns the points of a pair's disparities, row by row.
/// @param left  the camera whose image was resampled.
/// @throws Error naming every option that is out of bounds, or if the map is not of the pair's
/// size.
StereoPoints stereo_points(const PinholePair& pair, const StereoView& left, const DisparityMap& map,
                           const StereoPointOptions& options = {});

/// Adds points to those of a DEM: of the noise the share of height, how it leans, and the rest in
/// plan, the mean of both ways with the pixel's footprint; of the bias the share of height.
/// Variances of noise are times `together`, for means are taken as if each point erred apart.
/// @param group  number of the pair: its points have one bias.
void append(const StereoPoints& points, std::uint32_t group, MeasuredPoints& to);

}  // namespace groundray
