#include "apps/view/layers/ground_colour.h"

#include <tbb/parallel_for.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/srgb.h"

namespace groundray {
namespace {

// Natural ground is dark, so it is displayed brighter.
constexpr double exposure = 1.6;
constexpr double point_patch_m = 0.5;  // width of the ground patch that a point represents

}  // namespace

glm::u8vec3 shown_colour(const glm::dvec3& reflected) {
  glm::u8vec3 bytes;
  for (glm::length_t k = 0; k < 3; ++k) {
    const double light = std::clamp(exposure * reflected[k], 0.0, 1.0);
    bytes[k] = static_cast<std::uint8_t>(std::lround(255 * srgb_of_linear(light)));
  }
  return bytes;
}

std::optional<Materials::InColour> material_colours(const Simulation& simulation) {
  if (simulation.scene_objects.materials.all().empty()) return std::nullopt;
  try {
    return simulation.scene_objects.materials.in_colour();
  } catch (const Error&) {
    return std::nullopt;  // colour is optional here
  }
}

std::optional<GroundColour> GroundColour::of(const Simulation& simulation) {
  if (!simulation.spec.terrain.material) return std::nullopt;
  auto colours = material_colours(simulation);
  if (!colours) return std::nullopt;
  return GroundColour(simulation.scene_objects.cover, std::move(*colours));
}

glm::u8vec3 GroundColour::shown_at(const GroundCover::Point& point, double patch_m) const {
  return shown_colour(reflected_at(point, patch_m));
}

glm::dvec3 GroundColour::reflected_at(const GroundCover::Point& point, double patch_m) const {
  if (cover_->empty()) return colours_.albedos.front();
  const SurfacePatch patch{{patch_m, 0, 0}, {0, patch_m, 0}};
  const GroundCover::Shares shares = cover_->shares_at(point);
  glm::dvec3 sum(0);
  for (std::size_t i = 0; i < cover_->layers().size(); ++i) {
    if (!(shares[i] > 0)) continue;
    const Tint tint = cover_->tint_at(i, point, patch, Filtering::Fast);
    sum += static_cast<double>(shares[i]) *
           glm::dvec3(colours_.albedo(cover_->layers()[i].material, tint.color));
  }
  return sum;
}

void add_ground_colour(Layer& terrain, const Simulation& simulation) {
  const auto colours = GroundColour::of(simulation);
  if (!colours || terrain.points() == 0) return;
  const auto places = coordinates(*terrain.data);
  vtkDataArray& normals = *terrain.data->GetPointData()->GetNormals();
  const glm::dvec3 offset = terrain.origin_w_m - simulation.terrain.header().origin_w_m;
  std::vector<std::uint8_t> rgb(3 * terrain.points());
  tbb::parallel_for(std::size_t{0}, terrain.points(), [&](std::size_t i) {
    glm::dvec3 normal;
    normals.GetTuple(static_cast<vtkIdType>(i), &normal.x);
    const glm::u8vec3 colour = colours->shown_at(
        GroundCover::on_facet(offset + point_at(places, i), normal), point_patch_m);
    for (std::size_t k = 0; k < 3; ++k) rgb[3 * i + k] = colour[static_cast<glm::length_t>(k)];
  });
  add_colours(terrain, {.name = "colour", .unit = ""}, rgb);
  terrain.coloured_by = "colour";
}

}  // namespace groundray
