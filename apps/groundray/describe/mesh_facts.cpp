#include <fmt/format.h>
#include <fmt/ranges.h>

#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "apps/groundray/describe/file_facts.h"
#include "apps/groundray/describe/mesh_topology.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/model/mesh_reader.h"
#include "core/model/model_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

std::string topology_text(const MeshTopology& topology) {
  if (topology.is_closed()) return fmt::format("closed, volume {:.6g} m3", topology.volume_m3);
  return fmt::format(
      "not closed: {} boundary edges, {} of three triangles or more{}", topology.boundary_edges,
      topology.non_manifold_edges,
      topology.reversed_edges == 0
          ? ""
          : fmt::format(", {} between triangles of opposite orientation", topology.reversed_edges));
}

// The properties of a PLY file's vertices; other formats have positions, normals and uv only.
void add_properties(const fs::path& file, Facts& facts) {
  const StoredMesh stored = read_stored_mesh(file);
  std::vector<std::string> names;
  for (const PointCloud::Column& column : stored.vertices.columns()) names.push_back(column.name);
  facts.emplace_back("vertices",
                     fmt::format("{} in the file, with {}", stored.mesh.vertices_m.size(),
                                 fmt::join(names, ", ")));
}

std::string image_text(const ModelImage& image) {
  return image.file.empty()
             ? fmt::format("embedded, {} x {} px", image.pixels.width(), image.pixels.height())
             : image.file.filename().string();
}

std::string surface_text(const ModelSurface& surface) {
  std::string text = surface.name.empty() ? "(without a name)" : surface.name;
  for (const auto& [name, image] :
       {std::pair("albedo", &surface.albedo), std::pair("normal", &surface.normal),
        std::pair("opacity", &surface.opacity)}) {
    if (image->exists()) text += fmt::format(", {}: {}", name, image_text(*image));
  }
  return text;
}

// What a scene would have of the file as a model. Meshes without it are still meshes.
void add_model(const fs::path& file, Facts& facts) {
  try {
    const auto [model, dropped, skipped, rounding_m] = read_model(file, {});
    facts.emplace_back("model", fmt::format("{} uv, {} normals", model.uv.empty() ? "no" : "with",
                                            model.normals.empty() ? "no" : "with"));
    for (const ModelSurface& surface : model.surfaces)
      facts.emplace_back("surface", surface_text(surface));
  } catch (const Error& fault) {
    facts.emplace_back("model", fmt::format("a scene cannot use it: {}", fault.what()));
  }
}

}  // namespace

Facts mesh_facts(const fs::path& file) {
  const MeshFile read = read_mesh(file);
  const MeshTopology topology = topology_of(read.mesh);
  const ModelBounds bounds = bounds_of(read.mesh);
  const glm::dvec3 size_m = bounds.high_m - bounds.low_m;
  Facts facts{{"kind", "mesh, " + file_ending(file).substr(1)},
              {"triangles", fmt::format("{} at {} positions", read.mesh.triangles.size(),
                                        read.mesh.vertices_m.size())},
              {"bounds", fmt::format("({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g}) m",
                                     bounds.low_m.x, bounds.low_m.y, bounds.low_m.z,
                                     bounds.high_m.x, bounds.high_m.y, bounds.high_m.z)},
              {"size", fmt::format("{:.6g} x {:.6g} x {:.6g} m", size_m.x, size_m.y, size_m.z)},
              {"area", fmt::format("{:.6g} m2", topology.area_m2)},
              {"surface", topology_text(topology)}};
  if (const Georeference& place = read.georeference; place.origin_w_m != glm::dvec3(0))
    facts.emplace_back("origin", fmt::format("({}, {}, {}) m{}{}", place.origin_w_m.x,
                                             place.origin_w_m.y, place.origin_w_m.z,
                                             place.crs_name.empty() ? "" : " in ", place.crs_name));
  if (read.dropped > 0) facts.emplace_back("broken", fmt::format("{} polygons", read.dropped));
  if (read.skipped > 0)
    facts.emplace_back("omitted", fmt::format("{} points, lines or patches", read.skipped));
  if (file_ending(file) == ".ply") add_properties(file, facts);
  add_model(file, facts);
  return facts;
}

}  // namespace groundray
