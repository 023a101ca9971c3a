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

  /// How a ray that begins on the surface, or hardly above it, goes on.
  struct Rise {
    double begin_m = 0;                ///< it has met nothing up to here, or meets it here
    std::optional<Crossing> crossing;  ///< what that is
  };
  /// Follows a ray, cell by cell, until it is `above_m` above the surface: from there on floats
  /// place it on the right side.
  Rise rise(const GridRay& ray, double above_m, double t_end_m) const noexcept;

  /// Where a ray meets the reference surface, as far as this one tells: the reference is nowhere
  /// farther from a leaf than the leaf's deviation.
  struct Band {
    double near_m = std::numeric_limits<double>::infinity();  ///< no sooner than here
    double far_m = std::numeric_limits<double>::infinity();   ///< no later than here
    bool is_certain = true;  ///< false if the reference may be met anywhere, or not at all
    bool is_exact = true;    ///< no leaf that matters deviates
  };
  /// Returns that for [0, t_end_m]. Nothing is certain of a ray that begins within the deviation of
  /// the ground, comes that low over a hole, or low over a leaf that bridges holes of the DEM.
  Band band(const GridRay& ray, double t_end_m) const noexcept;

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
  // A rectangle of whole cells of the DEM.
  struct Extent {
    int column, row, width, height;
  };
  static Extent cell_extent(const Place& place) noexcept;
  Extent leaf_extent(const Place& place) const noexcept;
  // Calls act(place, t_in, t_out) for each extent_of(place) along the ray until it returns true.
  template <typename ExtentOf, typename Act>
  void walk(const GridRay& ray, double t_begin_m, double t_end_m, const ExtentOf& extent_of,
            const Act& act) const noexcept;

  std::vector<const LevelScene::Impl*> levels_;
};

}  // namespace groundray
