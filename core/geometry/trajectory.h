#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "core/geometry/pose.h"

namespace groundray {

/// Trajectory of a frame B in a frame A: poses X_AB at given times, joined by motions of constant
/// body velocity (constant twist). Immutable; any number of threads may read it.
class Trajectory {
 public:
  /// X_AB at one time.
  struct Sample {
    std::chrono::nanoseconds time{0};
    Pose pose;
  };

  /// @throws Error if `samples` is empty, a time does not lie after the one before, or a pose is
  ///         not finite or not a rotation (norm of the quaternion off 1 by more than 1e-6);
  ///         quaternions are normalised.
  explicit Trajectory(std::vector<Sample> samples);

  std::chrono::nanoseconds begin_time() const { return samples_.front().time; }
  std::chrono::nanoseconds end_time() const { return samples_.back().time; }
  const std::vector<Sample>& samples() const { return samples_; }

  /// Returns the pose at `time`.
  /// @throws Error if `time` lies outside [begin_time(), end_time()].
  Pose pose_at(std::chrono::nanoseconds time) const;
  /// Returns the velocity of B in A at `time`; at a sample, that of the motion that begins there,
  /// or, at the last, ends there.
  /// @throws Error as pose_at.
  Velocity velocity_at(std::chrono::nanoseconds time) const;

  /// Returns the trajectory of a frame C that is fixed in B: X_AC = X_AB * X_BC at every time.
  Trajectory mounted(const Pose& X_BC) const;

 private:
  // A time on the motion that starts at a sample.
  struct Place {
    std::size_t sample = 0;
    double share = 0;  // fraction of the way to the next sample
    double span_s = 0;
  };
  Place place_of(std::chrono::nanoseconds time) const;

  std::vector<Sample> samples_;
  std::vector<Screw> screws_;  // from each sample to the next
};

}  // namespace groundray
