#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// How angles between normals, 0 to pi, are spread over an area: of samples, without bounds.
class AngleSpread {
 public:
  /// Adds the angle between two directions of any length; where one has none it is `unknown`.
  void add(const glm::dvec3& a, const glm::dvec3& b, double area_m2);
  /// Adds what another has.
  void add(const AngleSpread& more);

  double mean_rad() const noexcept;  ///< 0 if there is no area
  double rms_rad() const noexcept;
  double largest_rad() const noexcept { return largest_rad_; }
  /// Returns the least angle that so much of the area does not exceed, to 1.1 % of it or 1e-7.
  /// @throws Error if the share is not within 0 to 1.
  double percentile_rad(double share) const;

  double area_m2() const noexcept { return area_m2_; }        ///< with a normal on both sides
  double unknown_m2() const noexcept { return unknown_m2_; }  ///< without
  std::size_t samples() const noexcept { return samples_; }   ///< of both

 private:
  double area_m2_ = 0, unknown_m2_ = 0, sum_ = 0, square_ = 0, largest_rad_ = 0;
  std::size_t samples_ = 0;
  std::vector<double> bins_m2_;  // each 2^(1/64) as wide as that before
};

/// Returns the angle between two directions of any length, 0 to pi.
double angle_between(const glm::dvec3& a, const glm::dvec3& b) noexcept;

}  // namespace groundray
