#pragma once

#include <optional>
#include <vector>

#include "core/level_scene.h"

namespace groundray {

/// The surface that nested levels make, decided in double. Everything here is slow and certain; the
/// ray tracer asks it where Embree's answer is not enough.
class Surface {
 public:
  /// @param levels  finest first, each window inside the next.
  explicit Surface(std::vector<const LevelScene::Impl*> levels);

  /// Returns how far the ray is above the surface at t metres along it, metres; NaN over holes.
  /// Over the rim the outermost facets go on.
  double clearance_m(const GridRay& ray, double t_m) const noexcept;

  /// Returns the first crossing from above in [t_begin_m, t_end_m], decided cell by cell: along the
  /// ray the surface is linear between the sides and diagonals of cells. Crossings from below are
  /// none.
  std::optional<Crossing> first_crossing(const GridRay& ray, double t_begin_m,
                                         double t_end_m) const noexcept;

  /// Whether a ray, lowered by how far the reference may be from the surface, tells nothing of what
  /// happens on the reference within [0, t_end_m]: it begins below the surface, comes below it
  /// over a hole, or passes low over a leaf that bridges holes of the DEM.
  bool is_uncertain(const GridRay& lowered, double t_end_m) const noexcept;

 private:
  struct Place {
    const Leaf* leaf = nullptr;  // null where there is no surface
    std::uint32_t level = 0;
    int exponent = 0;  // of the leaf's cells, as they decide
    Cell cell;
  };
  Place place_at(int column, int row) const noexcept;
  void move(Place& place, int column, int row) const noexcept;
  Place start(const GridRay& ray, double t_m) const noexcept;
  /// Calls act(place, t_in, t_out) for each cell along the ray until it returns true.
  template <typename Act>
  void walk(const GridRay& ray, double t_begin_m, double t_end_m, const Act& act) const noexcept;

  std::vector<const LevelScene::Impl*> levels_;
  bool has_holes_ = false;
};

}  // namespace groundray
