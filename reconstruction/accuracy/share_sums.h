#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/accuracy/area_share.h"
#include "reconstruction/accuracy/surface_parts.h"

/// Areas within tolerances, for those who have a distance. Not installed.
namespace groundray {

/// How far a part is: amid it, and any point of it.
struct PartDistance {
  double middle_m = 0;
  double at_least_m = 0, at_most_m = 0;
};

/// Areas, each of one tolerance.
struct ShareSums {
  struct Areas {
    double within = 0;  // by the samples
    double surely_within = 0, maybe_within = 0;
  };
  std::vector<Areas> areas;
  double all = 0;
  std::uint32_t near = 0;
  bool has_bad_weight = false;  // negative or not finite

  void add(const PartDistance& distance, double area, std::span<const double> tolerances_m);
  void operator+=(const ShareSums& more);
  /// @throws Error if nothing has weight, or any is negative or not finite.
  std::vector<AreaShare> shares(double sum_rounding) const;
};

/// @throws Error naming each that is not a positive number, or that there is none.
void check_tolerances(std::span<const double> tolerances_m);

/// @throws Error if there are more than 12: each takes four times as long.
void check_quarterings(unsigned quarterings);

/// Returns whether it is open for any tolerance if all of a part is within.
bool is_open(const PartDistance& distance, std::span<const double> tolerances_m);

/// Adds what a part weighs, cut into four where that is open for any tolerance.
/// @param distance  returns the PartDistance of (facet, part, near), and may change near.
/// @param weight    of (part).
template <typename Distance, typename Weight>
void add_shares(const Facet& facet, const SurfacePart& part, std::span<const double> tolerances_m,
                unsigned quarterings, const Distance& distance, const Weight& weight,
                ShareSums& sums) {
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
