#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/geometry/mesh.h"

namespace groundray::testing {

/// Vertical distances of a surface from points.
struct PlanCheck {
  double largest_m = 0;  ///< largest vertical distance of the covered points
  double rms_m = 0;      ///< root mean square of these distances
  std::size_t uncovered = 0;
  std::size_t turned_over = 0;  ///< triangles whose signed plan area is zero or negative
  double area_m2 = 0;           ///< sum of the signed plan areas
};

inline double twice_area_m2(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Returns the height of a triangle at a plan position if the position is inside, up to rounding.
inline std::optional<double> height_at(const TriangleMesh& mesh, std::size_t triangle,
                                       const glm::dvec2& p_m) {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::dvec3 &a = mesh.vertices_m[t.x], &b = mesh.vertices_m[t.y], &c = mesh.vertices_m[t.z];
  const double all = twice_area_m2(glm::dvec2(a), glm::dvec2(b), glm::dvec2(c));
  const double of_a = twice_area_m2(p_m, glm::dvec2(b), glm::dvec2(c)) / all;
  const double of_b = twice_area_m2(glm::dvec2(a), p_m, glm::dvec2(c)) / all;
  const double of_c = 1 - of_a - of_b;
  if (!(std::min({of_a, of_b, of_c}) >= -1e-9)) return std::nullopt;
  return of_a * a.z + of_b * b.z + of_c * c.z;
}

/// Triangles indexed by the plan cells that they may cover.
class PlanBins {
 public:
  explicit PlanBins(const TriangleMesh& mesh) : mesh_(mesh) {
    glm::dvec2 high(-std::numeric_limits<double>::infinity());
    for (const glm::dvec3& p_m : mesh.vertices_m) {
      low_m_ = glm::min(low_m_, glm::dvec2(p_m));
      high = glm::max(high, glm::dvec2(p_m));
    }
    const double count = static_cast<double>(mesh.triangles.size());
    const glm::dvec2 size_m = glm::max(high - low_m_, glm::dvec2(1e-9));
    cell_m_ = std::max(std::sqrt(size_m.x * size_m.y / count), (size_m.x + size_m.y) / 4096);
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const glm::uvec3& t = mesh.triangles[i];
      const glm::dvec2 a(mesh.vertices_m[t.x]), b(mesh.vertices_m[t.y]), c(mesh.vertices_m[t.z]);
      const glm::ivec2 begin = cell_of(glm::min(a, glm::min(b, c)) - 1e-6 * cell_m_);
      const glm::ivec2 end = cell_of(glm::max(a, glm::max(b, c)) + 1e-6 * cell_m_);
      for (int y = begin.y; y <= end.y; ++y) {
        for (int x = begin.x; x <= end.x; ++x) bins_[{y, x}].push_back(i);
      }
    }
  }

  /// Returns the heights of all triangles at a plan position.
  std::vector<double> heights_m(const glm::dvec2& p_m) const {
    std::vector<double> heights;
    const glm::ivec2 cell = cell_of(p_m);
    const auto bin = bins_.find({cell.y, cell.x});
    if (bin == bins_.end()) return heights;
    for (const std::uint32_t i : bin->second) {
      if (const auto height = height_at(mesh_, i, p_m)) heights.push_back(*height);
    }
    return heights;
  }

 private:
  glm::ivec2 cell_of(const glm::dvec2& p_m) const {
    return glm::ivec2(glm::floor((p_m - low_m_) / cell_m_));
  }

  const TriangleMesh& mesh_;
  glm::dvec2 low_m_{std::numeric_limits<double>::infinity()};
  double cell_m_ = 1;
  std::map<std::pair<int, int>, std::vector<std::uint32_t>> bins_;
};

/// Compares each point with the nearest triangle vertically above or below it.
inline PlanCheck check_plan(const std::vector<glm::dvec3>& points_m, const TriangleMesh& mesh) {
  PlanCheck check;
  for (const glm::uvec3& t : mesh.triangles) {
    const double twice =
        twice_area_m2(glm::dvec2(mesh.vertices_m[t.x]), glm::dvec2(mesh.vertices_m[t.y]),
                      glm::dvec2(mesh.vertices_m[t.z]));
    if (!(twice > 0)) ++check.turned_over;
    check.area_m2 += 0.5 * twice;
  }
  const PlanBins bins(mesh);
  double sum = 0;
  for (const glm::dvec3& p_m : points_m) {
    double least = std::numeric_limits<double>::infinity();
    for (const double height : bins.heights_m(glm::dvec2(p_m)))
      least = std::min(least, std::abs(height - p_m.z));
    if (std::isinf(least)) {
      ++check.uncovered;
      continue;
    }
    check.largest_m = std::max(check.largest_m, least);
    sum += least * least;
  }
  const std::size_t covered = points_m.size() - check.uncovered;
  check.rms_m = covered > 0 ? std::sqrt(sum / static_cast<double>(covered)) : 0;
  return check;
}

/// The boundary edges of a mesh, from vertex to vertex.
inline std::vector<std::pair<std::uint32_t, std::uint32_t>> border_of(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++uses[{t[k], t[(k + 1) % 3]}];
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> border;
  for (const auto& [edge, count] : uses) {
    if (uses.count({edge.second, edge.first}) == 0) border.push_back(edge);
  }
  return border;
}

/// Returns the number of violations of a consistently wound manifold with boundary: edges used
/// twice in the same direction, and vertices with several fans or none.
inline std::size_t manifold_faults(const TriangleMesh& mesh) {
  std::size_t faults = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> stars(mesh.vertices_m.size());
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      if (++uses[{t[k], t[(k + 1) % 3]}] > 1 || t[k] == t[(k + 1) % 3]) ++faults;
      stars[t[k]].emplace_back(t[(k + 1) % 3], t[(k + 2) % 3]);
    }
  }
  for (const auto& star : stars) {
    if (star.empty()) {
      ++faults;
      continue;
    }
    std::map<std::uint32_t, std::uint32_t> after(star.begin(), star.end());
    std::map<std::uint32_t, std::uint32_t> ends;
    for (const auto& [from, to] : star) ends[to] = from;
    std::uint32_t begin = star.front().first;
    for (const auto& [from, to] : star) {
      if (ends.count(from) == 0) begin = from;
    }
    std::size_t steps = 0;
    std::uint32_t at = begin;
    while (steps < star.size() && after.count(at) > 0) {
      at = after[at];
      ++steps;
      if (at == begin) break;
    }
    if (steps != star.size()) ++faults;
  }
  return faults;
}

}  // namespace groundray::testing
