#include "apps/view/rendering/coarse_layer.h"

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <numeric>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace groundray {
namespace {

// Scrambles a number over all 32 bits (the finaliser of MurmurHash3).
std::uint32_t scatter(std::uint32_t number) {
  number ^= number >> 16U;
  number *= 0x85ebca6bU;
  number ^= number >> 13U;
  number *= 0xc2b2ae35U;
  return number ^ (number >> 16U);
}

// Copies the given rows of one table of attributes to another.
void copy_rows(vtkDataSetAttributes& to, vtkDataSetAttributes& from,
               std::span<const std::uint32_t> rows) {
  to.CopyAllOn();
  to.CopyAllocate(&from, static_cast<vtkIdType>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    to.CopyData(&from, static_cast<vtkIdType>(rows[i]), static_cast<vtkIdType>(i));
  to.Squeeze();
}

vtkSmartPointer<vtkPolyData> take_points(vtkPolyData& all, std::span<const std::uint32_t> rows) {
  auto some = make_points(rows.size());
  const auto from = coordinates(all), to = coordinates(*some);
  for (std::size_t i = 0; i < rows.size(); ++i)
    std::copy_n(&from[std::size_t{3} * rows[i]], 3, &to[3 * i]);
  copy_rows(*some->GetPointData(), *all.GetPointData(), rows);
  return some;
}

std::vector<double> areas_m2(std::span<const float> at, std::span<const std::int32_t> corner) {
  std::vector<double> areas(corner.size() / 3);
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const glm::dvec3 a = point_at(at, corner[3 * i]), b = point_at(at, corner[3 * i + 1]),
                     c = point_at(at, corner[3 * i + 2]);
    areas[i] = glm::length(glm::cross(b - a, c - a)) / 2;
    if (!std::isfinite(areas[i])) areas[i] = 0;
  }
  return areas;
}

struct Box {
  glm::dvec3 low{0}, size{0};
  double extent_m() const { return std::max({size.x, size.y, size.z}); }
};

// Returns the bounding box of the finite coordinates.
Box box_of(vtkPolyData& surface) {
  Box box;
  for (int k = 0; k < 3; ++k) {
    glm::dvec2 range;
    surface.GetPoints()->GetData()->GetFiniteRange(&range.x, k);
    if (!(range.x <= range.y)) continue;
    box.low[k] = range.x;
    box.size[k] = range.y - range.x;
  }
  return box;
}

// Maximum number of grid cells along a side of the bounding box.
constexpr double most_cells = 1 << 20;

// Returns for each vertex the first vertex in the same grid cell.
std::vector<std::uint32_t> first_of_cells(std::span<const float> at, const glm::dvec3& low,
                                          double cell_m) {
  std::unordered_map<std::uint64_t, std::uint32_t> first;
  std::vector<std::uint32_t> of(at.size() / 3);
  first.reserve(of.size() / 4);
  for (std::size_t i = 0; i < of.size(); ++i) {
    std::uint64_t key = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double place =
          (static_cast<double>(at[3 * i + k]) - low[static_cast<glm::length_t>(k)]) / cell_m;
      key <<= 21U;
      if (place >= 0) key |= static_cast<std::uint64_t>(std::min(place, most_cells));
    }
    of[i] = first.try_emplace(key, static_cast<std::uint32_t>(i)).first->second;
  }
  return of;
}

struct Scattered {
  std::size_t operator()(const glm::uvec3& corner) const {
    return scatter(corner.x ^ scatter(corner.y ^ scatter(corner.z)));
  }
};

// Rotates the corners so that the smallest index comes first: equal for equal triangles of the same
// orientation.
glm::uvec3 least_first(const glm::uvec3& corner) {
  if (corner.y < corner.x && corner.y < corner.z) return {corner.y, corner.z, corner.x};
  if (corner.z < corner.x && corner.z < corner.y) return {corner.z, corner.x, corner.y};
  return corner;
}

KeptTriangles cluster(std::span<const float> at, std::span<const std::int32_t> corner,
                      const glm::dvec3& low, double cell_m) {
  const std::vector<std::uint32_t> first = first_of_cells(at, low, cell_m);
  KeptTriangles gathered(first.size());
  std::unordered_set<glm::uvec3, Scattered> seen;
  for (std::size_t i = 0; i + 2 < corner.size(); i += 3) {
    glm::uvec3 place;
    for (std::size_t k = 0; k < 3; ++k)
      place[static_cast<glm::length_t>(k)] = first[static_cast<std::size_t>(corner[i + k])];
    if (place.x == place.y || place.y == place.z || place.z == place.x) continue;
    if (seen.insert(least_first(place)).second) gathered.add(place, i / 3);
  }
  return gathered;
}

// Clusters with about the finest grid that leaves at most `triangles` triangles.
KeptTriangles cluster_to(vtkPolyData& surface, double area_m2, std::size_t triangles) {
  const auto at = coordinates(surface);
  const auto corner = corners(surface);
  const Box box = box_of(surface);
  // Cells of half the box: 2 x 2 x 2 vertices have at most 112 triangles, both orientations
  // counted.
  const double coarsest_m = 0.51 * box.extent_m();
  if (!(coarsest_m > 0)) return KeptTriangles(0);
  // A plane of area A in squares of width s has 2 A / s^2 triangles.
  double cell_m = std::clamp(std::sqrt(2 * area_m2 / static_cast<double>(triangles)),
                             box.extent_m() / most_cells, coarsest_m);
  KeptTriangles kept = cluster(at, corner, box.low, cell_m);
  while (kept.triangles.size() > triangles && cell_m < coarsest_m) {
    const double excess =
        static_cast<double>(kept.triangles.size()) / static_cast<double>(triangles);
    cell_m = std::min(cell_m * std::max(1.15, std::sqrt(excess)), coarsest_m);
    kept = cluster(at, corner, box.low, cell_m);
  }
  // Rough surfaces have a large area in few cells.
  for (int round = 0; round < 6 && 4 * kept.triangles.size() < triangles; ++round) {
    cell_m /= 1.6;
    KeptTriangles finer = cluster(at, corner, box.low, cell_m);
    if (finer.triangles.size() > triangles) break;
    kept = std::move(finer);
  }
  return kept;
}

// Returns the largest triangles; among equal ones, a pseudo-random choice.
KeptTriangles largest_triangles(std::span<const std::int32_t> corner,
                                std::span<const double> areas_m2, std::size_t vertices,
                                std::size_t triangles) {
  std::vector<std::uint32_t> cells(areas_m2.size());
  std::iota(cells.begin(), cells.end(), 0U);
  const auto end = cells.begin() + static_cast<std::ptrdiff_t>(triangles);
  std::nth_element(cells.begin(), end, cells.end(), [&](std::uint32_t a, std::uint32_t b) {
    // Rounding to float makes areas equal that differ by rounding only.
    const auto first = static_cast<float>(areas_m2[a]), second = static_cast<float>(areas_m2[b]);
    return first != second ? first > second : scatter(a) < scatter(b);
  });
  std::sort(cells.begin(), end);
  KeptTriangles gathered(vertices);
  for (auto cell = cells.begin(); cell != end; ++cell) {
    const std::int32_t* const c = &corner[std::size_t{3} * *cell];
    gathered.add(glm::uvec3(c[0], c[1], c[2]), *cell);
  }
  return gathered;
}

}  // namespace

KeptTriangles::KeptTriangles(std::size_t count)
    : number_(count, std::numeric_limits<std::uint32_t>::max()) {}

void KeptTriangles::add(glm::uvec3 corner, std::size_t cell) {
  for (glm::length_t k = 0; k < 3; ++k) {
    std::uint32_t& number = number_[corner[k]];
    if (number == std::numeric_limits<std::uint32_t>::max()) {
      number = static_cast<std::uint32_t>(vertices.size());
      vertices.push_back(corner[k]);
    }
    corner[k] = number;
  }
  triangles.push_back(corner);
  cells.push_back(static_cast<std::uint32_t>(cell));
}

vtkSmartPointer<vtkPolyData> thin_points(const Layer& cloud, std::size_t points) {
  const std::size_t all = cloud.points();
  points = std::max(points, fewest_elements);
  if (all <= points) return cloud.data;
  const double share = static_cast<double>(points) / static_cast<double>(all);
  const double limit = share * 4294967296.0;
  std::vector<std::uint32_t> rows;
  for (std::uint32_t i = 0; i < all; ++i) {
    if (static_cast<double>(scatter(i)) < limit) rows.push_back(i);
  }
  return take_points(*cloud.data, rows);
}

vtkSmartPointer<vtkPolyData> thin_triangles(const Layer& surface, std::size_t triangles) {
  const auto corner = corners(*surface.data);
  triangles = std::max(triangles, fewest_elements);
  if (corner.size() / 3 <= triangles) return surface.data;
  const auto at = coordinates(*surface.data);
  const std::vector<double> areas = areas_m2(at, corner);
  const double area_m2 = std::accumulate(areas.begin(), areas.end(), 0.0);
  KeptTriangles kept = cluster_to(*surface.data, area_m2, triangles);
  if (8 * kept.triangles.size() < triangles)
    kept = largest_triangles(corner, areas, at.size() / 3, triangles);
  auto thinned = take_points(*surface.data, kept.vertices);
  set_triangles(*thinned, kept.triangles);
  copy_rows(*thinned->GetCellData(), *surface.data->GetCellData(), kept.cells);
  return thinned;
}

}  // namespace groundray
