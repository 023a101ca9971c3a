#pragma once

#include <cstdint>

#include "core/geometry/grid_frame.h"

namespace groundray {

/// One of the two triangles of a cell.
enum class Half : std::uint8_t {
  Near,  ///< adjacent to the cell's first row
  Far,   ///< adjacent to the cell's last row
};

/// A cell of the surface: two triangles over a rectangle of whole cells of the DEM. Missing heights
/// are NaN; a triangle with a missing corner does not exist. North denotes row 0, west column 0.
struct Cell {
  /// Diagonal along which the cell is split.
  enum class Split : std::uint8_t {
    NorthEastToSouthWest,  ///< as every cell of the DEM
    NorthWestToSouthEast,  ///< only on sides that face a coarser leaf
  };

  int column = 0, row = 0;                ///< its first sample, in the DEM
  int width = 1, height = 1;              ///< in cells of the DEM
  double nw = 0, ne = 0, sw = 0, se = 0;  ///< heights of the corners, metres
  Split split = Split::NorthEastToSouthWest;

  /// Returns the triangle that contains grid coordinates (u, v).
  Half half_at(double u, double v) const noexcept {
    const double across = (u - column) / width;
    const double down = (v - row) / height;
    const bool is_far = split == Split::NorthEastToSouthWest ? across + down > 1 : down > across;
    return is_far ? Half::Far : Half::Near;
  }

  /// Returns the plane of a triangle; NaN if it does not exist.
  FacetPlane plane(Half half) const noexcept {
    const bool is_near = half == Half::Near;
    const double u_slope_m = (is_near ? ne - nw : se - sw) / width;
    double v_slope_m, corner_m;
    if (split == Split::NorthEastToSouthWest) {
      v_slope_m = (is_near ? sw - nw : se - ne) / height;
      corner_m = is_near ? nw : ne + sw - se;
    } else {
      v_slope_m = (is_near ? se - ne : sw - nw) / height;
      corner_m = nw;
    }
    return {corner_m - (u_slope_m * column + v_slope_m * row), u_slope_m, v_slope_m};
  }
};

}  // namespace groundray
