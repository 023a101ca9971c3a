#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>
#include <vector>

#include "reconstruction/dem/fill/dem_fill.h"
#include "reconstruction/dem/plan_triangle.h"
#include "reconstruction/mesh/holes/hole_fill.h"

namespace groundray {
namespace {

constexpr int ring_cells = 4;  // width of the ground around holes that becomes triangles
// Largest root mean square slope: on steeper ground, boundaries of holes look like outlines of
// upright objects.
constexpr double most_slope = 0.5;

// Ground around holes as triangles that face upwards.
class RingMesh {
 public:
  RingMesh(const GridFrame& frame, std::span<const float> heights_m)
      : frame_(frame), heights_m_(heights_m), vertices_(heights_m.size(), none) {
    mark_rings();
    for (int row = 0; row + 1 < frame.samples.y; ++row) {
      for (int column = 0; column + 1 < frame.samples.x; ++column) add_cell({column, row});
    }
  }

  TriangleMesh take() { return std::move(mesh_); }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::uint32_t in_ring = none - 1;  // not yet a vertex

  std::size_t index(glm::ivec2 sample) const {
    return static_cast<std::size_t>(sample.y) * static_cast<std::size_t>(frame_.samples.x) +
           static_cast<std::size_t>(sample.x);
  }

  void mark_rings() {
    for (int row = 0; row < frame_.samples.y; ++row) {
      for (int column = 0; column < frame_.samples.x; ++column) {
        if (std::isnan(heights_m_[index({column, row})])) mark_about({column, row});
      }
    }
  }

  void mark_about(glm::ivec2 sample) {
    for (int r = std::max(sample.y - ring_cells, 0);
         r <= std::min(sample.y + ring_cells, frame_.samples.y - 1); ++r) {
      for (int c = std::max(sample.x - ring_cells, 0);
           c <= std::min(sample.x + ring_cells, frame_.samples.x - 1); ++c) {
        if (!std::isnan(heights_m_[index({c, r})])) vertices_[index({c, r})] = in_ring;
      }
    }
  }

  void add_cell(glm::ivec2 cell) {
    const glm::ivec2 east = cell + glm::ivec2(1, 0), south = cell + glm::ivec2(0, 1);
    add_triangle({cell, south, east});
    add_triangle({east, south, cell + 1});
  }

  void add_triangle(const std::array<glm::ivec2, 3>& samples) {
    if (std::ranges::any_of(samples, [&](auto s) { return vertices_[index(s)] == none; })) return;
    glm::uvec3 triangle;
    for (int k = 0; k < 3; ++k) triangle[k] = vertex(samples[static_cast<std::size_t>(k)]);
    if (frame_.step_m.x * frame_.step_m.y > 0) std::swap(triangle.y, triangle.z);
    mesh_.triangles.push_back(triangle);
  }

  std::uint32_t vertex(glm::ivec2 sample) {
    std::uint32_t& number = vertices_[index(sample)];
    if (number == in_ring) {
      number = static_cast<std::uint32_t>(mesh_.vertices_m.size());
      mesh_.vertices_m.emplace_back(frame_.to_D(sample), heights_m_[index(sample)]);
    }
    return number;
  }

  const GridFrame& frame_;
  std::span<const float> heights_m_;
  std::vector<std::uint32_t> vertices_;  // vertex of each sample
  TriangleMesh mesh_;
};

// Returns the factor on heights that limits the slope of the mesh.
double flattening_of(const TriangleMesh& mesh) {
  double sum = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 normal = glm::cross(mesh.vertices_m[t.y] - mesh.vertices_m[t.x],
                                         mesh.vertices_m[t.z] - mesh.vertices_m[t.x]);
    sum += (normal.x * normal.x + normal.y * normal.y) / (normal.z * normal.z);
  }
  if (!(sum > 0)) return 1;
  return std::min(1.0, most_slope / std::sqrt(sum / static_cast<double>(mesh.triangles.size())));
}

}  // namespace

FilledHeights fill_dem_by_mesh(const GridFrame& frame, std::span<const float> heights_m,
                               const FillOptions& options, std::size_t most_edges,
                               const RunControl& work) {
  std::vector<float> filled_m(heights_m.size(), std::numeric_limits<float>::quiet_NaN());
  // Also checks the arguments, and marks the holes to fill: those it leaves with the fate Partly.
  FilledHeights left = take_filling(frame, heights_m, filled_m, options);
  const bool is_any = std::ranges::any_of(
      left.holes, [](const RasterHole& hole) { return hole.fate == HoleFate::Partly; });
  if (!is_any) return left;
  MeasuredMesh ring{
      .shape = RingMesh(frame, heights_m).take(), .sd_m = {}, .labels = {}, .confidence = {}};
  const double flattening = flattening_of(ring.shape);
  for (glm::dvec3& vertex_m : ring.shape.vertices_m) vertex_m.z *= flattening;
  const FilledMesh mesh =
      fill_holes(std::move(ring), {std::numeric_limits<double>::max(), most_edges}, work);
  const TriangleMesh& shape = mesh.mesh.shape;
  for (std::size_t i = mesh.measured_triangles; i < shape.triangles.size(); ++i) {
    const glm::uvec3& t = shape.triangles[i];
    const auto lower = [&](int column, int row, double height_m) {
      float& least_m =
          filled_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.samples.x) +
                   static_cast<std::size_t>(column)];
      const double true_m = height_m / flattening;
      if (!(true_m >= double{least_m})) least_m = static_cast<float>(true_m);
    };
    visit_samples(frame, {shape.vertices_m[t.x], shape.vertices_m[t.y], shape.vertices_m[t.z]},
                  lower);
  }
  return take_filling(frame, heights_m, filled_m, options);
}

}  // namespace groundray
