#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/tracing/closest_point.h"
#include "reconstruction/mesh/accuracy/cover_bound.h"
#include "reconstruction/mesh/simplify/bounds/near_surface.h"
#include "reconstruction/mesh/simplify/bounds/shape_rules.h"
#include "reconstruction/mesh/simplify/decimation_state.h"
#include "reconstruction/mesh/simplify/face_correspondence.h"

namespace groundray {

/// Keeps every point of a surface within tolerance of the original, and every point of the original
/// within tolerance of the surface. Each triangle is proved before it is created; a collapse is
/// rejected if a few parts do not suffice for the proof.
class DistanceRules final : public CollapseRules {
 public:
  /// @param piece     must outlive this.
  /// @param original  initial mesh of the piece, with vertices and triangles in the same order;
  ///                  must outlive this.
  /// @param border_m  permitted displacement of boundaries, including those between labels; each
  ///                  vertex's tolerance if it is not given.
  DistanceRules(DecimationState& piece, const ClosestPoint& original,
                std::optional<double> border_m);

  bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;
  void collapse(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;

 private:
  void set_fan(const Star& star, std::size_t to);
  bool keeps_line();
  bool is_near_original(const Star& star);

  DecimationState& piece_;
  const ClosestPoint& original_;
  std::optional<double> border_m_;
  ShapeRules shape_;
  FaceCorrespondence stand_ins_;
  CoverBound cover_;
  NearSurface near_original_;

  // For the collapse being tested:
  std::vector<PlacedTriangle> fan_;
  FeatureLines::Merged line_;
};

}  // namespace groundray
