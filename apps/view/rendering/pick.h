#pragma once

#include <vtkType.h>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>

#include "apps/view/rendering/clip_box.h"
#include "apps/view/rendering/layer.h"

namespace groundray {

/// Line of sight of a pixel in a view with central projection.
struct PickRay {
  glm::dvec3 from_w_m{0};
  glm::dvec3 direction{0, 0, -1};  ///< unit
  /// Maps p_w - from_w_m to (x * depth, y * depth, depth), with x and y in pixels and the depth
  /// positive in front of the eye; column-major, as in GLM.
  glm::dmat3 to_pixels{1};
  glm::dvec2 pixel{0};
};

/// Element of a layer under a pixel.
struct Picked {
  std::string layer;
  LayerColumn::Of of = LayerColumn::Of::Points;
  vtkIdType row = 0;  ///< index of the point or cell in the layer's data
  glm::dvec3 p_w_m{0};
};

/// Returns the point of a cloud that is drawn over the pixel, unless a surface hides it; otherwise
/// the first triangle of terrain, meshes and pictures that the ray hits. Among several points, the
/// nearest to the eye whose square covers the pixel is chosen; if none does, the nearest to the
/// pixel within `near_px`. Ties go to the first. Invisible layers are ignored, as are points
/// outside `clip` of layers that are clipped.
std::optional<Picked> pick(std::span<const Layer* const> layers, const PickRay& ray, double near_px,
                           const std::optional<ClipBox>& clip = std::nullopt);

/// Returns the corner of the picked triangle that appears nearest to the pixel, as a point of the
/// layer, if it is within `near_px`; otherwise `picked`.
/// @param layer  layer of `picked`.
Picked near_vertex(const Layer& layer, const Picked& picked, const PickRay& ray, double near_px);

}  // namespace groundray
