#include "apps/groundray/mesh/rebuild_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "apps/groundray/result_files.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "reconstruction/mesh/measured_mesh_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

void check_mesh_name(const fs::path& path) {
  static constexpr std::array<std::string_view, 4> endings{".ply", ".obj", ".stl", ".glb"};
  if (std::ranges::find(endings, file_ending(path)) == endings.end())
    throw Error("{}: the name of a mesh must end in .ply, .obj, .stl or .glb", path.string());
}

// Writes occlusion faces; a .ply has the origin of the beam at each vertex.
void write_occlusion(const fs::path& path, const OcclusionFaces& faces,
                     const Georeference& georeference) {
  if (file_ending(path) != ".ply")
    return write_measured_mesh(path, {.shape = faces.shape}, georeference);
  MeshColumns columns{.vertices = PointCloud(faces.origins_m.size())};
  for (int axis = 0; axis < 3; ++axis) {
    const auto values = columns.vertices.add<double>(fmt::format("origin_{}", "xyz"[axis]));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = faces.origins_m[i][axis];
  }
  write_ply(path, faces.shape, georeference, columns);
}

}  // namespace

void check_output(const RebuildOutput& output, std::span<const fs::path> inputs) {
  check_mesh_name(output.mesh);
  if (output.occlusion) check_mesh_name(*output.occlusion);
  std::vector<fs::path> results{output.mesh};
  if (output.occlusion) results.push_back(*output.occlusion);
  if (output.report) results.push_back(*output.report);
  check_results(results, inputs);
}

void write_output(const RebuildOutput& output, const MeasuredMesh& mesh,
                  const OcclusionFaces& occlusion, const RebuildReport& report) {
  ResultFiles files;
  if (output.occlusion) {
    files.write(*output.occlusion, [&](const fs::path& path) {
      write_occlusion(path, occlusion, report.georeference);
    });
  }
  if (output.report)
    files.write(*output.report, [&](const fs::path& path) { write_json(path, report); });
  files.write(output.mesh,
              [&](const fs::path& path) { write_measured_mesh(path, mesh, report.georeference); });
  files.appear();
}

}  // namespace groundray
