#include "reconstruction/pipeline/mesh_pipeline.h"

#include <algorithm>
#include <cstddef>
#include <glm/geometric.hpp>
#include <span>
#include <utility>

#include "core/error.h"
#include "reconstruction/mesh/scan/advancing_front.h"

namespace groundray {
namespace {

double median_edge_m(std::span<const ScanMesh> scans) {
  std::vector<double> edges_m;
  for (const ScanMesh& scan : scans) {
    const TriangleMesh& mesh = scan.mesh.shape;
    for (const glm::uvec3& t : mesh.triangles)
      edges_m.push_back(glm::distance(mesh.vertices_m[t.x], mesh.vertices_m[t.y]));
  }
  if (edges_m.empty()) return 0;
  const auto middle = edges_m.begin() + static_cast<std::ptrdiff_t>(edges_m.size() / 2);
  std::ranges::nth_element(edges_m, middle);
  return *middle;
}

double area_of(const TriangleMesh& mesh) {
  double twice_m2 = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices_m[t.x];
    twice_m2 += glm::length(glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a));
  }
  return twice_m2 / 2;
}

void merge_scans(std::span<const ScanMesh> scans, const MeshBuildOptions& options,
                 const PipelineControl& control, MeshResult& result) {
  MergeLimits limits = options.merging;
  if (options.apart_m) {
    limits.apart_m = *options.apart_m;
  } else if (scans.size() > 1 && std::ranges::none_of(scans, knows_noise, &ScanMesh::mesh)) {
    limits.apart_m = options.spacing_share * median_edge_m(scans);
    result.spacing_m = limits.apart_m;
  }
  const auto step = [&](const RunControl& work) { return merge(scans, limits, work); };
  MergedMesh merged =
      scans.size() == 1 ? step({}) : run_stage({"merge", "merging"}, control, result.seconds, step);
  result.mesh = std::move(merged.mesh);
  result.merged = merged.counts;
}

void finish(const MeshBuildOptions& options, const PipelineControl& control, MeshResult& result) {
  if (options.fill_m) {
    result.holes =
        run_stage({"fill", "filling"}, control, result.seconds, [&](const RunControl& work) {
          return fill_holes(std::move(result.mesh), {.longest_m = *options.fill_m}, work);
        });
    result.mesh = std::move(result.holes->mesh);
  }
  result.full_triangles = result.mesh.shape.triangles.size();
  if (options.stop) {
    result.simplified = run_stage(
        {"simplify", "simplifying"}, control, result.seconds, [&](const RunControl& work) {
          return simplify(result.mesh, *options.stop, options.simplify, work);
        });
    result.mesh = std::move(result.simplified->mesh);
  }
  result.area_m2 = area_of(result.mesh.shape);
}

}  // namespace

bool knows_noise(const MeasuredMesh& mesh) {
  return std::ranges::any_of(mesh.sd_m, [](float sd_m) { return sd_m > 0; });
}

MeshResult build_mesh(std::vector<ScanMesh> scans, const MeshBuildOptions& options,
                      const PipelineControl& control) {
  std::erase_if(scans, [](const ScanMesh& scan) { return scan.mesh.shape.triangles.empty(); });
  MeshResult result{.mesh = {}, .merged_scans = scans.size()};
  if (scans.empty()) return result;
  merge_scans(scans, options, control, result);
  scans = {};
  finish(options, control, result);
  return result;
}

MeshResult build_mesh(const UnorderedPoints& points, double perimeter_m,
                      const MeshBuildOptions& options, const PipelineControl& control) {
  const std::size_t count = points.points_m.size();
  Violations broken("UnorderedPoints");
  broken.unless(points.origins_m.size() == count && points.sd_m.size() == count,
                "there are {} points, {} origins_m and {} sd_m: give one for each point", count,
                points.origins_m.size(), points.sd_m.size());
  broken.unless(points.labels.empty() || points.labels.size() == count,
                "there are {} points and {} labels: give one for each point, or none", count,
                points.labels.size());
  broken.throw_if_any();
  MeshResult result;
  FrontMesh joined =
      run_stage({"join", "joining"}, control, result.seconds, [&](const RunControl& work) {
        return advance_front(points.points_m, perimeter_m, points.origins_m, work);
      });
  if (joined.mesh.triangles.empty()) return result;
  for (const std::uint32_t source : joined.sources) {
    result.mesh.sd_m.push_back(points.sd_m[source]);
    if (!points.labels.empty()) result.mesh.labels.push_back(points.labels[source]);
  }
  result.mesh.shape = std::move(joined.mesh);
  finish(options, control, result);
  return result;
}

MeshResult finish_mesh(MeasuredMesh mesh, const MeshBuildOptions& options,
                       const PipelineControl& control) {
  MeshResult result{.mesh = std::move(mesh)};
  finish(options, control, result);
  return result;
}

}  // namespace groundray
