#include "reconstruction/pipeline/terrain_decimation.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <glm/common.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "core/error.h"
#include "reconstruction/mesh/simplify/simplify.h"

namespace groundray {
namespace {

// The lines between samples at which the reference surface bends: rows, columns and diagonals. On
// each, dot(number, sample) is constant.
struct Lines {
  glm::ivec2 number;
  glm::ivec2 along;  // from a sample to the next on a line
};
constexpr Lines bends[] = {{{0, 1}, {1, 0}}, {{1, 0}, {0, 1}}, {{1, 1}, {1, -1}}};

std::int64_t dot(glm::ivec2 a, glm::ivec2 b) {
  return std::int64_t{a.x} * b.x + std::int64_t{a.y} * b.y;
}

/// Edges between samples that stay within a distance above and below the reference surface. Both
/// are straight between the lines that the edge crosses, so that they are farthest apart at one.
class EdgesNearby {
 public:
  EdgesNearby(const HeightGrid& grid, double max_error_m)
      : grid_(grid), max_error_m_(max_error_m) {}

  bool contain(glm::ivec2 a, glm::ivec2 b) const {
    return std::ranges::all_of(bends, [&](const Lines& lines) { return is_near_at(lines, a, b); });
  }

 private:
  double height_m(glm::ivec2 p) const { return static_cast<double>(grid_.height_m(p.x, p.y)); }

  bool is_near_at(const Lines& lines, glm::ivec2 a, glm::ivec2 b) const {
    if (dot(lines.number, a) > dot(lines.number, b)) std::swap(a, b);
    const std::int64_t steps = dot(lines.number, b - a);
    // Coordinate along the lines, which the edge runs through in `steps` steps of `slope / steps`.
    const std::int64_t slope = lines.along.x != 0 ? b.x - a.x : b.y - a.y;
    const double begin_m = height_m(a), rise_m = height_m(b) - begin_m;
    for (std::int64_t step = 1; step < steps; ++step) {
      const std::int64_t whole = step * slope / steps - (step * slope % steps < 0 ? 1 : 0);
      const double share =
          static_cast<double>(step * slope - whole * steps) / static_cast<double>(steps);
      const glm::ivec2 before =
          sample_at(lines, a, static_cast<int>(step), static_cast<int>(whole));
      double ground_m = height_m(before);
      if (share > 0) ground_m += share * (height_m(before + lines.along) - ground_m);
      const double edge_m =
          begin_m + rise_m * static_cast<double>(step) / static_cast<double>(steps);
      if (!(std::abs(edge_m - ground_m) <= max_error_m_)) return false;
    }
    return true;
  }

  // Returns the sample `steps` lines after that of `a`, `along` steps from a's coordinate on it.
  static glm::ivec2 sample_at(const Lines& lines, glm::ivec2 a, int steps, int along) {
    if (lines.along.x == 0) return a + glm::ivec2(steps, along);
    if (lines.number.x == 0) return a + glm::ivec2(along, steps);
    return a + glm::ivec2(along, steps - along);
  }

  const HeightGrid& grid_;
  double max_error_m_;
};

// Returns the simplified triangles between the samples of a mesh. Vertices that were split where
// parts of the surface touch are one again.
TerrainMesh on_samples(const Simplified& simplified, const std::vector<glm::ivec2>& samples) {
  constexpr std::uint32_t unused = -1;
  TerrainMesh mesh;
  std::vector<std::uint32_t> numbers(samples.size(), unused);
  for (glm::uvec3 triangle : simplified.mesh.shape.triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t source = simplified.sources[triangle[k]];
      if (numbers[source] == unused) {
        numbers[source] = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(samples[source]);
      }
      triangle[k] = numbers[source];
    }
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

TerrainMesh collapse(const HeightGrid& grid, const TerrainMesh& exact, double max_error_m,
                     const RunControl& work) {
  MeasuredMesh mesh;
  mesh.shape.triangles = exact.triangles;
  mesh.shape.vertices_m.reserve(exact.vertices.size());
  for (const glm::ivec2& sample : exact.vertices) {
    mesh.shape.vertices_m.emplace_back(grid.frame().to_D(sample),
                                       grid.height_m(sample.x, sample.y));
  }
  const EdgesNearby edges(grid, max_error_m);
  const VerticalBound bound{max_error_m, 0, [&](std::uint32_t a, std::uint32_t b) {
                              return edges.contain(exact.vertices[a], exact.vertices[b]);
                            }};
  const SimplifyOptions options{.crease_rad = std::numbers::pi,
                                .fineness = {.samples = 100, .most_pieces = 100}};  // not used
  return on_samples(simplify(mesh, bound, options, work), exact.vertices);
}

}  // namespace

DecimatedTerrain decimate_terrain(const HeightGrid& grid, double max_error_m,
                                  const RunControl& work) {
  if (!(max_error_m > 0 && std::isfinite(max_error_m))) {
    throw Error("max_error_m = {} must be positive to collapse edges; a mesh of nodes may have 0",
                max_error_m);
  }
  const TerrainMesh exact = build_terrain_mesh(grid, {.tolerance_m = 0});
  if (exact.triangles.empty()) throw Error("the DEM has no facet: no three neighbouring heights");
  // Rounding may exceed the bound, by a minute part of the heights' range: less is permitted then.
  for (double error_m = max_error_m;;) {
    DecimatedTerrain result{collapse(grid, exact, error_m, work), {}};
    result.deviation = judge::largest_deviation(grid, result.mesh.vertices, result.mesh.triangles);
    const double excess_m = result.deviation.largest_m - max_error_m;
    if (excess_m <= 0) return result;
    error_m = std::max(error_m - 2 * excess_m, 0.5 * error_m);
  }
}

}  // namespace groundray
