#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <vector>

#include "reconstruction/mesh/scan/organised_scan.h"

namespace groundray::testing {

/// Range in a room with four different walls, so that no two beams hit the same point.
inline double room(const glm::dvec3& towards) {
  double r = std::numeric_limits<double>::infinity();
  for (const glm::dvec4& wall : {glm::dvec4(1, 0.1, 0, 6), glm::dvec4(-1, 0, 0.05, 9),
                                 glm::dvec4(0, 1, 0, 7), glm::dvec4(0.1, -1, 0, 5)}) {
    const double along = glm::dot(glm::dvec3(wall), towards);
    if (along > 0) r = std::min(r, wall.w / along);
  }
  return r;
}

inline ScanReturns without_columns(ScanReturns returns) {
  returns.columns.clear();
  return returns;
}

/// Returns the cell (column, row) of each row of the table; {-1, -1} if it has none.
inline std::vector<glm::ivec2> cells_of(const OrganisedScan& scan, std::size_t rows) {
  std::vector<glm::ivec2> cells(rows, {-1, -1});
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    if (scan.returns[i] == OrganisedScan::none) continue;
    const auto columns = static_cast<std::size_t>(scan.columns);
    cells[scan.returns[i]] = {static_cast<int>(i % columns), static_cast<int>(i / columns)};
  }
  return cells;
}

/// Checks that all returns lie as they were fired: row by ring, column by firing up to a common
/// cyclic shift.
inline void expect_lattice(const OrganisedScan& scan, const ScanReturns& fired, int turn) {
  const auto cells = cells_of(scan, fired.p_S.size());
  int shift = -1;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!std::isfinite(fired.p_S[i].x)) continue;
    ASSERT_NE(cells[i].x, -1) << "row " << i;
    EXPECT_EQ(cells[i].y, fired.rings[i]);
    const int off = ((cells[i].x - fired.columns[i]) % turn + turn) % turn;
    if (shift < 0) shift = off;
    ASSERT_EQ(off, shift) << "row " << i;
  }
}

}  // namespace groundray::testing
