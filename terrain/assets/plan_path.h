#pragma once

#include <chrono>
#include <cstddef>
#include <glm/vec2.hpp>
#include <vector>

#include "core/geometry/trajectory.h"

namespace groundray {

/// Returns the unit vector of a heading.
glm::dvec2 heading_of(double yaw_rad);

/// Returns a vector whose components along and left of a heading are given.
glm::dvec2 along_heading(double yaw_rad, double ahead, double left);

/// Path in plan by distance; straight before its beginning and beyond its end.
class PlanPath {
 public:
  struct Point {
    glm::dvec2 p;
    double yaw_rad;
  };

  explicit PlanPath(const Trajectory& X_DO);

  double length_m() const { return length_m_; }
  double distance_m(std::chrono::nanoseconds time) const;
  Point at(double s_m) const;

 private:
  std::vector<std::chrono::nanoseconds> times_;
  std::vector<double> along_m_;
  std::vector<Point> points_;
  double length_m_ = 0;
};

/// Strides walked by distance, where the length of a stride varies along the path.
class StrideCount {
 public:
  /// @param strides_m  lengths of a stride, at distances that begin with 0 and are `spacing_m`
  /// apart.
  /// @param begin  strides at the distance 0.
  StrideCount(std::vector<double> strides_m, double spacing_m, double begin);

  double at(double s_m) const;
  double stride_m(double s_m) const;
  /// Returns the distance at which `count` strides have been walked: the inverse of at.
  double distance_m(double count) const;

 private:
  std::size_t before(double s_m) const;

  std::vector<double> strides_m_, counts_;
  double spacing_m_ = 1;
};

}  // namespace groundray
