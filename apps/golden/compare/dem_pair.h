#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <vector>

#include "apps/golden/compare/scope.h"
#include "core/geometry/cell.h"
#include "core/geometry/grid_frame.h"
#include "core/image/image.h"
#include "terrain/dem/dem_io.h"

namespace groundray::golden {

/// Heights at the reference's samples, m; NaN in holes.
struct Heights {
  Image<double> m;

  double operator()(int column, int row) const { return m.at(column, row)[0]; }
  Cell cell(int x, int y) const {
    const Heights& z = *this;
    return {x, y, 1, 1, z(x, y), z(x + 1, y), z(x, y + 1), z(x + 1, y + 1)};
  }
};

/// Heights of both DEMs at the reference's samples. A sample is left out if it is outside the
/// scope's box, in which it has the reference's height, or the other's in a hole of the reference;
/// or if the heights differ by more than the scope permits.
struct DemPair {
  GridFrame frame;
  Heights reference, other;
  std::size_t beyond = 0;           // samples of the scope's box outside the other's extent
  std::size_t interpolated = 0;     // samples that lie between samples of the other
  std::size_t outside = 0;          // samples outside the scope's box
  std::size_t ignored = 0;          // samples of the box where the heights differ too much
  std::vector<bool> is_left_out{};  // of each sample

  /// Returns true if a sample is not left out; likewise for a cell and its four samples.
  bool has(int column, int row) const {
    return !is_left_out[static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.samples.x) +
                        static_cast<std::size_t>(column)];
  }
  bool has_cell(int column, int row) const {
    return has(column, row) && has(column + 1, row) && has(column, row + 1) &&
           has(column + 1, row + 1);
  }
  glm::ivec2 samples() const { return frame.samples; }
};

/// Returns the heights of both at the reference's samples, in the reference's D: the other's are
/// interpolated on its surface of two triangles per cell, unless one of its own samples lies within
/// 1e-6 of a cell.
DemPair paired(const Dem& reference, const Dem& other, const Scope& scope);

}  // namespace groundray::golden
