#include "apps/golden/conform/silhouettes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <tuple>

#include "terrain/lod/pass.h"

namespace groundray::golden {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double edge_on = 1e-9;  // a facet this nearly parallel to a ray may face either way

struct DirectedEdge {
  std::uint32_t low, high;  // vertices
  std::int32_t triangle;
};

}  // namespace

double distance_m(const Ray& ray, double end_m, const glm::dvec3& a_m, const glm::dvec3& b_m) {
  const glm::dvec3 along = b_m - a_m, from = ray.origin - a_m;
  const double length2 = glm::dot(along, along), slope = glm::dot(ray.direction, along);
  const double ahead = glm::dot(ray.direction, from), beside = glm::dot(along, from);
  const double denominator = length2 - slope * slope;
  // The nearest points of both lines, then clamped to their ends in turn.
  double t_m = denominator > 1e-12 * length2 ? (slope * beside - length2 * ahead) / denominator : 0;
  t_m = std::clamp(t_m, 0.0, end_m);
  double s = length2 > 0 ? std::clamp((beside + t_m * slope) / length2, 0.0, 1.0) : 0;
  t_m = std::clamp(s * slope - ahead, 0.0, end_m);
  s = length2 > 0 ? std::clamp((beside + t_m * slope) / length2, 0.0, 1.0) : 0;
  return glm::length(from + t_m * ray.direction - s * along);
}

Silhouettes::Silhouettes(const HeightGrid& grid, const TerrainMesh& mesh)
    : triangles_(mesh.triangles) {
  const glm::dvec2 cell_m = glm::abs(grid.step_m());
  limit_m_ = std::min(cell_m.x, cell_m.y);
  for (const glm::ivec2 vertex : mesh.vertices)
    points_m_.emplace_back(grid.frame().to_D(vertex), grid.height_m(vertex.x, vertex.y));
  std::vector<DirectedEdge> sides;
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const glm::uvec3& t = triangles_[i];
    normals_.push_back(glm::normalize(
        glm::cross(points_m_[t[1]] - points_m_[t[0]], points_m_[t[2]] - points_m_[t[0]])));
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
      sides.push_back({low, high, static_cast<std::int32_t>(i)});
    }
  }
  std::ranges::sort(sides, {}, [](const DirectedEdge& side) {
    return std::tuple(side.low, side.high, side.triangle);
  });
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const bool shared = i + 1 < sides.size() && sides[i].low == sides[i + 1].low &&
                        sides[i].high == sides[i + 1].high;
    edges_.push_back({points_m_[sides[i].low], points_m_[sides[i].high], sides[i].triangle,
                      shared ? sides[i + 1].triangle : -1});
    i += shared ? 1 : 0;
  }

  const glm::dvec2 a = grid.origin_m();
  const glm::dvec2 b = a + glm::dvec2(grid.columns() - 1, grid.rows() - 1) * grid.step_m();
  low_m_ = glm::min(a, b);
  tile_m_ = 8 * std::max(cell_m.x, cell_m.y);
  tiles_ = glm::ivec2(glm::abs(b - a) / tile_m_) + 1;
  const auto count = static_cast<std::size_t>(tiles_.x) * static_cast<std::size_t>(tiles_.y);
  edges_of_tile_.resize(count);
  high_m_.assign(count, -infinity);
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const Edge& edge = edges_[i];
    const glm::ivec2 p = tile_of(edge.a_m), q = tile_of(edge.b_m);
    for (int y = std::min(p.y, q.y); y <= std::max(p.y, q.y); ++y) {
      for (int x = std::min(p.x, q.x); x <= std::max(p.x, q.x); ++x) {
        const std::size_t tile = index_of(x, y);
        edges_of_tile_[tile].push_back(static_cast<std::uint32_t>(i));
        high_m_[tile] = std::max({high_m_[tile], edge.a_m.z, edge.b_m.z});
      }
    }
  }
}

glm::ivec2 Silhouettes::tile_of(glm::dvec2 p_m) const {
  return glm::clamp(glm::ivec2(glm::floor((p_m - low_m_) / tile_m_)), glm::ivec2(0), tiles_ - 1);
}

bool Silhouettes::is_silhouette(const Edge& edge, const glm::dvec3& direction) const {
  if (edge.other < 0) return true;
  const double one = glm::dot(normals_[static_cast<std::size_t>(edge.one)], direction);
  const double other = glm::dot(normals_[static_cast<std::size_t>(edge.other)], direction);
  return !((one > edge_on && other > edge_on) || (one < -edge_on && other < -edge_on));
}

// Goes along the ray in steps of half a tile, so that the tiles round each step contain all edges
// within the limit.
double Silhouettes::silhouette_m(const Ray& ray, double end_m,
                                 std::vector<std::size_t>& seen) const {
  const glm::dvec2 way(ray.direction);
  const double speed = glm::length(way);
  const double step_m = speed > 0 ? 0.5 * tile_m_ / speed : infinity;
  double least_m = limit_m_;
  seen.clear();
  for (double t_m = 0;; t_m += step_m) {
    const double next_m = std::min(t_m + step_m, end_m);
    const glm::dvec2 middle_m =
        glm::dvec2(ray.origin) + way * (std::isinf(next_m) ? t_m : 0.5 * (t_m + next_m));
    const double low_m =
        std::min(ray.origin.z + t_m * ray.direction.z, ray.origin.z + next_m * ray.direction.z) -
        limit_m_;
    const double reach_m = 0.25 * tile_m_ + limit_m_;
    const glm::ivec2 p = tile_of(middle_m - reach_m), q = tile_of(middle_m + reach_m);
    for (int y = p.y; y <= q.y; ++y) {
      for (int x = p.x; x <= q.x; ++x) {
        const std::size_t tile = index_of(x, y);
        if (low_m > high_m_[tile]) continue;
        if (std::ranges::find(seen, tile) != seen.end()) continue;
        seen.push_back(tile);
        for (const std::uint32_t i : edges_of_tile_[tile]) {
          const Edge& edge = edges_[i];
          if (is_silhouette(edge, ray.direction))
            least_m = std::min(least_m, distance_m(ray, end_m, edge.a_m, edge.b_m));
        }
      }
    }
    if (next_m >= end_m) return least_m;
  }
}

void Silhouettes::measure(std::span<const Ray> rays, std::span<const double> range_m,
                          std::span<const std::int32_t> triangle, std::span<double> silhouette,
                          std::span<double> edge_m) const {
  const glm::dvec2 middle_m = low_m_ + 0.5 * tile_m_ * glm::dvec2(tiles_);
  const double across_m = tile_m_ * glm::length(glm::dvec2(tiles_));
  run_in_parallel(rays.size(), [&](std::size_t begin, std::size_t end) {
    std::vector<std::size_t> seen;
    for (std::size_t i = begin; i < end; ++i) {
      const Ray& ray = rays[i];
      // A ray that misses ends where it has surely left the DEM.
      const double speed = glm::length(glm::dvec2(ray.direction));
      double end_m = speed > 0 ? (glm::length(glm::dvec2(ray.origin) - middle_m) + across_m) / speed
                               : 1e4 + std::abs(ray.origin.z);
      edge_m[i] = limit_m_;
      if (triangle[i] >= 0) {
        const auto hit = static_cast<std::size_t>(triangle[i]);
        const double towards = std::abs(glm::dot(normals_[hit], ray.direction));
        end_m = std::min(end_m, range_m[i] + limit_m_ / std::max(towards, 1e-9));
        for (int k = 0; k < 3; ++k) {
          const glm::dvec3 &a = points_m_[triangles_[hit][k]],
                           &b = points_m_[triangles_[hit][(k + 1) % 3]];
          edge_m[i] = std::min(edge_m[i], distance_m(ray, end_m, a, b));
        }
      }
      silhouette[i] = silhouette_m(ray, end_m, seen);
    }
  });
}

}  // namespace groundray::golden
