#pragma once

#include <chrono>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>

#include "core/image.h"
#include "core/scene.h"
#include "core/trajectory.h"
#include "sensors/camera/camera.h"

namespace groundray {

/// Where a pixel's surface goes: its place in another image less its place in this one.
struct Flow {
  ImageF offset_px;  ///< u and v; NaN where it is not imaged there
  Image8 is_seen;    ///< 1 where it lies inside that image and a ray from there meets it
};

/// What is true of what the centre of each pixel looks at in the middle of its row's exposure.
/// Nothing is filtered. Where a pixel looks nowhere, `is_valid` is 0 and all else is as of sky.
/// What is not asked for has no image.
/// @see docs/camera_truth.md
struct ImageTruth {
  Image8 is_valid;
  ImageF range_m;         ///< from the lens; infinite for sky
  ImageF depth_m;         ///< Z: along the optical axis; infinite for sky
  Image<double> p_DQ;     ///< x, y, z in D; NaN for sky, as the next four
  ImageF normal;          ///< of the facet, unit, axes of D, on the side that is seen
  ImageF shading_normal;  ///< what light is reckoned with
  ImageF albedo;          ///< linear sRGB, 0 to 1: what comes back of light from everywhere
  ImageF incidence_rad;   ///< between the ray and the facet's normal
  ImageF velocity_m_s;    ///< of the surface, axes of D; 0 for sky
  ImageF bound_m;         ///< how far range_m may be from the reference surface's, certified; of
                          ///< sky 0, or infinite if the reference may be there; if asked for
  Image<std::uint32_t> label;     ///< semantic class; 0 for sky
  Image<std::uint32_t> instance;  ///< number of the object; 0 for the ground and for sky
  Image<std::uint32_t> material;  ///< index among the scene's, and 1; 0 for sky
  Flow forward, backward;         ///< to the next image and to the one before, if asked for
};

/// Which image the truth is wanted of, and what besides.
struct TruthRequest {
  std::chrono::nanoseconds begin{0};  ///< when its first row begins to see
  /// Likewise of the images around, for the flow to them.
  std::optional<std::chrono::nanoseconds> before, after;
  bool bounds = false;  ///< takes many times as long as all else
};

/// Returns the truth of an image, on all cores.
/// @param materials  of the scene: Materials::in_colour().
/// @param X_DC  must cover the image and those around.
/// @param buffers  whose memory is taken over: the truth of an image that is done with.
/// @throws Error if the path does not, or if a material has no albedo.
ImageTruth image_truth(const Camera& camera, const Scene& scene,
                       const Materials::InColour& materials, const Trajectory& X_DC,
                       const TruthRequest& request, ImageTruth buffers = {});

}  // namespace groundray
