#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "apps/view/layer.h"
#include "core/pose.h"
#include "core/trajectory.h"
#include "sensors/camera/lens.h"
#include "sensors/scan_pattern.h"

namespace groundray {

/// Lines in one frame, to be drawn: runs of points, each run in one colour.
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

/// Adds what a camera sees up to a depth: the border of its image, where the lens bends it, and
/// lines to the corners.
void add_frustum(LineDrawing& drawing, const Pose& X_DC, const Lens& lens, double depth_m,
                 glm::u8vec3 rgb);

/// Adds what a lidar sweeps, at one distance: the lowest and the highest beam all round.
void add_field(LineDrawing& drawing, const Pose& X_DS, const ScanPattern& pattern, double range_m,
               glm::u8vec3 rgb);

/// Adds a line between two frames: how a sensor is mounted.
void add_mount(LineDrawing& drawing, const Pose& X_DB, const Pose& X_DS);

/// Returns the layer of a drawing, coloured as it says.
/// @param origin_w_m  of D.
Layer line_layer(const std::string& name, LayerKind kind, const LineDrawing& drawing,
                 const glm::dvec3& origin_w_m);

/// Returns the layer of a path, with the column "time".
Layer trail_layer(const std::string& name, const Trajectory& X_DS, const glm::dvec3& origin_w_m);

}  // namespace groundray
