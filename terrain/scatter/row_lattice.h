#pragma once

#include <glm/vec2.hpp>

#include "terrain/dem/density_map.h"

namespace groundray {

/// Rows of sites for plants, as in vineyards and plantations.
struct Rows {
  double between_m = 1;    ///< from one row to the next
  double within_m = 1;     ///< from one site of a row to the next
  double azimuth_deg = 0;  ///< direction of the rows, clockwise from D's y axis (north)
  double jitter_m = 0;     ///< sites are moved by up to this along each axis of D, at random
};

/// Lattice of the sites of rows, fixed in W. A site's index is its place in the row and the row's
/// number, counted from W's origin.
class RowLattice {
 public:
  /// @param origin_w_m  D's origin in W.
  RowLattice(const Rows& rows, glm::dvec2 origin_w_m);

  /// Returns a site's position in D, before it is moved.
  glm::dvec2 site(glm::ivec2 index) const noexcept;

  /// Indices of sites; `end` is not one of them.
  struct Range {
    glm::ivec2 first{0}, end{0};
  };
  /// Returns the indices among which are all sites that may be moved into `area`.
  /// @throws Error if they have more than 28 bits.
  Range sites_of(const Area& area) const;

 private:
  glm::dvec2 to_lattice(glm::dvec2 p) const noexcept;

  glm::dvec2 spacing_m_;  // within a row, between rows
  glm::dvec2 along_, across_;
  glm::dvec2 origin_site_, origin_m_;  // of D: index of a site, and distance from it
  double jitter_m_;
};

}  // namespace groundray
