#include "reconstruction/pipeline/dem_points.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "core/math.h"
#include "reconstruction/stereo/pinhole_pair.h"

namespace groundray {
namespace {

double squared(double x) { return x * x; }

// Errors of the point of one beam.
struct BeamErrors {
  PointErrors noise;
  float bias_sd_m = 0;
};

BeamErrors beam_errors(const glm::dvec3& beam_m, double range_sd_m, const PointNoise& noise) {
  if (noise.beams == BeamOrigin::Above) {
    return {{.sd_m = static_cast<float>(range_sd_m),
             .across_sd_m = static_cast<float>(noise.across_sd_m)},
            static_cast<float>(noise.position_sd_m)};
  }
  const double range_m = glm::length(beam_m);
  const glm::dvec3 along = range_m > 0 ? beam_m / range_m : glm::dvec3(0, 0, -1);
  const double foot2_m2 = squared(range_m * noise.divergence_rad.value_or(0) / 4);
  const glm::dmat3 covariance_m2 =
      glm::dmat3(foot2_m2) + (squared(range_sd_m) - foot2_m2) * glm::outerProduct(along, along);
  BeamErrors errors{.noise = point_errors(covariance_m2)};
  errors.noise.across_sd_m =
      static_cast<float>(math::hypot(errors.noise.across_sd_m, noise.across_sd_m));
  const double flat2 = std::max(0.0, 1 - squared(along.z));
  errors.bias_sd_m = static_cast<float>(
      math::hypot(noise.position_sd_m, range_m * noise.attitude_sd_rad * std::sqrt(flat2)));
  return errors;
}

}  // namespace

void append(const LidarPoint& point, std::uint32_t group, const PointNoise& noise,
            MeasuredPoints& to) {
  const BeamErrors errors = beam_errors(point.p_m - point.origin_m, point.range_sd_m, noise);
  to.p_m.push_back(point.p_m);
  to.sd_m.push_back(errors.noise.sd_m);
  to.bias_sd_m.push_back(errors.bias_sd_m);
  to.lean.push_back(errors.noise.lean);
  to.across_sd_m.push_back(errors.noise.across_sd_m);
  to.groups.push_back(group);
  to.origins.push_back(PointOrigin::Lidar);
}

StereoTally append(const StereoImages& images, const StereoOptions& options,
                   const PointNoise& noise, std::uint32_t group, MeasuredPoints& to) {
  const auto& [left, right] = images.views;
  const PinholePair pair = pinhole_pair(left, right);
  const DisparityMap map =
      match(resample(images.greys[0], pair, StereoSide::Left, left),
            resample(images.greys[1], pair, StereoSide::Right, right), options.matching);
  const std::size_t first = to.size();
  const StereoPoints points = stereo_points(pair, left, map, options.points);
  append(points, group, to);
  for (std::size_t i = first; i < to.size(); ++i) {
    const glm::dvec2 flat_m = glm::dvec2(to.p_m[i]) - glm::dvec2(left.X_DC.translation_m);
    const double pose_m =
        math::hypot(noise.position_sd_m, glm::length(flat_m) * noise.attitude_sd_rad);
    to.bias_sd_m[i] = static_cast<float>(math::hypot(to.bias_sd_m[i], pose_m));
  }
  const auto disparities = map.disparity_px.values();
  const auto matched = static_cast<std::uint64_t>(
      std::ranges::count_if(disparities, [](float d) { return !std::isnan(d); }));
  return {.unmatched = map.unmatched,
          .between = matched - points.size() - points.too_uncertain - points.out_of_limits,
          .too_uncertain = points.too_uncertain,
          .out_of_limits = points.out_of_limits,
          .points = points.size()};
}

void append(const MeasuredPoints& points, MeasuredPoints& to) {
  const auto add = [](auto& all, const auto& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  add(to.p_m, points.p_m);
  add(to.sd_m, points.sd_m);
  add(to.bias_sd_m, points.bias_sd_m);
  add(to.lean, points.lean);
  add(to.across_sd_m, points.across_sd_m);
  add(to.groups, points.groups);
  add(to.origins, points.origins);
}

}  // namespace groundray
