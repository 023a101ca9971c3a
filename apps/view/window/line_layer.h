#pragma once

#include <glm/gtc/type_precision.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "apps/view/rendering/layer.h"
#include "core/geometry/pose.h"

namespace groundray {

/// Polylines that are not joined to each other.
using Lines = std::vector<std::vector<glm::dvec3>>;

/// Style of lines.
struct Pen {
  glm::u8vec3 rgb{255, 255, 255};  ///< sRGB
  double width_px = 2;
};

/// Returns lines of one colour as a layer.
/// @param origin_w_m  origin of D, in W.
/// @param lines_m     in D.
Layer line_layer(const std::string& name, LayerKind kind, const glm::dvec3& origin_w_m,
                 const Lines& lines_m, const Pen& pen);

/// Returns the axes of a frame as a layer: x red, y green, z blue.
Layer axes_layer(const std::string& name, const glm::dvec3& origin_w_m, const Pose& X_DS,
                 double length_m);

/// Returns the edges of a box with centre `middle_m`, aligned with the axes of D.
Lines box_edges(const glm::dvec3& middle_m, const glm::dvec3& half_m);

}  // namespace groundray
