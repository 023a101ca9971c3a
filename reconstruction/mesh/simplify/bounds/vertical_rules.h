#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "reconstruction/mesh/simplify/bounds/border_grid.h"
#include "reconstruction/mesh/simplify/bounds/triangle_lists.h"
#include "reconstruction/mesh/simplify/decimation_state.h"

namespace groundray {

/// Keeps a surface without overhangs within each original vertex's tolerance, above and below. Each
/// collapsed vertex is stored with the triangle that covers it in plan view, and is tested against
/// each triangle that would cover it. A vertex that is beyond the boundary, or was on it, is stored
/// with the boundary edge that represents it, at most `border_m` away horizontally.
class VerticalRules final : public CollapseRules {
 public:
  /// @param piece     all of its triangles have an area in plan view; must outlive this.
  /// @param border_m  permitted horizontal displacement of boundaries, including those between
  ///                  labels; each vertex's tolerance if it is not given.
  /// @param stay_covered  of each vertex: true if boundaries may withdraw from it by at most
  ///                      `rounding_m`, regardless of `border_m`; false for all if empty.
  VerticalRules(DecimationState& piece, std::optional<double> border_m,
                std::vector<bool> stay_covered = {}, double rounding_m = 0);

  bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;
  void collapse(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;

 private:
  static constexpr std::size_t nowhere = std::numeric_limits<std::size_t>::max();

  /// Edge of the fan from its tip, and the slope of the triangle that begins with it.
  struct Spoke {
    double x = 0, y = 0, z = 0;
    double slope_x = 0, slope_y = 0;
  };

  double twice_plan_area_m2(std::uint32_t triangle) const noexcept;
  bool set_fan(const Star& star, std::size_t to);
  bool is_narrow(double twice_m2, std::size_t i) const noexcept;
  double smallest_of(const Star& star) const noexcept;
  std::size_t sector_of(double x, double y) const noexcept;
  std::size_t nearest_sector(double x, double y) const noexcept;
  bool is_near(std::uint32_t vertex, std::size_t& sector) const noexcept;
  bool is_near_border(std::uint32_t vertex) const noexcept;
  double most_aside_m(std::uint32_t vertex) const noexcept;
  bool keeps_line() const;
  bool keeps_border(const Star& star, std::size_t to);
  bool keeps_samples(const Star& star);

  DecimationState& piece_;
  std::optional<double> border_m_;
  std::vector<bool> stay_covered_;
  double rounding_m_ = 0;
  double least_m2_ = 0;  // twice the smallest permitted area, unless there are smaller triangles
  TriangleLists lists_;
  BorderGrid borders_;
  std::vector<bool> is_covered_;  // of each collapsed vertex: a triangle is above or below

  // For the collapse being tested:
  glm::dvec3 tip_m_{0};
  Fan fan_;
  bool is_open_ = false;
  std::vector<Spoke> spokes_;
  FeatureLines::Merged line_;
  std::vector<std::pair<std::uint32_t, std::size_t>> placed_;  // vertices and sectors
};

}  // namespace groundray
