#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

namespace groundray {

/// Position of a direction on a LatLongGrid: between four pixel centres, in rows `top` and `bottom`
/// and columns `left` and `right`.
struct LatLongPlace {
  int patch_row = 0;  ///< 0 to height: patch r lies between the centres of rows r - 1 and r
  int top = 0, bottom = 0, left = 0, right = 0;
  double across = 0;  ///< from the left centres (0) to the right ones (1), in azimuth
  double down = 0;    ///< from the upper centres (0) to the lower ones (1), in polar angle
  double sink = 0;  ///< the same in the cosine of the polar angle: equal steps, equal solid angles
};

/// Geometry of an equirectangular image of all directions. Row 0 touches the zenith, the last row
/// the nadir; columns run clockwise seen from above, as azimuth does, and wrap. Values belong to
/// pixel centres. Between centres they are bilinear in azimuth and polar angle, and from the first
/// and last rows of centres to the poles they are constant in polar angle. Azimuth is clockwise
/// from north: east is pi / 2.
class LatLongGrid {
 public:
  /// @param center_azimuth_rad  azimuth of the middle of the image.
  /// @throws Error unless width and height are positive and the azimuth is finite.
  LatLongGrid(int width, int height, double center_azimuth_rad);

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }

  /// Returns the position of a unit direction (axes of W: east, north, up).
  LatLongPlace place(const glm::dvec3& direction) const noexcept;

  /// Returns the unit direction at a position in patch (column, patch_row), the inverse of `place`.
  /// @param column  column of the left centres.
  /// @param fraction  `across` and `sink`, in [0, 1].
  glm::dvec3 direction(int column, int patch_row, const glm::dvec2& fraction) const noexcept;

  /// Returns the exact solid angle of one patch in a row of patches, sr.
  double patch_solid_angle_sr(int patch_row) const noexcept {
    return column_rad_ * patch_rows_[static_cast<std::size_t>(patch_row)].depth;
  }
  /// Returns the exact solid angle of one pixel in a row of pixels, sr.
  double pixel_solid_angle_sr(int row) const noexcept;

  /// Returns the polar angles at which a row of patches begins and ends, rad.
  glm::dvec2 patch_bounds_rad(int patch_row) const noexcept {
    const PatchRow& row = patch_rows_[static_cast<std::size_t>(patch_row)];
    return {row.begin_rad, row.end_rad};
  }

 private:
  int width_;
  int height_;
  double center_azimuth_rad_;
  double column_rad_;
  struct PatchRow {
    double begin_rad, end_rad;
    double from_zenith, from_nadir;  // heights of the spherical caps above and below it
    double depth;                    // height of the row; the three add up to 2
  };
  std::vector<PatchRow> patch_rows_;
};

/// Direction drawn at random.
struct DirectionSample {
  glm::dvec3 direction{0, 0, 1};  ///< unit, axes of W
  double pdf_per_sr = 0;          ///< density of the draw; 0 if nothing could be drawn
};

/// Sampler of directions, approximately in proportion to weights at the pixel centres of a
/// LatLongGrid. The probability of a patch between four centres is proportional to the mean of
/// their weights times its exact solid angle; within the patch the density is bilinear in azimuth
/// and height. The density therefore vanishes only where the grid's own interpolation does, and it
/// differs from that by at most a factor of 2, next to the poles. Immutable and therefore
/// thread-safe.
class DirectionSampler {
 public:
  /// @param weights  weights of the pixel centres, row by row; finite and >= 0.
  /// @throws Error unless there is one weight per pixel and their sum is finite and positive.
  DirectionSampler(const LatLongGrid& grid, std::vector<float> weights);

  /// Draws a direction. @param uniform  two independent numbers in [0, 1).
  DirectionSample sample(const glm::dvec2& uniform) const noexcept;

  /// Returns the density, 1/sr, with which `sample` draws a unit direction.
  double pdf_per_sr(const glm::dvec3& direction) const noexcept;

  const LatLongGrid& grid() const noexcept { return grid_; }

 private:
  struct Corners {
    double top_left, top_right, bottom_left, bottom_right;
  };
  Corners corners(int top, int bottom, int left, int right) const noexcept;
  double density(const Corners& corners, int column, int patch_row, double across,
                 double sink) const noexcept;

  LatLongGrid grid_;
  std::vector<float> weights_;
  std::vector<double> rows_;     // cumulative weight of the rows of patches, from 0
  std::vector<double> columns_;  // the same within each row of patches; width + 1 entries
};

}  // namespace groundray
