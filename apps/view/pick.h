#pragma once

#include <vtkType.h>

#include <cstddef>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>

#include "apps/view/layer.h"

namespace groundray {

/// What a pixel sees, as a camera without a lens.
struct PickRay {
  glm::dvec3 from_w_m{0};
  glm::dvec3 direction{0, 0, -1};  ///< unit
  /// Takes points of W, less `from_w_m`, to pixels: x and y times the depth, and the depth, which
  /// is positive in front; columns as GLM's.
  glm::dmat3 to_pixels{1};
  glm::dvec2 pixel{0};
};

/// What lies under a pixel, in one of several layers.
struct PickedRow {
  std::size_t layer = 0;
  LayerColumn::Of of = LayerColumn::Of::Points;
  vtkIdType row = 0;
  glm::dvec3 p_w_m{0};
};

/// Returns the first triangle of terrain, meshes and pictures that the ray meets, or the point of a
/// cloud that is drawn over the pixel, if no surface hides it: the nearest of those whose square
/// covers the pixel, else the one nearest to it within `near_px`. Of equals the first counts.
std::optional<PickedRow> pick(std::span<const Layer* const> layers, const PickRay& ray,
                              double near_px);

}  // namespace groundray
