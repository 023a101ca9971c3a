#include "apps/view/ground_colour.h"

#include <tbb/parallel_for.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/srgb.h"

namespace groundray {
namespace {

// Earth is dark; light is as strong as makes it well seen.
constexpr double exposure = 1.6;
constexpr double patch_m = 0.5;  // points stand for so wide a part of the ground

std::optional<Materials::InColour> colours_of(const World& world) {
  if (!world.spec.terrain.material || world.content.materials.all().empty()) return std::nullopt;
  try {
    return world.content.materials.in_colour();
  } catch (const Error&) {
    return std::nullopt;  // its spectra lack what is visible: nobody asked for it
  }
}

glm::dvec3 reflected_at(const GroundCover& cover, const Materials::InColour& colours,
                        const GroundCover::Point& point) {
  if (cover.empty()) return colours.albedos.front();
  const SurfacePatch patch{{patch_m, 0, 0}, {0, patch_m, 0}};
  const GroundCover::Shares shares = cover.shares_at(point);
  glm::dvec3 sum(0);
  for (std::size_t i = 0; i < cover.layers().size(); ++i) {
    if (!(shares[i] > 0)) continue;
    const Tint tint = cover.tint_at(i, point, patch, Filtering::Fast);
    sum += static_cast<double>(shares[i]) *
           glm::dvec3(colours.albedo(cover.layers()[i].material, tint.color));
  }
  return sum;
}

}  // namespace

glm::u8vec3 shown_colour(const glm::dvec3& reflected) {
  glm::u8vec3 bytes;
  for (glm::length_t k = 0; k < 3; ++k) {
    const double light = std::clamp(exposure * reflected[k], 0.0, 1.0);
    bytes[k] = static_cast<std::uint8_t>(std::lround(255 * srgb_of_linear(light)));
  }
  return bytes;
}

void add_ground_colour(Layer& terrain, const World& world) {
  const auto colours = colours_of(world);
  if (!colours || terrain.points() == 0) return;
  const auto places = coordinates(*terrain.data);
  vtkDataArray& normals = *terrain.data->GetPointData()->GetNormals();
  const glm::dvec3 offset = terrain.origin_w_m - world.terrain.header().origin_w_m;
  std::vector<std::uint8_t> rgb(3 * terrain.points());
  tbb::parallel_for(std::size_t{0}, terrain.points(), [&](std::size_t i) {
    GroundCover::Point point;
    point.p_D = offset + glm::dvec3(places[3 * i], places[3 * i + 1], places[3 * i + 2]);
    for (int k = 0; k < 3; ++k)
      point.normal[k] = normals.GetComponent(static_cast<vtkIdType>(i), k);
    const glm::u8vec3 colour = shown_colour(reflected_at(world.content.cover, *colours, point));
    for (std::size_t k = 0; k < 3; ++k) rgb[3 * i + k] = colour[static_cast<glm::length_t>(k)];
  });
  add_colours(terrain, {.name = "colour", .unit = ""}, rgb);
  terrain.coloured_by = "colour";
}

}  // namespace groundray
