#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "apps/groundray/command.h"
#include "apps/groundray/progress_stage.h"
#include "apps/groundray/result_files.h"
#include "apps/scene/interruption.h"
#include "core/io/mesh_io.h"
#include "core/io/print_error.h"
#include "reconstruction/pipeline/terrain_decimation.h"
#include "terrain/dem/dem_file.h"
#include "terrain/dem/dem_io.h"
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
  const double cells = static_cast<double>(grid.columns() - 1) * (grid.rows() - 1);
  const auto print_sum = [&] {
    print_text(stdout, "{} triangles ({:.3g} % of full resolution), {} vertices\n",
               mesh.triangles.size(), 50 * static_cast<double>(mesh.triangles.size()) / cells,
               mesh.vertices_m.size());
  };
  if (mesh.levels.empty()) return print_sum();
  std::map<int, std::size_t> triangles;
  for (const std::uint8_t level : mesh.levels) ++triangles[level];
  print_text(stdout, "{:>5} {:>10} {:>12}\n", "level", "cell m", "triangles");
  for (const auto& [level, count] : triangles) {
    print_text(stdout, "{:>5} {:>10.6g} {:>12}\n", level,
               std::abs(grid.step_m().x) * static_cast<double>(std::int64_t{1} << level), count);
  }
  print_sum();
}

// Options of the commands for a DEM.
struct TerrainOptions {
  std::filesystem::path dem, out;
  DemOptions reading;
  double max_error_m = 0;  // vertical error permitted everywhere
  double angle_mrad = 0;   // angle permitted as well, as seen from the viewpoint
  std::vector<double> viewpoint_w_m;
  bool fewest = false;  // collapse edges instead of selecting nodes
  std::size_t most_bytes = machine_bytes();

  void add_dem(CLI::App* command) {
    command->add_option("DEM", dem, "Raster of heights (GeoTIFF, VRT, HGT, ...)")->required();
    command->add_option("--nodata", reading.nodata,
                        "Additional nodata value, besides the one that the file declares");
    command->add_option("--reproject-to", reading.reproject_to,
                        "A CRS to warp to, such as EPSG:32631, or utm for the zone that fits");
  }

  CLI::App* add_mesh(CLI::App* terrain) {
    CLI::App* command = terrain->add_subcommand(
        "mesh", "Write a DEM as a mesh without cracks, within an error bound");
    add_dem(command);
    command->add_option("-o,--output", out, "Mesh to write: .ply (doubles), .obj, .stl or .glb")
        ->required();
    command
        ->add_option("--max-error-m", max_error_m,
                     "Largest vertical distance from the DEM's surface, anywhere")
        ->required()
        ->check(not_negative());
    auto* angle =
        add_number(command, "--angle-mrad", angle_mrad, not_negative(),
                   "Permitted angle in milliradians, seen from --viewpoint, where that is larger");
    auto* from = command->add_option("--viewpoint", viewpoint_w_m, "X,Y,Z in the DEM's CRS, metres")
                     ->delimiter(',')
                     ->expected(3)
                     ->needs(angle);
    angle->needs(from);
    command
        ->add_flag("--fewest", fewest,
                   "Collapse edges of the full resolution: far fewer triangles where the ground is "
                   "rough, of any shape, in some twenty times the time")
        ->excludes(angle);
    add_memory(command, most_bytes, "Limit of memory for --fewest (what the machine has)");
    return command;
  }

  CLI::App* add_certify(CLI::App* terrain) {
    CLI::App* command = terrain->add_subcommand(
        "certify",
        "Compute the deviation of each node of the DEM's quadtree, store it beside the DEM, and "
        "print a summary; `generate` uses it for DEMs larger than memory");
    add_dem(command);
    return command;
  }

  // Converts the DEM to a mesh, writes it, and prints its size.
  void mesh() const {
    check_results({&out, 1}, {&dem, 1});
    const Dem read = load_dem(dem, reading);
    const TriangleMesh mesh = place(fewest ? few_triangles(read.grid) : nodes(read), read.grid);
    stop_if_interrupted();
    ResultFiles files;
    files.write(out, [&](const std::filesystem::path& path) {
      write_mesh(path, mesh, {read.origin_w_m, read.crs_name, read.crs_wkt});
    });
    print_mesh(mesh, read.grid);
    files.appear();
  }

  TerrainMesh nodes(const Dem& read) const {
    SensorBox sensors;
    if (const auto& p = viewpoint_w_m; !p.empty())
      sensors.low_m = sensors.high_m = glm::dvec3(p[0], p[1], p[2]) - read.origin_w_m;
    return build_terrain_mesh(
        read.grid, bound_from(sensors, read.grid.frame(), max_error_m, angle_mrad / 1000));
  }

  TerrainMesh few_triangles(const HeightGrid& grid) const {
    StageProgress progress;
    const RunControl control{
        .progress = [&](double share) { progress.update("collapsing edges", share); },
        .most_bytes = most_bytes};
    DecimatedTerrain result = decimate_terrain(grid, max_error_m, control);
    const judge::MeshDeviation& deviation = result.deviation;
    print_text(stdout, "largest deviation {:.6g} m, at column {:.6g}, row {:.6g}\n",
               deviation.largest_m, deviation.place.x, deviation.place.y);
    return std::move(result.mesh);
  }

  // Certifies the DEM, unless there is a certificate, and prints the deviations of each level.
  void certify() const {
    const DemFile file(dem, reading);
    Certifying progress;
    const Certificate certificate = Certificate::open_or_make(
        file, {.progress = [&](double share) { progress.update(share); }});
    const double step_m = std::abs(file.header().step_m.x);
    print_text(stdout, "{:>5} {:>10} {:>12} {:>10} {:>10} {:>14} {:>15}\n", "level", "cell m",
               "nodes", "holed", "empty", "max deviation m", "mean deviation m");
    for (std::size_t level = 0; level < certificate.levels().size(); ++level) {
      const LevelSummary& summary = certificate.levels()[level];
      print_text(stdout, "{:>5} {:>10.6g} {:>12} {:>10} {:>10} {:>14.6g} {:>15.6g}\n", level,
                 step_m * static_cast<double>(std::int64_t{1} << level), summary.nodes,
                 summary.mixed, summary.empty, summary.max_deviation_m, summary.mean_deviation_m);
    }
    print_text(stdout, "certificate: {}\n", certificate.folder().string());
  }
};

}  // namespace

void add_terrain_commands(CLI::App& app, std::vector<Command>& commands) {
  auto* terrain = app.add_subcommand("terrain", "Work on a DEM");
  terrain->require_subcommand(1);
  const auto options = std::make_shared<TerrainOptions>();
  commands.push_back({options->add_mesh(terrain), [options] { options->mesh(); }});
  commands.push_back({options->add_certify(terrain), [options] { options->certify(); }});
  commands.push_back(add_fill_command(*terrain));
}

}  // namespace groundray
