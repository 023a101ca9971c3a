#include "reconstruction/mesh/simplify/simplify_checks.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "reconstruction/mesh/manifold_mesh.h"
#include "reconstruction/mesh/simplify/bounds/plan_area.h"

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

template <typename Value>
void check_column(Violations& broken, const std::vector<Value>& column, const char* name,
                  const MeasuredMesh& mesh) {
  broken.unless(column.empty() || column.size() == mesh.shape.vertices_m.size(),
                "{} has {} values for {} vertices: it must have one per vertex or none", name,
                column.size(), mesh.shape.vertices_m.size());
}

}  // namespace

void check_simplify(const MeasuredMesh& mesh, const StopCriterion& stop,
                    const SimplifyOptions& options) {
  check_mesh(mesh.shape, "mesh to simplify", EmptyMesh::Refuse);
  Violations broken("simplify");
  check_column(broken, mesh.sd_m, "sd_m", mesh);
  check_column(broken, mesh.labels, "labels", mesh);
  check_column(broken, mesh.confidence, "confidence", mesh);
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
  constexpr std::size_t most_triangles = 1'400'000'000;
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

}  // namespace groundray
