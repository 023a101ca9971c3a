#pragma once

// Private to the library: the surfaces, one above the other, that the points of a cell lie on.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/dem/packed_point.h"

namespace groundray {

/// Points that lie on one surface: consecutive ones of a cell's points, which ascend.
struct CellSurface {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
  std::uint32_t size() const noexcept { return end - begin; }
};

/// How many points of a cell could be outliers.
class OutlierRule {
 public:
  /// @param share  of all points that are, 0 to 1/2.
  explicit OutlierRule(double share);

  /// Returns the least number of a cell's points that are outliers in 1 % of cells at most: 2 or
  /// more, but 1 for the only point, or if there are no outliers.
  std::uint32_t credible(std::uint32_t points) const noexcept;
  bool none() const noexcept { return share_ == 0; }
  double share() const noexcept { return share_; }

 private:
  double share_;
  std::vector<std::uint32_t> small_;  // for cells of few points
};

/// Finds where heights leave a gap wider than gap_m and three standard deviations of the difference
/// of the two next to it.
void find_surfaces(std::span<const PackedPoint> ascending, double gap_m,
                   std::vector<CellSurface>& surfaces);

/// Returns the standard deviation of a point's height, with what its group has in common.
float total_sd_m(const PackedPoint& point) noexcept;

/// Returns the points of a surface that ground may be among: those no more than tallest_m and six
/// standard deviations above the first that is too high up the list to be an outlier. All, if there
/// are no others: then the surface is no wall or trunk.
CellSurface lower_part(std::span<const PackedPoint> ascending, const CellSurface& surface,
                       std::uint32_t credible, double tallest_m) noexcept;

}  // namespace groundray
