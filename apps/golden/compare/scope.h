#pragma once

#include <cmath>
#include <glm/vec3.hpp>
#include <limits>
#include <string>

#include "apps/golden/report.h"

namespace groundray::golden {

/// Part of two surfaces that is compared; by default all of them.
struct Scope {
  static constexpr double unbounded = std::numeric_limits<double>::infinity();

  /// Corners of a closed box, m: in W, or in the reference's frame if its place in W is unknown.
  glm::dvec3 low_m{-unbounded}, high_m{unbounded};
  /// Points farther than this from the other surface are left out.
  double ignore_beyond_m = unbounded;

  bool has_box() const {
    return low_m != glm::dvec3(-unbounded) || high_m != glm::dvec3(unbounded);
  }
  bool ignores() const { return std::isfinite(ignore_beyond_m); }
  /// Returns true if a point is in the box; a NaN height counts as within its heights.
  bool contains(const glm::dvec3& p) const {
    return low_m.x <= p.x && p.x <= high_m.x && low_m.y <= p.y && p.y <= high_m.y &&
           !(p.z < low_m.z) && !(p.z > high_m.z);
  }
};

/// @throws Error if a side of the box is empty or NaN, or `ignore_beyond_m` is not positive.
void check_scope(const Scope& scope);

/// Returns a sentence about the box and the limit of distance; empty if all is compared.
std::string scope_text(const Scope& scope, const std::string& frame);

/// Reports what the limit of distance leaves out: its size and its share of what is in the box.
/// @param whose  "reference" or "other"; empty if it is of both.
void tell_ignored(Section& into, const std::string& whose, double part, double whole,
                  const std::string& unit, const Scope& scope);

}  // namespace groundray::golden
