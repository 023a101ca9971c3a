#include "apps/golden/conform/reference_rays.h"

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <utility>

#include "apps/golden/conform/silhouettes.h"
#include "core/math.h"
#include "core/tracing/ray_tracer.h"

namespace groundray::golden {
namespace {

// Finds the triangle of a mesh of leaves below a point. The triangles of a leaf follow each other.
class TriangleFinder {
 public:
  TriangleFinder(const HeightGrid& grid, const std::vector<Leaf>& leaves, int block_cells,
                 const TerrainMesh& mesh)
      : mesh_(mesh), cells_(grid.columns() - 1, grid.rows() - 1) {
    leaf_of_cell_.assign(static_cast<std::size_t>(cells_.x) * static_cast<std::size_t>(cells_.y),
                         -1);
    for (std::size_t n = 0; n < leaves.size(); ++n) {
      const Leaf& leaf = leaves[n];
      const glm::ivec2 first(leaf.column, leaf.row);
      const glm::ivec2 end = glm::min(first + block_cells * leaf.step, cells_);
      for (int row = first.y; row < end.y; ++row) {
        for (int column = first.x; column < end.x; ++column)
          leaf_of_cell_[index(column, row)] = static_cast<std::int32_t>(n);
      }
    }
    first_.assign(leaves.size() + 1, mesh.triangles.size());
    for (std::size_t i = mesh.triangles.size(); i-- > 0;) {
      const glm::ivec2 three = corner(i, 0) + corner(i, 1) + corner(i, 2);
      first_[static_cast<std::size_t>(leaf_at(glm::dvec2(three) / 3.0))] = i;
    }
    for (std::size_t n = leaves.size(); n-- > 0;) first_[n] = std::min(first_[n], first_[n + 1]);
  }

  // Returns the triangle whose sides a point, in columns and rows, is farthest inside; -1 if it has
  // none near.
  std::int32_t at(glm::dvec2 point) const {
    const std::int32_t leaf = leaf_at(point);
    if (leaf < 0) return -1;
    std::int32_t best = -1;
    double most_inside = -std::numeric_limits<double>::infinity();
    for (std::size_t i = first_[static_cast<std::size_t>(leaf)];
         i < first_[static_cast<std::size_t>(leaf) + 1]; ++i) {
      const double inside = depth(i, point);
      if (inside <= most_inside) continue;
      most_inside = inside;
      best = static_cast<std::int32_t>(i);
    }
    return best;
  }

 private:
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(cells_.x) +
           static_cast<std::size_t>(column);
  }
  glm::ivec2 corner(std::size_t triangle, int which) const {
    return mesh_.vertices[mesh_.triangles[triangle][which]];
  }
  std::int32_t leaf_at(glm::dvec2 point) const {
    const glm::ivec2 cell = glm::clamp(glm::ivec2(glm::floor(point)), glm::ivec2(0), cells_ - 1);
    return leaf_of_cell_[index(cell.x, cell.y)];
  }
  // Returns the smallest barycentric coordinate of a point.
  double depth(std::size_t triangle, glm::dvec2 point) const {
    const auto cross = [](glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; };
    const std::array<glm::dvec2, 3> p = {corner(triangle, 0), corner(triangle, 1),
                                         corner(triangle, 2)};
    const double area = cross(p[1] - p[0], p[2] - p[0]);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k)
      least = std::min(least, cross(p[(k + 1) % 3] - p[k], point - p[k]) / area);
    return least;
  }

  const TerrainMesh& mesh_;
  glm::ivec2 cells_;
  std::vector<std::int32_t> leaf_of_cell_;
  std::vector<std::size_t> first_;  // triangle of each leaf
};

}  // namespace

std::vector<Ray> sample_rays(const HeightGrid& grid, std::size_t count, Seed seed) {
  const glm::dvec2 extent_m = glm::dvec2(grid.columns() - 1, grid.rows() - 1) * grid.step_m();
  std::vector<Ray> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto pulse = static_cast<std::uint32_t>(i);
    const glm::dvec2 place = random_uniform({seed, 0, 0, pulse, 0});
    const glm::dvec2 turn = random_uniform({seed, 0, 0, pulse, 1});
    const glm::dvec2 other = random_uniform({seed, 0, 0, pulse, 2});
    const glm::dvec2 p_m = grid.origin_m() + place * extent_m;
    const double ground_m = grid.height_m_at(p_m).value_or(grid.max_height_m());
    // Elevations from 5 degrees above to 60 below the horizon, most of them shallow.
    const double elevation_rad = glm::mix(5.0, -60.0, turn.x * turn.x) * std::numbers::pi / 180;
    const double azimuth_rad = 2 * std::numbers::pi * turn.y;
    rays[i].origin = {p_m, ground_m + 0.5 + 49.5 * other.x * other.x};
    rays[i].direction = {math::cos(elevation_rad) * math::cos(azimuth_rad),
                         math::cos(elevation_rad) * math::sin(azimuth_rad),
                         math::sin(elevation_rad)};
  }
  return rays;
}

ReferenceRays trace_reference_rays(const HeightGrid& grid, const std::vector<Leaf>& leaves,
                                   int block_cells, const TerrainMesh& mesh,
                                   std::vector<Ray> rays) {
  const RayTracer tracer({{.frame = grid.frame(),
                           .heights = grid.samples(),
                           .leaf_cells = block_cells,
                           .leaves = leaves}},
                         float_frame_origin(rays.front().origin), Tracing::Exact);
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits);
  const TriangleFinder finder(grid, leaves, block_cells, mesh);
  const Silhouettes silhouettes(grid, mesh);
  ReferenceRays out{std::move(rays), {}, {}, {}, {}, silhouettes.limit_m()};
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Ray& ray = out.rays[i];
    const double range_m = hits[i].range_m;
    out.range_m.push_back(range_m);
    std::int32_t triangle = -1;
    if (hits[i]) triangle = finder.at(grid.frame().to_grid(ray.origin + range_m * ray.direction));
    out.triangle.push_back(triangle);
  }
  out.silhouette_m.resize(hits.size());
  out.edge_m.resize(hits.size());
  silhouettes.measure(out.rays, out.range_m, out.triangle, out.silhouette_m, out.edge_m);
  return out;
}

}  // namespace groundray::golden
