#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/closest_point.h"
#include "reconstruction/accuracy/cover_bound.h"
#include "reconstruction/simplify/near_surface.h"
#include "reconstruction/simplify/shape_rules.h"
#include "reconstruction/simplify/stand_ins.h"
#include "reconstruction/simplify/workpiece.h"

namespace groundray {

/// Keeps a surface within tolerance of the original, and this of the surface, at every point: each
/// triangle is proved before it comes to be. What cannot be proved by a few parts does not.
class DistanceRules final : public CollapseRules {
 public:
  /// @param piece     must outlive this.
  /// @param original  the mesh that the piece was, its vertices and triangles in the same order;
  ///                  must outlive this.
  /// @param border_m  that borders, and those of labels, may be aside; each vertex' tolerance if it
  ///                  is not given.
  DistanceRules(Workpiece& piece, const ClosestPoint& original, std::optional<double> border_m);

  bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;
  void collapse(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;

 private:
  void set_fan(const Star& star, std::size_t to);
  bool keeps_line();
  bool is_near_original(const Star& star);

  Workpiece& piece_;
  const ClosestPoint& original_;
  std::optional<double> border_m_;
  ShapeRules shape_;
  StandIns stand_ins_;
  CoverBound cover_;
  NearSurface near_original_;

  // Of the collapse that is asked about:
  std::vector<PlacedTriangle> fan_;
  FeatureLines::Merged line_;
};

}  // namespace groundray
