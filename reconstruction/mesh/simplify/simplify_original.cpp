#include "reconstruction/mesh/simplify/simplify_original.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/model/model.h"

namespace groundray {
namespace {

/// Checks the parameters of each stopping criterion.
struct HaltCheck {
  Violations& broken;
  const MeasuredMesh& mesh;

  void check_bound(double error_m, double border_m) const {
    broken.unless(error_m > 0 && std::isfinite(error_m), "error_m = {} must be positive", error_m);
    broken.unless(border_m >= 0 && std::isfinite(border_m), "border_m = {} must not be negative",
                  border_m);
  }
  void operator()(const VerticalBound& stop) const { check_bound(stop.error_m, stop.border_m); }
  void operator()(const DistanceBound& stop) const { check_bound(stop.error_m, stop.border_m); }
  void operator()(const FaceBudget& stop) const {
    broken.unless(stop.triangles > 0, "triangles = 0: a budget must be at least 1");
  }
  void operator()(const NoiseBound& stop) const {
    broken.unless(stop.sds > 0 && std::isfinite(stop.sds), "sds = {} must be positive", stop.sds);
    broken.unless(!mesh.sd_m.empty(),
                  "the mesh has no standard deviations (sd_m) for a noise bound: add them, or use "
                  "a bound in metres");
  }
  void operator()(const CostKnee&) const {}
};

// Required by the measurement of the result.
bool has_area(const TriangleMesh& mesh) {
  return std::ranges::any_of(mesh.triangles, [&](const glm::uvec3& t) {
    return glm::length(area_vector_m2(mesh, t)) > 0;
  });
}

float float_at_most(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) > value ? std::nextafter(nearest, 0.0f) : nearest;
}

}  // namespace

void check_simplify(const MeasuredMesh& mesh, const StopCriterion& stop,
                    const SimplifyOptions& options) {
  check_mesh(mesh.shape, "mesh to simplify", EmptyMesh::Refuse);
  Violations broken("simplify");
  check_columns(mesh, broken);
  const auto bad = std::find_if(mesh.sd_m.begin(), mesh.sd_m.end(),
                                [](float sd_m) { return !(sd_m >= 0) || !std::isfinite(sd_m); });
  broken.unless(bad == mesh.sd_m.end(),
                "sd_m of vertex {} is {}, which must be finite and not negative",
                bad - mesh.sd_m.begin(), bad == mesh.sd_m.end() ? 0 : *bad);
  std::visit(HaltCheck{broken, mesh}, stop);
  broken.unless(options.crease_rad > 0, "crease_rad = {} must be positive", options.crease_rad);
  const ErrorFineness& fineness = options.fineness;
  broken.unless(fineness.samples > 0 && std::isfinite(fineness.samples),
                "fineness.samples = {} must be positive", fineness.samples);
  broken.unless(fineness.largest_share > 0 && fineness.largest_share < 1,
                "fineness.largest_share = {} must be between 0 and 1", fineness.largest_share);
  broken.unless(mesh.shape.triangles.size() < most_triangles,
                "{} triangles must be fewer than {}: split the mesh", mesh.shape.triangles.size(),
                most_triangles);
  broken.throw_if_any();
}

std::uint32_t overhanging_triangle(const TriangleMesh& mesh) noexcept {
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3& t = mesh.triangles[i];
    if (t.x == t.y || t.y == t.z || t.z == t.x) continue;
    if (!(twice_plan_area_m2(mesh.vertices_m[t.x], mesh.vertices_m[t.y], mesh.vertices_m[t.z]) > 0))
      return i;
  }
  return none;
}

void refuse_overhang(const TriangleMesh& mesh, std::uint32_t triangle) {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::dvec3& p_m = mesh.vertices_m[t.x];
  throw Error(
      "simplify: triangle {} at ({}, {}, {}) overhangs: for a vertical bound its corners must be "
      "counter-clockwise seen from above; bound distances in any direction instead",
      triangle, p_m.x, p_m.y, p_m.z);
}

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
  return {surface_->mesh(), labels, options.crease_rad, tolerances.each_m,
          tolerances.are_noise ? tolerances.each_m : std::vector<float>()};
}

}  // namespace groundray
