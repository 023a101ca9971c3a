#include "terrain/assets/plan_path.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <iterator>
#include <numbers>
#include <utility>

#include "core/math.h"

namespace groundray {
namespace {

using Duration = std::chrono::duration<double>;

}  // namespace

glm::dvec2 heading_of(double yaw_rad) { return {math::cos(yaw_rad), math::sin(yaw_rad)}; }

glm::dvec2 along_heading(double yaw_rad, double ahead, double left) {
  const glm::dvec2 forward = heading_of(yaw_rad);
  return forward * ahead + glm::dvec2(-forward.y, forward.x) * left;
}

PlanPath::PlanPath(const Trajectory& X_DO) {
  for (const auto& [time, pose] : X_DO.samples()) {
    const glm::dvec3 ahead = pose.rotation * glm::dvec3(1, 0, 0);
    const glm::dvec2 p(pose.translation_m);
    if (!points_.empty()) length_m_ += glm::distance(p, points_.back().p);
    times_.push_back(time);
    along_m_.push_back(length_m_);
    points_.push_back({p, math::atan2(ahead.y, ahead.x)});
  }
}

double PlanPath::distance_m(std::chrono::nanoseconds time) const {
  const auto after = std::ranges::upper_bound(times_, time) - times_.begin();
  const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
      after - 1, 0, std::max<std::ptrdiff_t>(std::ssize(times_) - 2, 0)));
  if (i + 1 >= times_.size()) return length_m_;
  const double share = Duration(time - times_[i]) / Duration(times_[i + 1] - times_[i]);
  return along_m_[i] + share * (along_m_[i + 1] - along_m_[i]);
}

PlanPath::Point PlanPath::at(double s_m) const {
  if (s_m <= 0 || s_m >= length_m_) {
    const Point& end = s_m <= 0 ? points_.front() : points_.back();
    return {end.p + heading_of(end.yaw_rad) * (s_m - (s_m <= 0 ? 0 : length_m_)), end.yaw_rad};
  }
  const auto after = std::ranges::upper_bound(along_m_, s_m) - along_m_.begin();
  const auto i = static_cast<std::size_t>(after - 1);
  const double share = (s_m - along_m_[i]) / (along_m_[i + 1] - along_m_[i]);
  const double turn_rad =
      std::remainder(points_[i + 1].yaw_rad - points_[i].yaw_rad, 2 * std::numbers::pi);
  return {glm::mix(points_[i].p, points_[i + 1].p, share), points_[i].yaw_rad + share * turn_rad};
}

StrideCount::StrideCount(std::vector<double> strides_m, double spacing_m, double begin)
    : strides_m_(std::move(strides_m)), counts_{begin}, spacing_m_(spacing_m) {
  for (std::size_t i = 1; i < strides_m_.size(); ++i)
    counts_.push_back(counts_.back() + spacing_m * 2 / (strides_m_[i - 1] + strides_m_[i]));
}

// Number of the node before a distance, such that another one follows it.
std::size_t StrideCount::before(double s_m) const {
  const double last = static_cast<double>(strides_m_.size()) - 2;
  return static_cast<std::size_t>(std::clamp(std::floor(s_m / spacing_m_), 0.0, last));
}

double StrideCount::stride_m(double s_m) const {
  const std::size_t i = before(s_m);
  const double share = std::clamp(s_m / spacing_m_ - static_cast<double>(i), 0.0, 1.0);
  return std::lerp(strides_m_[i], strides_m_[i + 1], share);
}

double StrideCount::at(double s_m) const {
  const std::size_t i = before(s_m);
  const double share = s_m / spacing_m_ - static_cast<double>(i);
  return counts_[i] + share * (counts_[i + 1] - counts_[i]);
}

double StrideCount::distance_m(double count) const {
  const auto after = std::ranges::upper_bound(counts_, count) - counts_.begin();
  const auto i =
      static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - 1, 0, std::ssize(counts_) - 2));
  const double share = (count - counts_[i]) / (counts_[i + 1] - counts_[i]);
  return (static_cast<double>(i) + share) * spacing_m_;
}

}  // namespace groundray
