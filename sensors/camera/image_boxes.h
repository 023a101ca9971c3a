#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/tracing/instance_box.h"
#include "core/tracing/scene.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/image_truth.h"

namespace groundray {

/// Rectangle of pixels, both corners included; `high` is less than `low` if there are none.
struct PixelBox {
  glm::ivec2 low{0}, high{-1};

  /// Extends the rectangle to contain a pixel.
  void add(glm::ivec2 pixel) noexcept;
};

/// Instance in an image: its box in space, and its boxes in the image with and without what hides
/// it.
struct ImagedInstance {
  InstanceBox box;             ///< at the middle of the exposure of the mean row of its pixels
  std::uint32_t pixels = 0;    ///< that show it
  PixelBox visible;            ///< of these pixels
  std::uint32_t alone = 0;     ///< number of pixels that would show it if nothing else were there
  PixelBox whole;              ///< of those
  double visible_share = 0;    ///< pixels / alone, at most 1
  double truncated_share = 0;  ///< share of it that lies beside the image, without what hides it
};

/// Returns the instances of which an image shows one pixel at least, in the order of their numbers,
/// on all cores. Each is traced again alone, through the centres of all pixels that may show it and
/// positions beside the image, up to half its width and height away; of those that the lens images,
/// on a lattice of at most about 65000 for each instance.
/// @param truth  of the same image, by image_truth.
/// @param check  called on any thread before each instance; an exception from it ends the work.
/// @throws Error if X_DC does not cover the image.
std::vector<ImagedInstance> imaged_instances(const Camera& camera, const Scene& scene,
                                             const InstanceBoxes& boxes, const Trajectory& X_DC,
                                             std::chrono::nanoseconds begin,
                                             const ImageTruth& truth,
                                             const std::function<void()>& check = {});

}  // namespace groundray
