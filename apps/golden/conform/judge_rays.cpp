#include "apps/golden/conform/judge_rays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "apps/golden/conform/judge_mesh.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

constexpr double most_excused = 0.05;  // share of the rays that differ at silhouettes

// Reads ranges of either precision.
std::vector<double> read_ranges(const ArrayFolder& folder, std::uint64_t count, bool is_float) {
  if (!is_float) return folder.read<double>("rays/range_m", {count}).values;
  const auto ranges = folder.read<float>("rays/range_m", {count}).values;
  return {ranges.begin(), ranges.end()};
}

// Returns the cosine of incidence of a direction on a triangle.
double cosine_of(const HeightGrid& grid, const TerrainMesh& mesh, std::int32_t triangle,
                 const glm::dvec3& direction) {
  const glm::uvec3& t = mesh.triangles[static_cast<std::size_t>(triangle)];
  const auto point_m = [&](unsigned vertex) {
    const glm::ivec2 at = mesh.vertices[vertex];
    return glm::dvec3(grid.frame().to_D(at), grid.height_m(at.x, at.y));
  };
  const glm::dvec3 a = point_m(t.x);
  const glm::dvec3 normal = glm::cross(point_m(t.y) - a, point_m(t.z) - a);
  return std::abs(glm::dot(glm::normalize(normal), direction));
}

// Returns whether two triangles share a vertex.
bool meet(const TerrainMesh& mesh, std::int32_t one, std::int32_t other) {
  if (one < 0 || other < 0) return false;
  const glm::uvec3& a = mesh.triangles[static_cast<std::size_t>(one)];
  const glm::uvec3& b = mesh.triangles[static_cast<std::size_t>(other)];
  for (int k = 0; k < 3; ++k) {
    if (a[k] == b.x || a[k] == b.y || a[k] == b.z) return true;
  }
  return false;
}

// Reads the triangles that rays hit.
std::vector<std::int32_t> read_triangles(const ArrayFolder& folder, std::uint64_t count,
                                         const TerrainMesh& mesh) {
  auto triangles = folder.read<std::int32_t>("rays/triangle", {count}).values;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const std::int32_t triangle = triangles[i];
    if (triangle >= -1 && triangle < std::ssize(mesh.triangles)) continue;
    throw Error("{}: ray {} hits triangle {}, but there are {}",
                (folder.path() / "rays/triangle.npy").string(), i, triangle, mesh.triangles.size());
  }
  return triangles;
}

}  // namespace

Section judge_rays(const PassFolder& ours, const ArrayFolder& theirs, const RayBudget& budget) {
  Section section{.title = "rays: ranges within the budget, on the same triangles"};
  const TerrainMesh mesh = read_sample_mesh(ours.grid, ours.arrays);
  const auto a_m = ours.arrays.read<double>("rays/range_m", {any}, std::uint64_t{1} << 32);
  const std::uint64_t count = a_m.rows();
  const auto a_triangle = read_triangles(ours.arrays, count, mesh);
  const auto directions = ours.arrays.read<double>("rays/direction", {count, 3});
  const auto silhouette_m = ours.arrays.read<double>("rays/silhouette_m", {count});
  const auto edge_m = ours.arrays.read<double>("rays/edge_m", {count});
  const auto b_m = read_ranges(theirs, count, budget.moves_rays);
  const auto b_triangle = read_triangles(theirs, count, mesh);
  double unexplained = 0, beside = 0, at_silhouettes = 0, too_far = 0, hits = 0;
  double worst = 0, worst_m = 0;
  std::vector<double> errors_m;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t a = a_triangle[i], b = b_triangle[i];
    hits += a >= 0 ? 1 : 0;
    if ((b >= 0) != (b_m[i] < std::numeric_limits<double>::infinity()) || b_m[i] < 0) {
      throw Error("{}: ray {} has the range {} m and the triangle {}; a miss is inf and -1",
                  (theirs.path() / "rays/range_m.npy").string(), i, b_m[i], b);
    }
    if (a != b && silhouette_m.values[i] < budget.delta_m) {
      ++at_silhouettes;
      continue;
    }
    if (a != b && (!(edge_m.values[i] < budget.delta_m) || !meet(mesh, a, b))) {
      ++unexplained;
      continue;
    }
    beside += a != b ? 1 : 0;
    if (a < 0) continue;
    const glm::dvec3 direction(directions.values[3 * i], directions.values[3 * i + 1],
                               directions.values[3 * i + 2]);
    double limit_m = budget.absolute_m + budget.relative * a_m.values[i];
    if (budget.moves_rays) {
      const double cosine = std::min(cosine_of(ours.grid, mesh, a, direction),
                                     cosine_of(ours.grid, mesh, b, direction));
      limit_m += budget.delta_m / std::max(cosine, 1e-9);
    }
    const double error_m = std::abs(b_m[i] - a_m.values[i]);
    errors_m.push_back(b_m[i] - a_m.values[i]);
    too_far += error_m > limit_m ? 1 : 0;
    worst = std::max(worst, error_m / limit_m);
    worst_m = std::max(worst_m, error_m);
  }
  hold(section, "other triangles away from edges and silhouettes", unexplained, "rays", 0,
       fmt::format("these may differ only where one is nearer than {} m, the stated delta_m",
                   budget.delta_m));
  hold(section, "ranges beyond the budget", too_far, "rays", 0,
       fmt::format("{} m + {} of the range{}", budget.absolute_m, budget.relative,
                   budget.moves_rays ? ", and delta_m over the cosine of incidence" : ""));
  tell(section, "largest error as a fraction of its budget", worst);
  tell(section, "largest error", worst_m, "m");
  hold(section, "other triangles at a silhouette", at_silhouettes, "rays",
       most_excused * static_cast<double>(count),
       "with more, delta_m is too large for a verdict: 5 % of the rays");
  tell(section, "other triangles at an edge", beside, "rays");
  tell(section, "rays", static_cast<double>(count), "rays");
  tell(section, "hits", hits, "rays");
  const double reach_m = std::max(worst_m, 1e-12);
  section.histograms.push_back(histogram_of("Errors of ranges", "m", errors_m, -reach_m, reach_m));
  return section;
}

}  // namespace groundray::golden
