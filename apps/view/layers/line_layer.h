#pragma once

#include <glm/gtc/type_precision.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/view/rendering/layer.h"
#include "core/geometry/pose.h"

namespace groundray {

/// Polylines in one frame, each in a single colour.
struct LineDrawing {
  struct Run {
    std::vector<glm::dvec3> points_m;
    glm::u8vec3 rgb{255, 255, 255};
  };
  std::vector<Run> runs;

  void add(std::vector<glm::dvec3> points_m, glm::u8vec3 rgb) {
    runs.push_back({std::move(points_m), rgb});
  }
};

/// Adds the axes of a frame F: x red, y green, z blue.
void add_axes(LineDrawing& drawing, const Pose& X_DF, double length_m);

/// Adds the edges of a box, aligned with the axes of D.
void add_box(LineDrawing& drawing, const glm::dvec3& middle_m, const glm::dvec3& half_m,
             glm::u8vec3 rgb);

/// Returns the layer of a drawing, in its colours.
/// @param origin_w_m  origin of D, in W.
Layer line_layer(const std::string& name, LayerKind kind, const glm::dvec3& origin_w_m,
                 const LineDrawing& drawing, double width_px = 2);

}  // namespace groundray
