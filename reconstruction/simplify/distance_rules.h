#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "core/closest_point.h"
#include "reconstruction/simplify/shape_rules.h"
#include "reconstruction/simplify/triangle_lists.h"
#include "reconstruction/simplify/workpiece.h"

namespace groundray {

/// Keeps a surface within every vertex' tolerance of it: each that left is kept with the triangle
/// that is nearest to it, and checked against those that shall stand there instead. Samples of
/// these must be as near to the original as the vertices of its triangle there tolerate. Between
/// samples and vertices nothing is promised.
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
  bool is_near(std::uint32_t vertex, std::size_t& triangle) const;
  bool keeps_line();
  bool keeps_samples(const Star& star);
  bool is_near_original(const Star& star);
  bool is_near_original(const glm::dvec3& p_m);

  Workpiece& piece_;
  const ClosestPoint& original_;
  std::optional<double> border_m_;
  TriangleLists lists_;
  ShapeRules shape_;
  std::uint32_t near_ = 0;  // triangle of the original

  // Of the collapse that is asked about:
  FeatureLines::Merged line_;
  std::vector<std::pair<std::uint32_t, std::size_t>> placed_;  // vertices and triangles of the fan
};

}  // namespace groundray
