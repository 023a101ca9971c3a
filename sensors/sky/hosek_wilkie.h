#pragma once

#include <array>
#include <glm/vec3.hpp>

namespace groundray {

/// Radiance of the clear sky by Hosek and Wilkie, without the sun's disc. Immutable and therefore
/// thread-safe.
/// @see Hosek and Wilkie, An analytic model for full spectral sky-dome radiance, ACM Transactions
///      on Graphics 31 (2012); its coefficients for linear sRGB.
class HosekWilkie {
 public:
  /// @param turbidity  1 (pure air) to 10 (dense haze).
  /// @param ground_albedo  linear sRGB, each 0 to 1: albedo of the surroundings, which light the
  ///        sky from below.
  /// @param sun  unit direction to the sun, axes of W; not below the horizon, because the model has
  ///        no twilight.
  /// @throws Error listing all arguments that are out of bounds.
  HosekWilkie(double turbidity, const glm::dvec3& ground_albedo, const glm::dvec3& sun);

  /// Returns the radiance from a unit direction, W/(m^2 sr); see docs/theory/sky.md for the unit. A
  /// direction below the horizon has the zenith angle of the horizon.
  glm::dvec3 radiance(const glm::dvec3& direction) const noexcept;

 private:
  glm::dvec3 sun_;
  std::array<glm::dvec3, 10> coefficients_;  // A to I and the mean radiance, by channel
};

}  // namespace groundray
