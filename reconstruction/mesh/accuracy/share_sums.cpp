#include "reconstruction/mesh/accuracy/share_sums.h"

#include <algorithm>

#include "core/error.h"

namespace groundray {

void ShareSums::add(const PartDistance& distance, double area,
                    std::span<const double> tolerances_m) {
  all += area;
  areas.resize(tolerances_m.size());
  for (std::size_t k = 0; k < areas.size(); ++k) {
    if (distance.middle_m <= tolerances_m[k]) areas[k].within += area;
    if (distance.at_most_m <= tolerances_m[k]) areas[k].surely_within += area;
    if (distance.at_least_m <= tolerances_m[k]) areas[k].maybe_within += area;
  }
}

void ShareSums::operator+=(const ShareSums& more) {
  all += more.all;
  has_bad_weight = has_bad_weight || more.has_bad_weight;
  areas.resize(std::max(areas.size(), more.areas.size()));
  for (std::size_t k = 0; k < more.areas.size(); ++k) {
    areas[k].within += more.areas[k].within;
    areas[k].surely_within += more.areas[k].surely_within;
    areas[k].maybe_within += more.areas[k].maybe_within;
  }
}

std::vector<AreaShare> ShareSums::shares(double sum_rounding) const {
  if (has_bad_weight) {
    throw Error(
        "share within a distance: a point of the surface has a weight that is negative or not "
        "finite; it must be 0 or more");
  }
  if (!(all > 0)) {
    throw Error(
        "share within a distance: the weighted area of the surface is 0; are all weights 0, or all "
        "triangles degenerate?");
  }
  std::vector<AreaShare> shares;
  for (const Areas& area : areas) {
    shares.push_back({std::min(1.0, area.within / all),
                      std::clamp(area.surely_within / all - 2 * sum_rounding, 0.0, 1.0),
                      std::clamp(area.maybe_within / all + 2 * sum_rounding, 0.0, 1.0)});
  }
  return shares;
}

void check_tolerances(std::span<const double> tolerances_m) {
  if (tolerances_m.empty())
    throw Error("share within a distance: at least one tolerance is required");
  for (const double tolerance_m : tolerances_m) {
    if (!(tolerance_m > 0) || !std::isfinite(tolerance_m)) {
      throw Error("share within a distance: tolerance_m = {} must be positive and finite",
                  tolerance_m);
    }
  }
}

void check_quarterings(unsigned quarterings) {
  constexpr unsigned most = 12;
  if (quarterings <= most) return;
  throw Error(
      "share within a distance: quarterings = {} must be at most {}, since each quadruples the "
      "time; use a smaller step",
      quarterings, most);
}

bool is_open(const PartDistance& distance, std::span<const double> tolerances_m) {
  return std::ranges::any_of(tolerances_m, [&](double tolerance_m) {
    return distance.at_least_m <= tolerance_m && distance.at_most_m > tolerance_m;
  });
}

}  // namespace groundray
