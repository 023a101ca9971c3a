#pragma once

#include <glm/vec3.hpp>

#include "apps/view/rendering/view.h"

// Motions of a viewpoint with mouse and keyboard; the vertical stays vertical.
namespace groundray {

/// Rotates the eye about the target.
/// @param yaw_rad    counter-clockwise as seen from above.
/// @param pitch_rad  upwards; limited to 1 mrad short of the vertical.
Look orbited(const Look& look, double yaw_rad, double pitch_rad);

/// Moves eye and target along the picture's axes.
Look panned(const Look& look, double right_m, double up_m);

/// Scales the distances of eye and target from `towards_w_m` by `factor`; that point keeps its
/// position in the picture.
Look zoomed(const Look& look, double factor, const glm::dvec3& towards_w_m);

/// Moves eye and target along the line of sight, to its right, and vertically, m.
Look flown(const Look& look, const glm::dvec3& ahead_right_up_m);

/// Returns the width of a pixel at the target, m.
double metres_per_pixel(const Look& look, double view_angle_rad, double height_px);

}  // namespace groundray
