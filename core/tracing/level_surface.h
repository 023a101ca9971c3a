#pragma once

#include <optional>
#include <vector>

#include "core/tracing/level_scene.h"

namespace groundray {

/// Surface that nested levels form, evaluated in double. It is slow but reliable; the ray tracer
/// uses it where Embree's answer does not suffice.
class LevelSurface {
 public:
  /// @param levels  finest first, each window inside the next.
  explicit LevelSurface(std::vector<const LevelScene::Impl*> levels);

  const GroundExtent& extent() const noexcept { return extent_; }

  /// Returns the height of the ray above the surface at t metres along it, metres; NaN over holes.
  /// Beyond the boundary, the outermost facets are continued.
  double clearance_m(const GridRay& ray, double t_m) const noexcept;

  /// Facet of an ordinary cell: a whole one, away from thinned sides.
  struct PlainFacet {
    const LevelScene::Impl* level = nullptr;  ///< null if there is none
    Facet facet;
  };
  /// Returns the facet over a point in grid coordinates if it belongs to an ordinary cell.
  PlainFacet plain_facet_at(double u, double v) const noexcept;

  /// Returns the first crossing from above on the cells that the ray passes in [t_begin_m,
  /// t_end_m].
  std::optional<Crossing> first_crossing(const FacetRay& ray, double t_begin_m,
                                         double t_end_m) const noexcept;

  /// Cells that decide on hits on a leaf, and the index of their level.
  struct DecidingCells {
    std::uint32_t level = 0;
    LeafCells cells;
  };
  DecidingCells deciding_cells(const Leaf& leaf) const noexcept;

  /// Continuation of a ray that begins on the surface or slightly above it.
  struct Escape {
    double begin_m = 0;  ///< no hit before this range; the range of `crossing`, if any
    std::optional<Crossing> crossing;  ///< the hit at begin_m, if any
  };
  /// Follows a ray, cell by cell, until it is `above_m` above the surface: from there on, rounding
  /// to float keeps it on the correct side.
  Escape escape_surface(const FacetRay& ray, double above_m) const noexcept;

  /// Bounds of the range at which a ray hits the reference surface, which is nowhere farther from a
  /// leaf than the leaf's deviation.
  struct ErrorBand {
    double near_m = std::numeric_limits<double>::infinity();  ///< lower bound
    double far_m = std::numeric_limits<double>::infinity();   ///< upper bound
    bool is_certain = true;  ///< false if the reference may be hit anywhere, or not at all
  };
  /// Returns the band for [0, t_end_m]. It is not certain if the ray begins within the deviation of
  /// the ground, comes that low over a hole, or is low over a leaf that bridges holes of the DEM.
  ErrorBand error_band(const GridRay& ray, double t_end_m) const noexcept;

 private:
  struct Place {
    const Leaf* leaf = nullptr;  // null where there is no surface
    std::uint32_t level = 0;
    int exponent = 0;  // cells of 2^exponent cells of the DEM decide in the leaf
    Cell cell;
  };
  std::uint32_t level_at(int column, int row) const noexcept;
  Place place_at(int column, int row) const noexcept;
  void move(Place& place, int column, int row) const noexcept;
  Place start(const GridRay& ray, double t_m) const noexcept;
  // Rectangle of whole cells of the DEM.
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
  GroundExtent extent_;
};

/// Double-precision data of a packet in exact tracing, by lane: read and written by callbacks.
struct ExactQuery {
  QueryContext context;  ///< first, so that Embree's pointer to it is a pointer to this
  const LevelSurface* surface;
  const LevelRay* rays;
  Crossing* crossings;
};

}  // namespace groundray
