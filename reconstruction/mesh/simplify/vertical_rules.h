#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "reconstruction/mesh/simplify/decimation_state.h"

namespace groundray {

/// Grid of a mesh's boundary vertices in plan view, which prevents moving boundaries from crossing
/// others.
class BorderGrid {
 public:
  explicit BorderGrid(const SurfaceMesh& mesh);

  /// Vertex and its position in plan view.
  struct Entry {
    std::uint32_t vertex = 0;
    glm::dvec2 p_m{0};
  };

  /// Returns true if a triangle with counter-clockwise corners contains, inside or on its sides, a
  /// boundary vertex other than its corners that the mesh still has.
  bool has_any(const SurfaceMesh& mesh, const std::array<Entry, 3>& corners) const;

 private:
  glm::ivec2 cell_of(const glm::dvec2& p_m) const noexcept;

  glm::dvec2 low_m_{0};
  double cell_m_ = 1;
  glm::ivec2 cells_{1, 1};
  std::vector<Entry> entries_;
  Buckets by_cell_;
};

/// Vertices collapsed into each triangle, in lists linked through their samples.
class TriangleLists {
 public:
  explicit TriangleLists(std::size_t triangles) : firsts_(triangles, none) {}

  std::uint32_t first(std::uint32_t triangle) const noexcept { return firsts_[triangle]; }
  void clear(std::uint32_t triangle) noexcept { firsts_[triangle] = none; }
  void add(std::vector<Sample>& samples, std::uint32_t triangle, std::uint32_t vertex) noexcept {
    samples[vertex].next = firsts_[triangle];
    firsts_[triangle] = vertex;
  }
  /// Moves the vertex after `prior` to the head of its list, to be tested first.
  void bring_forward(std::vector<Sample>& samples, std::uint32_t triangle,
                     std::uint32_t prior) noexcept {
    const std::uint32_t vertex = samples[prior].next;
    samples[prior].next = samples[vertex].next;
    add(samples, triangle, vertex);
  }

 private:
  std::vector<std::uint32_t> firsts_;
};

/// Keeps a surface without overhangs within each original vertex's tolerance, above and below. Each
/// collapsed vertex is stored with the triangle that covers it in plan view, and is tested against
/// each triangle that would cover it. A vertex that is beyond the boundary, or was on it, is stored
/// with the boundary edge that represents it, at most `border_m` away horizontally.
class VerticalRules final : public CollapseRules {
 public:
  using MayJoin = std::function<bool(std::uint32_t, std::uint32_t)>;

  /// @param piece     all of its triangles have an area in plan view; must outlive this.
  /// @param border_m  permitted horizontal displacement of boundaries, including those between
  ///                  labels; each vertex's tolerance if it is not given.
  /// @param stay_covered  of each vertex: true if boundaries may withdraw from it by at most
  ///                      `rounding_m`, regardless of `border_m`; false for all if empty.
  /// @param may_join  returns whether an edge may join two vertices; any if empty.
  VerticalRules(DecimationState& piece, std::optional<double> border_m,
                std::vector<bool> stay_covered = {}, double rounding_m = 0, MayJoin may_join = {});

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
  bool may_have_edges(const Star& star, std::size_t to) const;

  DecimationState& piece_;
  std::optional<double> border_m_;
  std::vector<bool> stay_covered_;
  double rounding_m_ = 0;
  MayJoin may_join_;
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
