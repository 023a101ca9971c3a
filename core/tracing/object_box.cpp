#include "core/tracing/object_box.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include "core/math.h"

namespace groundray {

using std::chrono::nanoseconds;

namespace {

// Extends a box about the foot of a swaying object by all its inclinations. Displacements are
// products of a height, a cosine and a tangent; their extremes are at those of the factors.
ObjectBox swayed(ObjectBox box, const Sway::Range& range) noexcept {
  const glm::dvec2 steepest = glm::max(glm::abs(range.low), glm::abs(range.high));
  const double least_cosine = 1 / std::sqrt(1 + glm::dot(steepest, steepest));
  box.low.z = std::min(box.low.z, box.low.z * least_cosine);
  box.high.z = std::max(box.high.z, box.high.z * least_cosine);
  glm::dvec2 back(0), ahead(0);
  for (const double height_m : {box.low.z, box.high.z}) {
    back = glm::min(back, glm::min(height_m * range.low, height_m * range.high));
    ahead = glm::max(ahead, glm::max(height_m * range.low, height_m * range.high));
  }
  return {box.low + glm::dvec3(back, 0), box.high + glm::dvec3(ahead, 0)};
}

}  // namespace

ObjectBox box_of(const ModelScene::Impl& shape, const PlacedObject& object,
                 const Sway* sway) noexcept {
  const glm::dmat3 R_DO = glm::mat3_cast(object.R_DO);
  const glm::dvec3 half_m = (shape.high_m - shape.low_m) / 2.0;
  const glm::dvec3 centre_m = object.p_DO + object.scale * (R_DO * shape.centre_m);
  glm::dvec3 reach_m(0);
  for (int k = 0; k < 3; ++k) reach_m += glm::abs(R_DO[k]) * half_m[k];
  reach_m *= object.scale * (1 + 1e-12);
  const ObjectBox box{centre_m - reach_m, centre_m + reach_m};
  if (sway == nullptr) return box;
  const glm::dvec3& p_DO = object.p_DO;
  const ObjectBox about_foot = swayed({box.low - p_DO, box.high - p_DO}, sway->range());
  return {p_DO + about_foot.low, p_DO + about_foot.high};
}

// Between two poses, the object's origin deviates from the straight line between them by at most
// the height of the arc that turns by the same angle; a ball round the origin contains the rest of
// the object.
std::vector<ObjectStretch> stretches_of(const Trajectory& X_DO, double ball_m,
                                        std::span<const nanoseconds> times) {
  std::vector<ObjectStretch> stretches;
  const auto& samples = X_DO.samples();
  const auto add = [&](nanoseconds begin, nanoseconds end, const Pose& a, const Pose& b) {
    const double angle_rad =
        2 * math::acos(std::min(std::abs(glm::dot(a.rotation, b.rotation)), 1.0));
    const double arc_m =
        glm::distance(a.translation_m, b.translation_m) / 2 * math::tan(angle_rad / 4);
    const double pad_m = (ball_m + arc_m) * (1 + 1e-9);
    stretches.push_back({begin,
                         end,
                         {glm::min(a.translation_m, b.translation_m) - pad_m,
                          glm::max(a.translation_m, b.translation_m) + pad_m}});
  };
  const auto first = samples.front(), last = samples.back();
  std::vector<nanoseconds> ends;
  for (const Trajectory::Sample& sample : samples) ends.push_back(sample.time);
  for (const nanoseconds time : times) {
    if (first.time < time && time < last.time) ends.push_back(time);
  }
  std::ranges::sort(ends);
  add(nanoseconds::min(), first.time, first.pose, first.pose);
  for (std::size_t i = 0; i + 1 < ends.size(); ++i)
    add(ends[i], ends[i + 1], X_DO.pose_at(ends[i]), X_DO.pose_at(ends[i + 1]));
  add(last.time, nanoseconds::max(), last.pose, last.pose);
  return stretches;
}

}  // namespace groundray
