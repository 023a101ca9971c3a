#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "reconstruction/simplify/border_grid.h"
#include "reconstruction/simplify/triangle_lists.h"
#include "reconstruction/simplify/workpiece.h"

namespace groundray {

/// Keeps a surface that does not hang over within every vertex' tolerance of it, above and below:
/// each that left is kept with the triangle that covers it as seen from above, and checked against
/// each that shall cover it. One that is beyond the border, or was on it, is kept with the edge of
/// the border that stands for it, from which it is at most `border_m` aside.
class VerticalRules final : public CollapseRules {
 public:
  /// @param piece     whose triangles all have an area as seen from above; must outlive this.
  /// @param border_m  that borders, and those of labels, may be aside; each vertex' tolerance if it
  ///                  is not given.
  /// @param stay_covered  of each vertex, whether it stays within `rounding_m` of what covers it as
  ///                      seen from above, whatever borders may do; none if empty.
  VerticalRules(Workpiece& piece, std::optional<double> border_m,
                std::vector<bool> stay_covered = {}, double rounding_m = 0);

  bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;
  void collapse(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;

 private:
  static constexpr std::size_t nowhere = std::numeric_limits<std::size_t>::max();

  /// An edge of the fan from its tip, and the slope of the triangle that it begins.
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

  Workpiece& piece_;
  std::optional<double> border_m_;
  std::vector<bool> stay_covered_;
  double rounding_m_ = 0;
  double least_m2_ = 0;  // twice the area of a triangle, but where there are smaller ones
  TriangleLists lists_;
  BorderGrid borders_;
  std::vector<bool> is_covered_;  // of each vertex that left: a triangle is above or below

  // Of the collapse that is asked about:
  glm::dvec3 tip_m_{0};
  Fan fan_;
  bool is_open_ = false;
  std::vector<Spoke> spokes_;
  FeatureLines::Merged line_;
  std::vector<std::pair<std::uint32_t, std::size_t>> placed_;  // vertices and sectors
};

}  // namespace groundray
