#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "core/error.h"

namespace groundray {

/// Centripetal Catmull-Rom curve through waypoints, parametrised by arc length. It starts and ends
/// in the direction of its first and last chord.
/// @see Yuksel, Schaefer, Keyser, Parameterization and applications of Catmull-Rom curves (2011):
///      the centripetal curve has no cusps or loops between waypoints.
class SmoothCurve {
 public:
  /// Point of the curve.
  struct Point {
    glm::dvec2 p_m{0};
    glm::dvec2 along{1, 0};  ///< tangent, not normalised
  };

  /// Records waypoints that no curve can pass: fewer than two, points that are not finite or closer
  /// than 1 cm to the previous one, and points at which the curve would turn back on itself. Also
  /// records paths longer than 1000 km.
  static void check(std::span<const glm::dvec2> waypoints_m, Violations& broken);

  /// @param waypoints_m  in order; valid, as defined by `check`.
  explicit SmoothCurve(std::span<const glm::dvec2> waypoints_m);

  double length_m() const noexcept { return length_m_; }

  /// Returns the point at an arc length from the start, from 0 to length_m(); beyond the ends, the
  /// nearest end.
  Point at(double s_m) const noexcept;

 private:
  // p(t) = c0 + c1 t + c2 t^2 + c3 t^3 for t in [0, 1].
  struct Cubic {
    std::array<glm::dvec2, 4> c;

    glm::dvec2 at(double t) const { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); }
    glm::dvec2 velocity(double t) const { return c[1] + t * (2.0 * c[2] + t * (3.0 * c[3])); }
    double length_m(double t_begin, double t_end) const;
  };
  struct Piece {
    Cubic cubic;
    double t;        // parameter of its start on the segment
    double start_m;  // arc length of its start on the curve
  };
  static Cubic catmull_rom(const std::array<glm::dvec2, 4>& p);

  std::vector<Piece> pieces_;
  double length_m_ = 0;
};

}  // namespace groundray
