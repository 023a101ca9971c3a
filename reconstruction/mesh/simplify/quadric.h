#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace groundray {

/// Weighted sum of squared distances from planes, as a polynomial of position.
/// @see Garland, Heckbert, Surface simplification using quadric error metrics, SIGGRAPH (1997).
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // second-order coefficients
  double x = 0, y = 0, z = 0;                             // half of the first-order coefficients
  double one = 0;                                         // value at the origin

  /// Adds the weighted square of the distance from a plane through the origin.
  /// @param normal  of unit length.
  void add_plane(const glm::dvec3& normal, double weight) noexcept {
    const glm::dvec3 n = weight * normal;
    xx += n.x * normal.x, xy += n.x * normal.y, xz += n.x * normal.z;
    yy += n.y * normal.y, yz += n.y * normal.z, zz += n.z * normal.z;
  }

  Quadric& operator+=(const Quadric& other) noexcept {
    xx += other.xx, xy += other.xy, xz += other.xz;
    yy += other.yy, yz += other.yz, zz += other.zz;
    x += other.x, y += other.y, z += other.z, one += other.one;
    return *this;
  }

  /// Returns the sum of the weights.
  double weight() const noexcept { return xx + yy + zz; }

  /// Returns the sum at a position; rounding may make it slightly negative.
  double at(const glm::dvec3& p) const noexcept {
    return p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z + x)) +
           p.y * (yy * p.y + 2 * (yz * p.z + y)) + p.z * (zz * p.z + 2 * z) + one;
  }

  /// Returns the same sum for positions relative to `origin`.
  Quadric seen_from(const glm::dvec3& origin) const noexcept {
    Quadric moved = *this;
    moved.x += xx * origin.x + xy * origin.y + xz * origin.z;
    moved.y += xy * origin.x + yy * origin.y + yz * origin.z;
    moved.z += xz * origin.x + yz * origin.y + zz * origin.z;
    moved.one = at(origin);
    return moved;
  }
};

}  // namespace groundray
