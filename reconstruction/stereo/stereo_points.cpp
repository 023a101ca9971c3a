#include "reconstruction/stereo/stereo_points.h"

#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

bool is_sd(double sd) { return sd >= 0 && std::isfinite(sd); }

void check_stereo_inputs(const PinholePair& pair, const StereoView& left, const DisparityMap& map,
                         const StereoPointOptions& options) {
  Violations broken("stereo points");
  const StereoNoise& noise = options.noise;
  broken.unless(is_sd(noise.match_px.value_or(0)), "match_px = {} must be 0 or more",
                noise.match_px.value_or(0));
  broken.unless(is_sd(noise.bias_px), "bias_px = {} must be 0 or more", noise.bias_px);
  broken.unless(is_sd(noise.place_px), "place_px = {} must be 0 or more", noise.place_px);
  broken.unless(options.nearest_m >= 0 && options.nearest_m < options.farthest_m,
                "nearest_m = {} and farthest_m = {} enclose no depth: are they swapped?",
                options.nearest_m, options.farthest_m);
  broken.unless(options.most_relative_sd > 0 && options.most_relative_sd <= 1,
                "most_relative_sd = {} must be above 0 and at most 1", options.most_relative_sd);
  broken.unless(options.stride_px > 0, "stride_px = {} must be 1 or more", options.stride_px);
  broken.unless(
      pair.focal_px > 0 && pair.baseline_m > 0,
      "the pair has a focal length of {} px and a baseline of {} m: both must be positive",
      pair.focal_px, pair.baseline_m);
  broken.unless(static_cast<bool>(left.project), "the left view has no lens: set project");
  const auto is_of_pair = [&](const ImageF& image) {
    return image.width() == pair.size_px.x && image.height() == pair.size_px.y;
  };
  broken.unless(is_of_pair(map.disparity_px) && is_of_pair(map.confidence) &&
                    (map.sd_px.width() == 0 || is_of_pair(map.sd_px)),
                "the disparities have {} x {} px, the pair {} x {}: the sizes must be equal",
                map.disparity_px.width(), map.disparity_px.height(), pair.size_px.x,
                pair.size_px.y);
  broken.throw_if_any();
}

// Returns the variance of the mean of four points of a square, relative to independent points.
// Errors of near points are correlated: on rendered pairs by half at 4 px, 0.3 at 8.
double variance_together(double stride_px) {
  constexpr double alike_px = 6;
  return 1 + 2 * math::exp(-stride_px / alike_px) +
         math::exp(-std::sqrt(2.0) * stride_px / alike_px);
}

double match_px(const DisparityMap& map, const StereoNoise& noise, int x, int y) {
  if (noise.match_px) return *noise.match_px;
  return map.sd_px.width() > 0 ? static_cast<double>(map.sd_px.at(x, y)[0]) : usual_match_px;
}

void add(const PinholePair& pair, const StereoPoint& point, double bias_px, glm::dvec2 pixel,
         float confidence, StereoPoints& to) {
  const glm::dmat3 turn = glm::mat3_cast(pair.X_DL.rotation);
  to.p_m.push_back(pair.X_DL * point.p_m);
  to.covariance_m2.emplace_back(turn * point.covariance_m2 * glm::transpose(turn));
  to.bias_m.emplace_back(turn * point.by_disparity_m * bias_px);
  to.pixels.emplace_back(pixel);
  to.depth_m.push_back(static_cast<float>(point.p_m.z));
  to.depth_sd_m.push_back(static_cast<float>(std::sqrt(point.covariance_m2[2][2])));
  to.confidence.push_back(confidence);
  to.footprint_m.push_back(static_cast<float>(point.p_m.z / pair.focal_px));
}

}  // namespace

StereoPoint stereo_point(const PinholePair& pair, glm::dvec2 pixel, double disparity_px,
                         double match_px, double place_px) {
  const double m_per_px = pair.baseline_m / disparity_px;
  const glm::dvec3 p_m = m_per_px * glm::dvec3(pixel - pair.centre_px, pair.focal_px);
  const glm::dmat3 jacobian({m_per_px, 0, 0}, {0, m_per_px, 0}, -p_m / disparity_px);
  glm::dmat3 variance_px2(place_px * place_px);
  variance_px2[2][2] = match_px * match_px;
  return {p_m, jacobian * variance_px2 * glm::transpose(jacobian), jacobian[2]};
}

StereoPoints stereo_points(const PinholePair& pair, const StereoView& left, const DisparityMap& map,
                           const StereoPointOptions& options) {
  check_stereo_inputs(pair, left, map, options);
  const StereoNoise& noise = options.noise;
  StereoPoints points;
  points.together = variance_together(options.stride_px);
  for (int y = options.stride_px / 2; y < pair.size_px.y; y += options.stride_px) {
    for (int x = options.stride_px / 2; x < pair.size_px.x; x += options.stride_px) {
      const double disparity_px = map.disparity_px.at(x, y)[0];
      if (!std::isfinite(disparity_px)) continue;
      const double sd_px = match_px(map, noise, x, y);
      if (!(disparity_px > 0) ||
          !(math::hypot(sd_px, noise.bias_px) <= options.most_relative_sd * disparity_px)) {
        ++points.too_uncertain;
        continue;
      }
      const StereoPoint point = stereo_point(pair, {x, y}, disparity_px, sd_px, noise.place_px);
      const float confidence = map.confidence.at(x, y)[0];
      const auto pixel = source_px(pair, StereoSide::Left, left, {x, y});
      if (!pixel || !(confidence >= options.least_confidence) ||
          !(point.p_m.z >= options.nearest_m && point.p_m.z <= options.farthest_m)) {
        ++points.out_of_limits;
        continue;
      }
      add(pair, point, noise.bias_px, *pixel, confidence, points);
    }
  }
  return points;
}

void append(const StereoPoints& points, std::uint32_t group, MeasuredPoints& to) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dmat3 covariance_m2 = points.together * glm::dmat3(points.covariance_m2[i]);
    const double footprint_m = points.footprint_m[i];
    const PointErrors errors = point_errors(covariance_m2);
    to.p_m.push_back(points.p_m[i]);
    to.sd_m.push_back(errors.sd_m);
    to.bias_sd_m.push_back(std::abs(points.bias_m[i].z));
    to.lean.push_back(errors.lean);
    to.across_sd_m.push_back(  // including a pixel's square
        static_cast<float>(math::hypot(errors.across_sd_m, footprint_m / std::sqrt(12.0))));
    to.groups.push_back(group);
    to.origins.push_back(PointOrigin::Stereo);
  }
}

}  // namespace groundray
