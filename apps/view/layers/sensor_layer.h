#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "apps/view/rendering/layer.h"
#include "core/geometry/pose.h"
#include "core/geometry/trajectory.h"
#include "sensors/camera/lens/lens.h"
#include "sensors/lidar/pattern/scan_pattern.h"

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

/// Adds the view frustum of a camera: the boundary of its image as the lens bends it, and lines to
/// the corners.
/// @param depth_m  length along the rays, not along the optical axis.
void add_frustum(LineDrawing& drawing, const Pose& X_DC, const Lens& lens, double depth_m,
                 glm::u8vec3 rgb);

/// Adds a lidar's field of view at one distance: the lowest and the highest beam at all azimuths.
void add_field(LineDrawing& drawing, const Pose& X_DS, const ScanPattern& pattern, double range_m,
               glm::u8vec3 rgb);

/// Adds a line between the origins of two frames, to show the mount of a sensor.
void add_mount(LineDrawing& drawing, const Pose& X_DB, const Pose& X_DS);

/// Returns the layer of a drawing, in its colours.
/// @param origin_w_m  origin of D, in W.
Layer line_layer(const std::string& name, LayerKind kind, const LineDrawing& drawing,
                 const glm::dvec3& origin_w_m);

/// Returns the layer of a trajectory, with the column "time", s.
Layer trail_layer(const std::string& name, const Trajectory& X_DS, const glm::dvec3& origin_w_m);

}  // namespace groundray
