#pragma once

#include <glm/gtc/type_precision.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "apps/view/layer.h"
#include "core/pose.h"

namespace groundray {

/// Points joined by lines; the end of one is not joined to the begin of the next.
using Lines = std::vector<std::vector<glm::dvec3>>;

/// What lines are drawn with.
struct Pen {
  glm::u8vec3 rgb{255, 255, 255};  ///< sRGB
  double width_px = 2;
};

/// Returns lines of one colour as a layer.
/// @param lines_m  in D, that is at `origin_w_m` in W.
Layer line_layer(const std::string& name, LayerKind kind, const glm::dvec3& origin_w_m,
                 const Lines& lines_m, const Pen& pen);

/// Returns a frame's axes as a layer: x red, y green, z blue.
Layer axes_layer(const std::string& name, const glm::dvec3& origin_w_m, const Pose& X_DS,
                 double length_m);

/// Returns the edges of a box round `middle_m`, along the axes of D.
Lines box_edges(const glm::dvec3& middle_m, const glm::dvec3& half_m);

}  // namespace groundray
