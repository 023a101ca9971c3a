#include "reconstruction/mesh/simplify/simplify_original.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "core/error.h"
#include "core/model/model.h"
#include "reconstruction/mesh/simplify/simplify_checks.h"

namespace groundray {
namespace {

// Required by the measurement of the result.
bool has_area(const TriangleMesh& mesh) {
  return std::ranges::any_of(mesh.triangles, [&](const glm::uvec3& t) {
    const glm::dvec3& a_m = mesh.vertices_m[t.x];
    const glm::dvec3 normal = glm::cross(mesh.vertices_m[t.y] - a_m, mesh.vertices_m[t.z] - a_m);
    return glm::length(normal) > 0;
  });
}

float float_at_most(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) > value ? std::nextafter(nearest, 0.0f) : nearest;
}

}  // namespace

SimplifyOriginal::SimplifyOriginal(const MeasuredMesh& mesh)
    : mesh_(mesh), manifold_(cut_to_manifold(mesh.shape)) {
  if (manifold_.shape.triangles.empty()) {
    throw Error("simplify: all {} triangles of the mesh use a vertex twice: there is no surface",
                mesh.shape.triangles.size());
  }
  repairs_ = {
      .dropped_triangles = manifold_.dropped,
      .unused_vertices = mesh.shape.vertices_m.size() + manifold_.copies - manifold_.sources.size(),
      .cut_edges = manifold_.tangled_edges,
      .parted_vertices = manifold_.copies};
  hangs_over_ = overhanging_triangle(manifold_.shape) != none;
  const ModelBounds bounds = bounds_of(manifold_.shape);
  size_m_ = glm::length(bounds.high_m - bounds.low_m);
  // Whole metres, so that a mesh shifted by whole metres gives the same result.
  origin_m_ = glm::round(0.5 * (bounds.low_m + bounds.high_m));
  TriangleMesh local = localised(manifold_.shape);
  if (!has_area(local)) {
    throw Error("simplify: all {} triangles of the mesh are degenerate: there is no surface",
                mesh.shape.triangles.size());
  }
  manifold_.shape.vertices_m = {};
  surface_.emplace(std::move(local));
}

TriangleMesh SimplifyOriginal::localised(TriangleMesh mesh) const {
  for (glm::dvec3& p_m : mesh.vertices_m) p_m -= origin_m_;
  return mesh;
}

Tolerances SimplifyOriginal::equal(double error_m, double border_m) const {
  return {std::vector<float>(sources().size(), float_at_most(error_m)), border_m + rounding_m()};
}

Tolerances SimplifyOriginal::noise(double sds) const {
  Tolerances tolerances{.are_noise = true};
  tolerances.each_m.reserve(sources().size());
  for (const std::uint32_t source : sources())
    tolerances.each_m.push_back(float_at_most(sds * static_cast<double>(mesh_.sd_m[source])));
  return tolerances;
}

DecimationState SimplifyOriginal::state(const SimplifyOptions& options,
                                        const Tolerances& tolerances) const {
  std::vector<std::uint16_t> labels;
  if (options.labels == LabelBorders::Keep && !mesh_.labels.empty()) {
    labels.reserve(sources().size());
    for (const std::uint32_t source : sources()) labels.push_back(mesh_.labels[source]);
  }
  const std::vector<glm::dvec3>& places_m = surface_->mesh().vertices_m;
  CollapsibleMesh mesh(manifold_);
  FeatureLines lines(mesh, places_m, labels, options.crease_rad,
                     tolerances.are_noise ? tolerances.each_m : std::vector<float>());
  std::vector<Sample> samples(places_m.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = {.p_m = places_m[i], .tolerance_m = tolerances.each_m[i]};
  return {std::move(mesh), std::move(lines), std::move(samples)};
}

}  // namespace groundray
