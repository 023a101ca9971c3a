#pragma once

#include <array>
#include <glm/vec3.hpp>

namespace groundray {

/// The clear sky's radiance by Hosek and Wilkie, without the sun's disc. Immutable, so any number
/// of threads may use one.
/// @see Hosek and Wilkie, An analytic model for full spectral sky-dome radiance, ACM Transactions
/// on
///      Graphics 31 (2012); its coefficients for linear sRGB.
class HosekWilkie {
 public:
  /// @param turbidity  1 (pure air) to 10 (dense haze).
  /// @param ground_albedo  linear sRGB, each 0 to 1: what lies around and lights the sky from
  /// below.
  /// @param sun  unit direction to it, axes of W; above the horizon, for the model knows no
  ///        twilight.
  /// @throws Error listing what is out of bounds.
  HosekWilkie(double turbidity, const glm::dvec3& ground_albedo, const glm::dvec3& sun);

  /// Returns what comes from a unit direction, W/(m^2 sr); see docs/sky.md for the unit. Below
  /// the horizon it is what comes from the horizon.
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept;

 private:
  glm::dvec3 sun_;
  std::array<glm::dvec3, 10> coefficients_;  // A to I, the mean radiance; of each channel
};

}  // namespace groundray
