#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/mesh/accuracy/area_share.h"
#include "reconstruction/mesh/accuracy/surface_parts.h"

/// Fractions of area within tolerances, from sampled distances. Not installed.
namespace groundray {

/// Distance of a surface part: at its centroid, and bounds over all its points.
struct PartDistance {
  double middle_m = 0;
  double at_least_m = 0, at_most_m = 0;
};

/// Areas within each tolerance.
struct ShareSums {
  struct Areas {
    double within = 0;  // by the distance at the centroids
    double surely_within = 0, maybe_within = 0;
  };
  std::vector<Areas> areas;
  double all = 0;
  std::uint32_t near = 0;
  bool has_bad_weight = false;  // true if any is negative or not finite

  void add(const PartDistance& distance, double area, std::span<const double> tolerances_m);
  void operator+=(const ShareSums& more);
  /// Returns the fraction of the area within each tolerance.
  /// @throws Error if the total weight is zero, or any weight is negative or not finite.
  std::vector<AreaShare> shares(double sum_rounding) const;
};

/// @throws Error naming the first that is not positive and finite, or if there is none.
void check_tolerances(std::span<const double> tolerances_m);

/// @throws Error if there are more than 12: each takes four times as long.
void check_quarterings(unsigned quarterings);

/// Returns true if, for any tolerance, the bounds leave open whether all of a part is within it.
bool is_open(const PartDistance& distance, std::span<const double> tolerances_m);

/// Adds a part's weighted area; divides the part into four, up to `quarterings` times, where its
/// bounds leave a tolerance open.
/// @param distance  returns the PartDistance of (facet, part, near), and may change near.
/// @param weight    returns the weight of (part).
template <typename Distance, typename Weight>
void add_shares(const QuadratureTriangle& facet, const SurfacePart& part,
                std::span<const double> tolerances_m, unsigned quarterings,
                const Distance& distance, const Weight& weight, ShareSums& sums) {
  const PartDistance found = distance(facet, part, sums.near);
  if (quarterings > 0 && is_open(found, tolerances_m)) {
    for (const SurfacePart& quarter : part.quarters(facet)) {
      add_shares(facet, quarter, tolerances_m, quarterings - 1, distance, weight, sums);
    }
    return;
  }
  const double counts = weight(part);
  if (!(counts >= 0) || !std::isfinite(counts)) sums.has_bad_weight = true;
  sums.add(found, counts * part.area_m2(facet), tolerances_m);
}

}  // namespace groundray
