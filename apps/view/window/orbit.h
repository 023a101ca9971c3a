#pragma once

#include <glm/vec3.hpp>

#include "apps/view/view.h"

// How a view is moved with the mouse and by keys: up stays up.
namespace groundray {

/// Turns round the point that is looked at.
/// @param yaw_rad  counter-clockwise as seen from above. @param pitch_rad  upward; the view stops a
///                 hair short of straight up and down.
Look orbited(const Look& look, double yaw_rad, double pitch_rad);

/// Turns where the eye stands, likewise.
Look turned(const Look& look, double yaw_rad, double pitch_rad);

/// Moves eye and target along the picture's axes.
Look panned(const Look& look, double right_m, double up_m);

/// Moves eye and target so that what lies at `towards_w_m` stays where it is in the picture, and
/// all distances from it are `factor` times what they were.
Look zoomed(const Look& look, double factor, const glm::dvec3& towards_w_m);

/// Moves eye and target along the sight, to the right of it and up, metres.
Look flown(const Look& look, const glm::dvec3& ahead_right_up_m);

/// Returns how many metres a pixel is wide at the target.
double metres_per_pixel(const Look& look, double view_angle_rad, double height_px);

}  // namespace groundray
