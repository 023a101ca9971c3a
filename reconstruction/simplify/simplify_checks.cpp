#include "reconstruction/simplify/simplify_checks.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/mesh_check.h"
#include "reconstruction/manifold_mesh.h"
#include "reconstruction/simplify/plan_area.h"

namespace groundray {
namespace {

/// Notes the faults of each kind of halt.
struct HaltCheck {
  Violations& broken;
  const MeasuredMesh& mesh;

  void check_bound(double error_m, double border_m) const {
    broken.unless(error_m > 0 && std::isfinite(error_m), "error_m = {} must be positive", error_m);
    broken.unless(border_m >= 0 && std::isfinite(border_m), "border_m = {} must not be negative",
                  border_m);
  }
  void operator()(const VerticalBound& halt) const { check_bound(halt.error_m, halt.border_m); }
  void operator()(const DistanceBound& halt) const { check_bound(halt.error_m, halt.border_m); }
  void operator()(const FaceBudget& halt) const {
    broken.unless(halt.triangles > 0, "triangles = 0: a budget must be at least 1");
  }
  void operator()(const NoiseBound& halt) const {
    broken.unless(halt.sds > 0 && std::isfinite(halt.sds), "sds = {} must be positive", halt.sds);
    broken.unless(!mesh.sd_m.empty(),
                  "the mesh has no standard deviations (sd_m) to tell noise by: give it them, or a "
                  "bound in metres");
  }
  void operator()(const CostKnee&) const {}
};

template <typename Value>
void check_column(Violations& broken, const std::vector<Value>& column, const char* name,
                  const MeasuredMesh& mesh) {
  broken.unless(column.empty() || column.size() == mesh.shape.vertices_m.size(),
                "{} has {} values, which must be one for each of {} vertices or none", name,
                column.size(), mesh.shape.vertices_m.size());
}

}  // namespace

void check_simplify(const MeasuredMesh& mesh, const Halt& halt, const SimplifyOptions& options) {
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
  std::visit(HaltCheck{broken, mesh}, halt);
  broken.unless(options.crease_rad > 0, "crease_rad = {} must be positive", options.crease_rad);
  const ErrorFineness& fineness = options.fineness;
  broken.unless(fineness.samples > 0 && std::isfinite(fineness.samples),
                "fineness.samples = {} must be positive", fineness.samples);
  broken.unless(fineness.largest_share > 0 && fineness.largest_share < 1,
                "fineness.largest_share = {} must be between 0 and 1", fineness.largest_share);
  constexpr std::size_t most_triangles = 1'400'000'000;
  broken.unless(mesh.shape.triangles.size() < most_triangles,
                "{} triangles must be fewer than {}: part the mesh", mesh.shape.triangles.size(),
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
      "simplify: triangle {} at ({}, {}, {}) hangs over: seen from above its corners must be "
      "counter-clockwise for a bound of heights; bound distances in any direction instead",
      triangle, p_m.x, p_m.y, p_m.z);
}

}  // namespace groundray
