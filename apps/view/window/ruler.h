#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <string>

#include "apps/view/rendering/view.h"
#include "apps/view/window/panels/fact_table.h"

namespace groundray {

/// Distance of two points of W, drawn as a line with its length.
class Ruler {
 public:
  /// @param view  must outlive this.
  explicit Ruler(View& view) : view_(view) {}

  /// Takes the first point, then the second; after that, the first of another distance.
  void take(const glm::dvec3& p_w_m);
  void clear();

  /// Returns the points, their distance, its horizontal and vertical parts, and the differences of
  /// their coordinates; empty without a point.
  FactTable::Facts facts() const;
  /// Returns the distances in one line, or what to do next.
  std::string text() const;

 private:
  void draw();

  View& view_;
  std::optional<glm::dvec3> from_w_m_, to_w_m_;
};

}  // namespace groundray
