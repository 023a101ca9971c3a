#include "apps/view/coarse_layer.h"

#include <vtkCellData.h>
#include <vtkIdList.h>
#include <vtkPointData.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <span>
#include <unordered_map>
#include <vector>

namespace groundray {
namespace {

using Triangles = std::vector<glm::uvec3>;

// Spreads numbers over all 32 bits (the finaliser of MurmurHash3).
std::uint32_t scatter(std::uint32_t number) {
  number ^= number >> 16U;
  number *= 0x85ebca6bU;
  number ^= number >> 13U;
  number *= 0xc2b2ae35U;
  return number ^ (number >> 16U);
}

// Copies rows of one table of numbers to another.
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

glm::dvec3 point(std::span<const float> at, std::int32_t i) {
  const auto first = std::size_t{3} * static_cast<std::size_t>(i);
  return {at[first], at[first + 1], at[first + 2]};
}

double area_m2(std::span<const float> at, std::span<const std::int32_t> corner) {
  double twice = 0;
  for (std::size_t i = 0; i + 2 < corner.size(); i += 3) {
    const glm::dvec3 a = point(at, corner[i]);
    twice += glm::length(glm::cross(point(at, corner[i + 1]) - a, point(at, corner[i + 2]) - a));
  }
  return twice / 2;
}

struct Clustered {
  std::vector<std::uint32_t> vertices, cells;  // that stay, of the surface
  Triangles triangles;                         // of these vertices
};

// For each vertex the first one of its grid cell.
std::vector<std::uint32_t> first_of_cells(std::span<const float> at, double cell_m) {
  std::unordered_map<std::uint64_t, std::uint32_t> first;
  std::vector<std::uint32_t> of(at.size() / 3);
  first.reserve(of.size() / 4);
  for (std::size_t i = 0; i < of.size(); ++i) {
    std::uint64_t key = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double place = std::floor(static_cast<double>(at[3 * i + k]) / cell_m);
      const auto number = static_cast<std::int64_t>(std::clamp(place, -1e6, 1e6)) + (1 << 20);
      key = (key << 21U) | static_cast<std::uint64_t>(number);
    }
    of[i] = first.try_emplace(key, static_cast<std::uint32_t>(i)).first->second;
  }
  return of;
}

Clustered cluster(std::span<const float> at, std::span<const std::int32_t> corner, double cell_m) {
  const std::vector<std::uint32_t> first = first_of_cells(at, cell_m);
  std::vector<std::uint32_t> number(first.size(), std::numeric_limits<std::uint32_t>::max());
  Clustered kept;
  for (std::size_t i = 0; i + 2 < corner.size(); i += 3) {
    std::array<std::uint32_t, 3> place{};
    for (std::size_t k = 0; k < 3; ++k) place[k] = first[static_cast<std::size_t>(corner[i + k])];
    if (place[0] == place[1] || place[1] == place[2] || place[2] == place[0]) continue;
    for (std::uint32_t& one : place) {
      if (number[one] == std::numeric_limits<std::uint32_t>::max()) {
        number[one] = static_cast<std::uint32_t>(kept.vertices.size());
        kept.vertices.push_back(one);
      }
      one = number[one];
    }
    kept.triangles.emplace_back(place[0], place[1], place[2]);
    kept.cells.push_back(static_cast<std::uint32_t>(i / 3));
  }
  return kept;
}

}  // namespace

vtkSmartPointer<vtkPolyData> thin_points(const Layer& cloud, std::size_t points) {
  const std::size_t all = cloud.points();
  const double share = all == 0 ? 1 : static_cast<double>(points) / static_cast<double>(all);
  const double limit = share * 4294967296.0;
  std::vector<std::uint32_t> rows;
  for (std::uint32_t i = 0; i < all; ++i) {
    if (static_cast<double>(scatter(i)) < limit) rows.push_back(i);
  }
  return take_points(*cloud.data, rows);
}

vtkSmartPointer<vtkPolyData> thin_triangles(const Layer& surface, std::size_t triangles) {
  const auto corner = corners(*surface.data);
  if (corner.size() / 3 <= triangles) return surface.data;
  const auto at = coordinates(*surface.data);
  // A plane of area A in squares of width s has 2 A / s^2 triangles.
  const double area = std::max(area_m2(at, corner), 1e-30);
  double cell_m = std::sqrt(2 * area / static_cast<double>(std::max<std::size_t>(triangles, 1)));
  Clustered kept = cluster(at, corner, cell_m);
  while (kept.triangles.size() > triangles) {
    cell_m *= 1.3;
    kept = cluster(at, corner, cell_m);
  }
  auto thinned = take_points(*surface.data, kept.vertices);
  set_triangles(*thinned, kept.triangles);
  copy_rows(*thinned->GetCellData(), *surface.data->GetCellData(), kept.cells);
  return thinned;
}

}  // namespace groundray
