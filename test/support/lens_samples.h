#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "sensors/camera/lens_models.h"

namespace groundray::testing {

struct LensSample {
  std::string name;
  LensModel model;
  glm::ivec2 size_px;
};

/// Returns lenses of every model, mild and wild: some fold within their image.
std::vector<LensSample> sample_lenses();

/// A scale with the pixel centre of the middle of an image for its centre.
PixelScale centred(double focal_px, glm::ivec2 size_px);

}  // namespace groundray::testing
