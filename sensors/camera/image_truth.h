#pragma once

#include <chrono>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>

#include "core/geometry/trajectory.h"
#include "core/image/image.h"
#include "core/tracing/scene.h"
#include "sensors/camera/camera.h"

namespace groundray {

/// Optical flow: image position of a pixel's point in another image, minus its position in this
/// one.
struct Flow {
  ImageF offset_px;  ///< u and v; NaN where that lens does not image the point, or no row sees it
  Image8 is_seen;    ///< 1 where that position is inside the image and a ray to the point hits it
};

/// Ground truth of an image: for each pixel, the surface hit by the ray through its centre in the
/// middle of its row's exposure. Nothing is filtered. Where a pixel has no viewing direction,
/// `is_valid` is 0 and all other values are those of sky, except for the flow, which is NaN. Images
/// that were not requested are empty.
/// @see docs/theory/camera_truth.md
struct ImageTruth {
  Image8 is_valid;
  ImageF range_m;         ///< range from the lens; infinite for sky
  ImageF depth_m;         ///< Z, along the optical axis; infinite for sky
  Image<double> p_DQ;     ///< x, y, z in D; NaN for sky, as are the next four
  ImageF normal;          ///< facet normal, unit, axes of D, on the visible side
  ImageF shading_normal;  ///< normal used for shading, unit, axes of D
  ImageF albedo;          ///< linear sRGB, 0 to 1: reflectance for uniform illumination
  ImageF incidence_rad;   ///< angle between the reversed ray and the facet's normal
  ImageF velocity_m_s;    ///< velocity of the surface, axes of D; 0 for sky
  /// Certified bound of the difference between range_m and the reference surface's range, if
  /// requested; for sky 0, or infinite if the ray may hit the reference surface.
  ImageF bound_m;
  Image<std::uint32_t> label;     ///< semantic class; 0 for sky
  Image<std::uint32_t> instance;  ///< object number; 0 for the ground and for sky
  Image<std::uint32_t> material;  ///< index among the scene's materials, plus 1; 0 for sky
  Flow forward, backward;         ///< flow to the next and to the previous image, if requested
};

/// Request for the truth of an image.
struct TruthRequest {
  std::chrono::nanoseconds begin{0};  ///< start of the first row's exposure
  /// Start times of the previous and the next image; the flow to an image is computed if its time
  /// is set.
  std::optional<std::chrono::nanoseconds> before, after;
  bool bounds = false;  ///< computes bound_m, which takes many times as long as all else
};

/// Computes the truth of an image, on all cores.
/// @param materials  the scene's Materials::in_colour().
/// @param X_DC  trajectory of the camera; must cover the image and those that the flow refers to.
/// @param buffers  truth of an image that is no longer needed, whose memory is reused.
/// @throws Error if X_DC does not cover them, or if a material has no albedo.
ImageTruth image_truth(const Camera& camera, const Scene& scene,
                       const Materials::InColour& materials, const Trajectory& X_DC,
                       const TruthRequest& request, ImageTruth buffers = {});

}  // namespace groundray
