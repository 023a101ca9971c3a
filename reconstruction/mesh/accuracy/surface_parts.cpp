#include "reconstruction/mesh/accuracy/surface_parts.h"

#include <tbb/parallel_for.h>

#include <glm/geometric.hpp>
#include <limits>

#include "core/error.h"

namespace groundray {
namespace {

constexpr double most_parts = 1e9;
constexpr std::size_t parts_each = 4096;  // per lot, unless a single row has more

// Returns the number of parts into which each edge of a triangle is divided. A triangle without
// area, except for rounding, does not contribute to means.
double splits_of(const QuadratureTriangle& facet, double step_m) {
  if (facet.area_m2 <= 1e-15 * facet.longest_m * facet.longest_m) return 1;
  return std::max(1.0, std::ceil(facet.longest_m / step_m));
}

}  // namespace

QuadratureTriangle::QuadratureTriangle(const TriangleMesh& mesh, std::size_t triangle) {
  const glm::uvec3& t = mesh.triangles[triangle];
  a = mesh.vertices_m[t.x];
  ab = mesh.vertices_m[t.y] - a;
  ac = mesh.vertices_m[t.z] - a;
  const glm::dvec3 bc = ac - ab;
  normal = glm::cross(ab, ac);
  area_m2 = 0.5 * glm::length(normal);
  const double squares = glm::dot(ab, ab) + glm::dot(ac, ac) + glm::dot(bc, bc);
  longest_m = std::sqrt(std::max({glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(bc, bc)}));
  spread_m2 = squares / 36;
  const glm::dvec3 from_a = ab + ac, from_b = ac - 2.0 * ab, from_c = ab - 2.0 * ac;
  radius_m = std::sqrt(std::max(
                 {glm::dot(from_a, from_a), glm::dot(from_b, from_b), glm::dot(from_c, from_c)})) /
             3;
}

std::array<glm::dvec3, 3> SurfacePart::corners(const QuadratureTriangle& facet) const noexcept {
  const glm::dvec3 ab = scale / 3 * facet.ab, ac = scale / 3 * facet.ac;
  return {middle - ab - ac, middle + 2.0 * ab - ac, middle + 2.0 * ac - ab};
}

std::array<SurfacePart, 4> SurfacePart::quarters(const QuadratureTriangle& facet) const noexcept {
  const double half = 0.5 * scale;
  const glm::dvec3 ab = half / 3 * facet.ab, ac = half / 3 * facet.ac;
  return {{{triangle, middle, -half},
           {triangle, middle - ab - ac, half},
           {triangle, middle + 2.0 * ab - ac, half},
           {triangle, middle + 2.0 * ac - ab, half}}};
}

SurfaceParts::SurfaceParts(const TriangleMesh& mesh, double step_m) : mesh_(mesh) {
  if (!(step_m > 0)) throw Error("distance between meshes: step_m = {} must be positive", step_m);
  double parts = 0;
  std::vector<double> splits(mesh.triangles.size());
  for (std::size_t i = 0; i < splits.size(); ++i) {
    splits[i] = splits_of(QuadratureTriangle(mesh, i), step_m);
    parts += splits[i] * splits[i];
  }
  if (!(parts <= most_parts)) {
    throw Error(
        "distance between meshes: step_m = {} requires {:.2g} samples, which must be at most "
        "{:.0e}; use a larger step",
        step_m, parts, most_parts);
  }
  std::size_t in_lot = parts_each;
  for (std::uint32_t i = 0; i < splits.size(); ++i) {
    const auto rows = static_cast<std::uint32_t>(splits[i]);
    const auto each =
        std::max(1u, static_cast<std::uint32_t>(parts_each / (std::size_t{2} * rows)));
    for (std::uint32_t row = 0; row < rows; row += each) {
      const std::uint32_t end = std::min(rows, row + each);
      if (in_lot >= parts_each) {
        lots_.push_back(rows_.size());
        in_lot = 0;
      }
      rows_.push_back({i, rows, row, end});
      in_lot += std::size_t{end - row} * (std::size_t{2} * rows - row - end);
    }
  }
  lots_.push_back(rows_.size());
}

double SurfaceParts::widened_m(const TriangleMesh& mesh, double step_m, double samples) {
  const double most =
      std::min(most_parts, 16 * samples + static_cast<double>(mesh.triangles.size()));
  for (;; step_m *= 2) {
    double parts = 0, largest = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const double splits = splits_of(QuadratureTriangle(mesh, i), step_m);
      parts += splits * splits;
      largest = std::max(largest, splits);
    }
    if (parts <= most || !(largest > 1) || !(step_m > 0)) return step_m;
  }
}

double SurfaceParts::sum_rounding() const noexcept {
  // The sum of n numbers loses at most n ulp / 2; weighting loses one ulp more each. A lot has at
  // most 6.8e4 parts, if it ends with a row of a triangle of 1e9 parts.
  constexpr double in_lot = 4e4;
  return (static_cast<double>(lots()) + in_lot) * std::numeric_limits<double>::epsilon();
}

void SurfaceParts::in_parallel(std::size_t count, const std::function<void(std::size_t)>& work) {
  tbb::parallel_for(std::size_t{0}, count, work);
}

void DistanceSums::add(double distance_m, double spread_m, double high_m, double high_square_m2,
                       double part_m2) noexcept {
  const double low_m = std::max(0.0, distance_m - spread_m);
  ++samples;
  area_m2 += part_m2;
  distance += part_m2 * distance_m;
  square += part_m2 * distance_m * distance_m;
  spread += part_m2 * spread_m * spread_m;
  low += part_m2 * low_m;
  low_square += part_m2 * low_m * low_m;
  high += part_m2 * std::min(high_m, distance_m + spread_m);
  high_square += part_m2 * high_square_m2;
}

void DistanceSums::operator+=(const DistanceSums& more) noexcept {
  for (double DistanceSums::*sum :
       {&DistanceSums::distance, &DistanceSums::square, &DistanceSums::low,
        &DistanceSums::low_square, &DistanceSums::high, &DistanceSums::high_square,
        &DistanceSums::spread, &DistanceSums::area_m2})
    this->*sum += more.*sum;
  samples += more.samples;
}

// Over a part, the mean differs from the distance at the centroid by at most the root-mean-square
// difference (spread). By Minkowski's inequality, root mean squares differ by at most the root mean
// square of the difference.
DistanceSums::Means DistanceSums::means(double rounding_m, double sum_rounding) const noexcept {
  const double slack_m = rounding_m + sum_rounding * high / area_m2;
  const double rms_m = std::sqrt(square / area_m2), spread_m = std::sqrt(spread / area_m2);
  const double low_m = std::max(rms_m - spread_m, std::sqrt(low_square / area_m2));
  const double high_m = std::min(rms_m + spread_m, std::sqrt(high_square / area_m2));
  return {.mean = {distance / area_m2, std::max(0.0, low / area_m2 - slack_m),
                   high / area_m2 + slack_m},
          .rms = {rms_m, std::max(0.0, low_m - slack_m), high_m + slack_m}};
}

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
