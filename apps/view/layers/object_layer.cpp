#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <optional>

#include "apps/view/layers/cut_out.h"
#include "apps/view/layers/ground_colour.h"
#include "apps/view/layers/mesh_layer.h"
#include "apps/view/layers/scene_layers.h"
#include "apps/view/rendering/colour_table.h"
#include "apps/view/rendering/picture_file.h"

namespace groundray {
namespace {

struct Shown {
  std::uint32_t number = 0;  // of the instance, of which this is all or a part
  PlacedObject place;
  Lean lean;
};

// Returns the objects nearest to a point, at least one, within a number of triangles; ordered by
// number.
std::vector<Shown> nearest(const Simulation& simulation, const SceneObjects::Group& group,
                           std::chrono::nanoseconds time, const glm::dvec3& near_m,
                           std::size_t most_triangles) {
  std::vector<Shown> all;
  const ObjectTracer& objects = simulation.scene_objects.objects;
  for (std::uint32_t i = 0; i < group.count; ++i) {
    const ObjectRange parts = objects.parts_of(group.first + i);
    for (std::uint32_t k = 0; k < parts.count; ++k)
      all.push_back({group.first + i, objects.placed_at(parts.first + k, time),
                     objects.lean(parts.first + k, time)});
  }
  const auto distance = [&](const Shown& one) {
    return glm::length(glm::dvec2(one.place.p_DO - near_m));
  };
  std::ranges::stable_sort(all, {}, distance);
  std::size_t triangles = 0, kept = 0;
  for (; kept < all.size(); ++kept) {
    const ModelScene& model = simulation.scene_objects.objects.models()[all[kept].place.model];
    triangles += model.model().mesh.triangles.size();
    if (triangles > most_triangles && kept > 0) break;
  }
  all.resize(kept);
  std::ranges::sort(all, {}, &Shown::number);
  return all;
}

std::size_t count_of(const std::vector<Shown>& shown) {  // ordered by number
  std::size_t count = 0;
  for (std::size_t i = 0; i < shown.size(); ++i)
    count += i == 0 || shown[i].number != shown[i - 1].number ? 1 : 0;
  return count;
}

// Mesh of several objects, with values of each triangle and texture coordinates of each vertex.
struct Shapes {
  TriangleMesh mesh;
  std::vector<float> label, instance;
  std::vector<std::uint8_t> rgb;
  std::vector<glm::vec2> mask_uv;
};

glm::dvec3 colour_of(const Simulation& simulation,
                     const std::optional<Materials::InColour>& colours, std::uint32_t model,
                     std::uint16_t surface) {
  const ModelTruth& truth = simulation.scene_objects.models[model];
  if (colours && surface < truth.materials.size() &&
      truth.materials[surface] < colours->albedos.size())
    return glm::dvec3(colours->albedos[truth.materials[surface]]);
  return 0.4 * colour_of_kind(truth.label);
}

void add_model(const Simulation& simulation, const Shown& shown,
               const std::optional<Materials::InColour>& colours, const CutOuts& cut_outs,
               Shapes& shapes) {
  const Model& model = simulation.scene_objects.objects.models()[shown.place.model].model();
  TriangleMesh& mesh = shapes.mesh;
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  for (const glm::dvec3& p : model.mesh.vertices_m) {
    const glm::dvec3 upright = shown.place.R_DO * (shown.place.scale * p);
    mesh.vertices_m.push_back(shown.place.p_DO + shown.lean.leaning(upright));
  }
  shapes.mask_uv.resize(mesh.vertices_m.size(), cut_outs.opaque());
  for (std::uint32_t i = 0; i < model.mesh.triangles.size(); ++i) {
    glm::uvec3 corner = model.mesh.triangles[i] + first;
    if (const auto uv = cut_outs.corners(shown.place.model, i)) {
      // Copies: a vertex may be shared with triangles that are not cut out.
      for (glm::length_t k = 0; k < 3; ++k) {
        const glm::dvec3 p_m = mesh.vertices_m[corner[k]];
        mesh.vertices_m.push_back(p_m);
        shapes.mask_uv.push_back((*uv)[static_cast<std::size_t>(k)]);
        corner[k] = static_cast<std::uint32_t>(mesh.vertices_m.size() - 1);
      }
    }
    mesh.triangles.push_back(corner);
    const glm::u8vec3 rgb =
        shown_colour(colour_of(simulation, colours, shown.place.model, model.surface_of[i]));
    for (glm::length_t k = 0; k < 3; ++k) shapes.rgb.push_back(rgb[k]);
  }
  const std::size_t count = mesh.triangles.size();
  shapes.label.resize(count,
                      static_cast<float>(simulation.scene_objects.models[shown.place.model].label));
  shapes.instance.resize(count, static_cast<float>(shown.number));
}

// Returns the masks of the models that are shown.
CutOuts cut_outs_of(const Simulation& simulation, const std::vector<Shown>& shown) {
  static const Model unused;
  std::vector<const Model*> models(simulation.scene_objects.objects.models().size(), &unused);
  for (const Shown& one : shown)
    models[one.place.model] = &simulation.scene_objects.objects.models()[one.place.model].model();
  return CutOuts(models);
}

}  // namespace

Layer object_layer(const Simulation& simulation, std::size_t group, std::chrono::nanoseconds time,
                   const glm::dvec3& near_m, std::size_t most_triangles) {
  const SceneObjects::Group& entry = simulation.scene_objects.groups.at(group);
  const auto colours = material_colours(simulation);
  const std::vector<Shown> shown = nearest(simulation, entry, time, near_m, most_triangles);
  const CutOuts cut_outs = cut_outs_of(simulation, shown);
  Shapes shapes;
  for (const Shown& one : shown) add_model(simulation, one, colours, cut_outs, shapes);
  Layer layer = mesh_layer(fmt::format("objects/{}", entry.name), shapes.mesh,
                           simulation.terrain.header().origin_w_m);
  if (!cut_outs.empty()) {
    set_texture_coordinates(*layer.data, shapes.mask_uv);
    layer.mask = cut_outs.texture();
  }
  constexpr auto of_cells = LayerColumn::Of::Cells;
  add_column(
      layer,
      {.name = "label", .unit = "", .of = of_cells, .categories = {{entry.label, entry.name}}},
      shapes.label);
  add_column(layer, {.name = "instance", .unit = "", .of = of_cells}, shapes.instance);
  add_colours(layer, {.name = "colour", .unit = "", .of = of_cells}, shapes.rgb);
  layer.coloured_by = "colour";
  layer.facts.insert(layer.facts.begin(),
                     fmt::format("{} of {} objects", count_of(shown), entry.count));
  return layer;
}

std::vector<Layer> object_layers(const Simulation& simulation, std::chrono::nanoseconds time,
                                 const glm::dvec3& near_m, std::size_t most_triangles) {
  std::vector<Layer> layers;
  const std::size_t groups = simulation.scene_objects.groups.size();
  for (std::size_t i = 0; i < groups; ++i) {
    layers.push_back(object_layer(simulation, i, time, near_m, most_triangles / (groups - i)));
    most_triangles -= std::min(most_triangles, layers.back().triangles());
  }
  return layers;
}

}  // namespace groundray
