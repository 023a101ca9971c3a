#include "apps/golden/compare/scans/scan_pictures.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/common.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "apps/golden/compare/error_figures.h"
#include "apps/golden/compare/error_map.h"
#include "core/math.h"

namespace groundray::golden {
namespace {

/// Returns the place of a return of a scan in a picture.
using PlaceOf = std::function<glm::dvec2(const Scan& scan, std::uint32_t i)>;

/// Returns the places of all returns that are paired, missing or extra.
std::vector<glm::dvec2> places(const Scan& reference, const Scan& other, const Pairs& pairs,
                               const PlaceOf& place_of) {
  std::vector<glm::dvec2> all;
  for (const auto& [i, j] : pairs.returns) all.push_back(place_of(reference, i));
  for (const std::uint32_t i : pairs.missing) all.push_back(place_of(reference, i));
  for (const std::uint32_t j : pairs.extra) all.push_back(place_of(other, j));
  return all;
}

void fill(const Scan& reference, const Scan& other, const Pairs& pairs, const ScanErrors& errors,
          const PlaceOf& place_of, ErrorMap& map) {
  for (std::size_t k = 0; k < pairs.returns.size(); ++k)
    map.add(place_of(reference, pairs.returns[k].first), errors.range_m[k]);
  for (const std::uint32_t i : pairs.missing) map.add_unpaired(place_of(reference, i));
  for (const std::uint32_t j : pairs.extra) map.add_unpaired(place_of(other, j));
}

double azimuth_deg(const glm::dvec3& p_S) { return glm::degrees(math::atan2(p_S.y, p_S.x)); }

double elevation_deg(const glm::dvec3& p_S) {
  return glm::degrees(math::atan2(p_S.z, math::hypot(p_S.x, p_S.y)));
}

/// Returns true if rings with larger numbers point lower.
bool rings_fall(const Scan& scan, const std::vector<double>& rings) {
  double ring_sum = 0, elevation_sum = 0, products = 0;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    ring_sum += rings[i];
    elevation_sum += elevation_deg(scan.p_S[i]);
    products += rings[i] * elevation_deg(scan.p_S[i]);
  }
  return products * static_cast<double>(rings.size()) < ring_sum * elevation_sum;
}

Picture by_ring(const Scan& reference, const Scan& other, const Pairs& pairs,
                const ScanErrors& errors, const std::vector<double>& rings) {
  const double sign = rings_fall(reference, rings) ? -1 : 1;
  const PlaceOf place_of = [sign](const Scan& scan, std::uint32_t i) {
    return glm::dvec2(azimuth_deg(scan.p_S[i]), sign * (*scan.find(Quantity::Ring))[i]);
  };
  std::set<double> numbers;
  double low = 1e300, high = -1e300;
  for (const glm::dvec2& place : places(reference, other, pairs, place_of)) {
    low = std::min(low, place.y);
    high = std::max(high, place.y);
    numbers.insert(place.y);
  }
  constexpr std::size_t least_columns = 60, most_columns = 600;
  constexpr double most_rows = 256;
  const std::size_t columns =
      std::clamp(reference.p_S.size() / numbers.size(), least_columns, most_columns);
  ErrorMap map({-180, low - 0.5}, {180, high + 0.5},
               glm::ivec2(columns, std::min(high - low + 1, most_rows)));
  fill(reference, other, pairs, errors, place_of, map);
  Picture picture = map.picture("range error by azimuth and ring",
                                "azimuth, deg (positive to the left)", "ring", "range error, m");
  picture.up->low *= sign;
  picture.up->high *= sign;
  return picture;
}

Picture by_direction(const Scan& reference, const Scan& other, const Pairs& pairs,
                     const ScanErrors& errors) {
  const PlaceOf place_of = [](const Scan& scan, std::uint32_t i) {
    return glm::dvec2(azimuth_deg(scan.p_S[i]), elevation_deg(scan.p_S[i]));
  };
  glm::dvec2 low(1e300), high(-1e300);
  for (const glm::dvec2& place : places(reference, other, pairs, place_of)) {
    low = glm::min(low, place);
    high = glm::max(high, place);
  }
  const double spacing_deg = pairs.spacing_rad > 0 ? glm::degrees(pairs.spacing_rad) : 1;
  const glm::dvec2 cells =
      glm::clamp((high - low) / spacing_deg, glm::dvec2(30, 10), glm::dvec2(600, 300));
  ErrorMap map(low, high, glm::ivec2(cells));
  fill(reference, other, pairs, errors, place_of, map);
  return map.picture("range error by direction", "azimuth, deg (positive to the left)",
                     "elevation, deg", "range error, m");
}

/// Plan view without the outermost half percent at each side.
Picture plan_view(const Scan& reference, const Scan& other, const Pairs& pairs,
                  const ScanErrors& errors) {
  const PlaceOf place_of = [&](const Scan& scan, std::uint32_t i) {
    return glm::dvec2(reference.X_WS * scan.p_S[i]);
  };
  std::vector<double> x, y;
  for (const glm::dvec2& place : places(reference, other, pairs, place_of)) {
    x.push_back(place.x);
    y.push_back(place.y);
  }
  constexpr double outermost = 0.005;
  constexpr int cells = 240;
  ErrorMap map({quantile(x, outermost), quantile(y, outermost)},
               {quantile(x, 1 - outermost), quantile(y, 1 - outermost)}, cells);
  fill(reference, other, pairs, errors, place_of, map);
  return map.picture("range error in plan view", "x, m", "y, m", "range error, m");
}

}  // namespace

void draw_errors(const Scan& reference, const Scan& other, const Pairs& pairs,
                 const ScanErrors& errors, Section& into) {
  if (pairs.returns.empty()) return;
  const auto* const rings = reference.find(Quantity::Ring);
  const bool both_have_rings = rings != nullptr && other.find(Quantity::Ring) != nullptr;
  into.pictures.push_back(both_have_rings ? by_ring(reference, other, pairs, errors, *rings)
                                          : by_direction(reference, other, pairs, errors));
  into.pictures.push_back(plan_view(reference, other, pairs, errors));
}

}  // namespace groundray::golden
