#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/tracing/ray.h"
#include "terrain/terrain_mesh.h"

namespace groundray::golden {

/// Edges of a mesh, by place, to find those that rays pass closely.
class Silhouettes {
 public:
  Silhouettes(const HeightGrid& grid, const TerrainMesh& mesh);

  /// Largest distance that is measured, metres: a cell.
  double limit_m() const { return limit_m_; }

  /// Measures ReferenceRays::silhouette_m and edge_m.
  void measure(std::span<const Ray> rays, std::span<const double> range_m,
               std::span<const std::int32_t> triangle, std::span<double> silhouette_m,
               std::span<double> edge_m) const;

 private:
  struct Edge {
    glm::dvec3 a_m{0}, b_m{0};
    std::int32_t one = -1, other = -1;  // triangles; -1 beyond the boundary
  };
  glm::ivec2 tile_of(glm::dvec2 p_m) const;
  std::size_t index_of(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(tiles_.x) +
           static_cast<std::size_t>(x);
  }
  bool is_silhouette(const Edge& edge, const glm::dvec3& direction) const;
  double silhouette_m(const Ray& ray, double end_m, std::vector<std::size_t>& seen) const;

  glm::dvec2 low_m_{0};
  double tile_m_ = 1;
  glm::ivec2 tiles_{1};
  double limit_m_ = 1;
  std::vector<glm::dvec3> points_m_;
  std::vector<glm::uvec3> triangles_;
  std::vector<glm::dvec3> normals_;
  std::vector<Edge> edges_;
  std::vector<std::vector<std::uint32_t>> edges_of_tile_;
  std::vector<double> high_m_;  // of each tile's edges
};

/// Returns the distance of the part of a ray from 0 to end_m from the segment ab, metres.
double distance_m(const Ray& ray, double end_m, const glm::dvec3& a_m, const glm::dvec3& b_m);

}  // namespace groundray::golden
