#include "apps/view/layers/mesh_layer.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <vtkFloatArray.h>
#include <vtkPointData.h>

#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <numeric>
#include <span>

#include "apps/view/layers/cloud_layer.h"
#include "apps/view/rendering/coarse_layer.h"
#include "core/math.h"

namespace groundray {
namespace {

// Meshes with fewer triangles are taken for solids with sharp edges, not measured surfaces.
constexpr std::size_t fewest_smooth = 2000;

glm::dvec3 centre_of(const TriangleMesh& mesh) {
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const glm::dvec3& p : mesh.vertices_m) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return mesh.vertices_m.empty() ? glm::dvec3(0) : (low + high) / 2.0;
}

// Returns the normal of the triangle whose corners begin at `corner[first]`, as long as twice its
// area.
glm::dvec3 twice_area_at(std::span<const float> places, std::span<const std::int32_t> corner,
                         std::size_t first) {
  const glm::dvec3 a = point_at(places, corner[first]);
  return glm::cross(point_at(places, corner[first + 1]) - a,
                    point_at(places, corner[first + 2]) - a);
}

}  // namespace

Layer mesh_layer(const std::string& name, const TriangleMesh& mesh, const glm::dvec3& origin_w_m,
                 const PointCloud& vertices) {
  const std::size_t count = mesh.vertices_m.size();
  Layer layer{.name = name, .kind = LayerKind::Mesh, .data = make_points(count)};
  const glm::dvec3 centre = centre_of(mesh);
  layer.origin_w_m = origin_w_m + centre;
  layer.frame_w_m = origin_w_m;
  const auto places = coordinates(*layer.data);
  std::vector<float> height(count);
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec3& p = mesh.vertices_m[i];
    for (glm::length_t k = 0; k < 3; ++k)
      places[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(p[k] - centre[k]);
    height[i] = static_cast<float>(p.z + origin_w_m.z);
  }
  set_triangles(*layer.data, mesh.triangles);
  if (vertices.rows() == count && !vertices.columns().empty()) {
    std::vector<std::size_t> rows(count);
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    add_table(layer, LayerColumn::Of::Points, vertices, rows);
  }
  add_column(layer, {.name = "height", .unit = "m", .scale = ColourScale::Earth}, height);
  if (mesh.triangles.size() >= fewest_smooth) add_normals(layer);
  if (layer.find("colour") != nullptr) layer.coloured_by = "colour";
  layer.colour = {0.78f, 0.76f, 0.72f};
  layer.facts.push_back(fmt::format("{} triangles, {} vertices", mesh.triangles.size(), count));
  return layer;
}

void add_normals(Layer& surface) {
  const auto places = coordinates(*surface.data);
  const auto corner = corners(*surface.data);
  std::vector<glm::dvec3> sum(places.size() / 3, glm::dvec3(0));
  for (std::size_t i = 0; i + 2 < corner.size(); i += 3) {
    const glm::dvec3 twice_area = twice_area_at(places, corner, i);
    for (std::size_t k = 0; k < 3; ++k) sum[static_cast<std::size_t>(corner[i + k])] += twice_area;
  }
  const auto normals = make_array<vtkFloatArray>("normals", sum.size(), 3);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double length = glm::length(sum[i]);
    const glm::dvec3 normal = length > 0 ? sum[i] / length : glm::dvec3(0, 0, 1);
    normals->SetTuple(static_cast<vtkIdType>(i), &normal.x);
  }
  surface.data->GetPointData()->SetNormals(normals);
}

void add_slopes(Layer& surface) {
  const auto places = coordinates(*surface.data);
  const auto corner = corners(*surface.data);
  std::vector<float> slope(corner.size() / 3);
  tbb::parallel_for(std::size_t{0}, slope.size(), [&](std::size_t i) {
    const glm::dvec3 normal = twice_area_at(places, corner, 3 * i);
    slope[i] = static_cast<float>(
        glm::degrees(math::atan2(math::hypot(normal.x, normal.y), std::abs(normal.z))));
  });
  add_column(surface, {.name = "slope", .unit = "deg", .of = LayerColumn::Of::Cells}, slope);
}

void limit_triangles(Layer& surface, std::size_t triangles) {
  const std::size_t all = surface.triangles();
  if (all <= triangles) return;
  surface.data = thin_triangles(surface, triangles);
  surface.facts.push_back(fmt::format("shown with {} of {} triangles", surface.triangles(), all));
}

}  // namespace groundray
