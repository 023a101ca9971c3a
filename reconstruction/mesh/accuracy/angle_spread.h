#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// Area-weighted distribution of angles between normals, 0 to pi, from samples; without bounds.
class AngleSpread {
 public:
  /// Adds the angle between two directions of any length. If one has no direction, the area counts
  /// as unknown.
  void add(const glm::dvec3& a, const glm::dvec3& b, double area_m2);
  /// Adds all angles of another distribution.
  void add(const AngleSpread& more);

  double mean_rad() const noexcept;  ///< 0 if there is no area
  double rms_rad() const noexcept;
  double largest_rad() const noexcept { return largest_rad_; }
  /// Returns the smallest angle, rad, that is not exceeded on the fraction `share` of the area;
  /// accurate to 1.1 % or 1e-7 rad.
  /// @throws Error if `share` is not within 0 to 1.
  double percentile_rad(double share) const;

  double area_m2() const noexcept { return area_m2_; }        ///< area with normals on both sides
  double unknown_m2() const noexcept { return unknown_m2_; }  ///< area without
  std::size_t samples() const noexcept { return samples_; }   ///< with and without normals

 private:
  double area_m2_ = 0, unknown_m2_ = 0, sum_ = 0, square_ = 0, largest_rad_ = 0;
  std::size_t samples_ = 0;
  std::vector<double> bins_m2_;  // each 2^(1/64) times as wide as the one before
};

/// Returns the angle between two directions of any length, 0 to pi rad.
double angle_between(const glm::dvec3& a, const glm::dvec3& b) noexcept;

}  // namespace groundray
