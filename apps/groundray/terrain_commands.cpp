#include "apps/groundray/terrain_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <utility>

#include "apps/scene/interruption.h"
#include "core/io/mesh_io.h"
#include "terrain/dem/dem_file.h"
#include "terrain/lod/certificate.h"
#include "terrain/lod/clipmap.h"
#include "terrain/terrain_mesh.h"

namespace groundray {
namespace {

TriangleMesh place(TerrainMesh mesh, const HeightGrid& grid) {
  TriangleMesh placed{{}, std::move(mesh.triangles), std::move(mesh.levels)};
  placed.vertices_m.reserve(mesh.vertices.size());
  for (const glm::ivec2& sample : mesh.vertices)
    placed.vertices_m.emplace_back(grid.frame().to_D(sample), grid.height_m(sample.x, sample.y));
  return placed;
}

void print_mesh(const TriangleMesh& mesh, const HeightGrid& grid) {
  std::map<int, std::size_t> triangles;
  for (const std::uint8_t level : mesh.levels) ++triangles[level];
  fmt::print("{:>5} {:>10} {:>12}\n", "level", "cell m", "triangles");
  for (const auto& [level, count] : triangles) {
    fmt::print("{:>5} {:>10.6g} {:>12}\n", level,
               std::abs(grid.step_m().x) * static_cast<double>(std::int64_t{1} << level), count);
  }
  const double cells = static_cast<double>(grid.columns() - 1) * (grid.rows() - 1);
  fmt::print("{} triangles ({:.3g} % of full resolution), {} vertices\n", mesh.triangles.size(),
             50 * static_cast<double>(mesh.triangles.size()) / cells, mesh.vertices_m.size());
}

}  // namespace

void mesh_terrain(const std::filesystem::path& path, const DemOptions& options,
                  const MeshRequest& request, const std::filesystem::path& out) {
  const Dem dem = load_dem(path, options);
  SensorBox sensors;
  if (request.viewpoint) sensors.low_m = sensors.high_m = *request.viewpoint - dem.origin_w_m;
  const MeshBound bound =
      bound_from(sensors, dem.grid.frame(), request.max_error_m, request.angle_rad);
  const TriangleMesh mesh = place(build_terrain_mesh(dem.grid, bound), dem.grid);
  stop_if_interrupted();
  write_mesh(out, mesh, {dem.origin_w_m, dem.crs_name, dem.crs_wkt});
  print_mesh(mesh, dem.grid);
  fmt::print("written to {}\n", out.string());
}

void certify_terrain(const std::filesystem::path& path, const DemOptions& options) {
  const DemFile dem(path, options);
  Certifying progress;
  const Certificate certificate =
      Certificate::open_or_make(dem, {.progress = [&](double share) { progress.update(share); }});
  const double step_m = std::abs(dem.header().step_m.x);
  fmt::print("{:>5} {:>10} {:>12} {:>10} {:>10} {:>14} {:>15}\n", "level", "cell m", "nodes",
             "holed", "empty", "max deviation m", "mean deviation m");
  for (std::size_t level = 0; level < certificate.levels().size(); ++level) {
    const LevelSummary& summary = certificate.levels()[level];
    fmt::print("{:>5} {:>10.6g} {:>12} {:>10} {:>10} {:>14.6g} {:>15.6g}\n", level,
               step_m * static_cast<double>(std::int64_t{1} << level), summary.nodes, summary.mixed,
               summary.empty, summary.max_deviation_m, summary.mean_deviation_m);
  }
  fmt::print("certificate: {}\n", certificate.folder().string());
}

}  // namespace groundray
