#pragma once

// Private to the library: the surfaces, one above the other, that the points of a cell lie on.
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/dem/fusion/packed_point.h"

namespace groundray {

/// Points of one surface: a range of the points of a cell, which ascend by height.
struct CellSurface {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
  std::uint32_t size() const noexcept { return end - begin; }
};

/// Limit for the number of outliers in a cell.
class OutlierRule {
 public:
  /// @param share  fraction of outliers among all points, 0 to 1/2.
  explicit OutlierRule(double share);

  /// Returns the smallest k such that at most 1 % of cells with `points` points contain k or more
  /// outliers: at least 2, but 1 for a single point or if there are no outliers.
  std::uint32_t credible(std::uint32_t points) const noexcept;
  bool none() const noexcept { return share_ == 0; }
  double share() const noexcept { return share_; }

 private:
  double share_;
  std::vector<std::uint32_t> small_;  // for cells of few points
};

/// Splits points into surfaces at gaps in height wider than gap_m plus three standard deviations of
/// the difference of the two adjacent points.
void find_surfaces(std::span<const PackedPoint> ascending, double gap_m,
                   std::vector<CellSurface>& surfaces);

/// Returns the standard deviation of a point's height, including the bias of its group, m.
float total_sd_m(const PackedPoint& point) noexcept;

/// Returns the points of a surface that may belong to the ground: those up to tallest_m plus six
/// standard deviations above the first point that is too far up the list to be an outlier. Returns
/// the whole surface if it is no taller: it is then no wall or trunk.
CellSurface lower_part(std::span<const PackedPoint> ascending, const CellSurface& surface,
                       std::uint32_t credible, double tallest_m) noexcept;

}  // namespace groundray
