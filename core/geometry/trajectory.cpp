#include "core/geometry/trajectory.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace groundray {
namespace {

double seconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

Trajectory::Trajectory(std::vector<Sample> samples) : samples_(std::move(samples)) {
  Violations broken("trajectory");
  broken.unless(!samples_.empty(), "there is no pose; at least one is required");
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    auto& [rotation, translation_m] = samples_[i].pose;
    const double norm = glm::length(rotation);
    broken.unless(std::abs(norm - 1) <= 1e-6,
                  "pose {} has a quaternion of norm {}; it must be 1 within 1e-6: are its four "
                  "values in the format's order?",
                  i, norm);
    broken.unless(std::isfinite(translation_m.x + translation_m.y + translation_m.z),
                  "pose {} has the position ({}, {}, {}) m; it must be finite", i, translation_m.x,
                  translation_m.y, translation_m.z);
    rotation = rotation / norm;
    if (i == 0) continue;
    broken.unless(samples_[i - 1].time < samples_[i].time,
                  "pose {} at {} s is not later than pose {} at {} s; times must increase", i,
                  seconds(samples_[i].time), i - 1, seconds(samples_[i - 1].time));
  }
  broken.throw_if_any();
  screws_.reserve(samples_.size() - 1);
  for (std::size_t i = 0; i + 1 < samples_.size(); ++i) {
    screws_.emplace_back(inverse(samples_[i].pose) * samples_[i + 1].pose);
  }
}

Trajectory::Place Trajectory::place_of(std::chrono::nanoseconds time) const {
  if (time < begin_time() || end_time() < time) {
    throw Error("trajectory: {} s is outside its span of [{}, {}] s; extend it or shorten the run",
                seconds(time), seconds(begin_time()), seconds(end_time()));
  }
  const auto after = std::ranges::upper_bound(samples_, time, {}, &Sample::time);
  const auto i = static_cast<std::size_t>(after - samples_.begin()) - 1;
  if (after == samples_.end()) return {i};
  const std::chrono::nanoseconds span = samples_[i + 1].time - samples_[i].time;
  return {
      i, static_cast<double>((time - samples_[i].time).count()) / static_cast<double>(span.count()),
      seconds(span)};
}

// Inlined as a whole, because it is called for every pulse.
[[gnu::flatten]] Pose Trajectory::pose_at(std::chrono::nanoseconds time) const {
  const auto [i, share, span_s] = place_of(time);
  const Pose& before = samples_[i].pose;
  if (span_s == 0 || before == samples_[i + 1].pose) return before;
  return before * screws_[i].at(share);
}

Velocity Trajectory::velocity_at(std::chrono::nanoseconds time) const {
  auto [i, share, span_s] = place_of(time);
  if (screws_.empty()) return {};
  if (span_s == 0) {  // the end: the velocity of the motion that ends there
    --i;
    share = 1;
    span_s = seconds(samples_[i + 1].time - samples_[i].time);
  }
  const Velocity in_sample = screws_[i].velocity_at(share);
  const glm::dquat& R_AB = samples_[i].pose.rotation;
  return {R_AB * in_sample.linear_m_s / span_s, R_AB * in_sample.angular_rad_s / span_s};
}

Trajectory Trajectory::mounted(const Pose& X_BC) const {
  std::vector<Sample> samples = samples_;
  for (Sample& sample : samples) sample.pose = sample.pose * X_BC;
  return Trajectory(std::move(samples));
}

}  // namespace groundray
