#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "sensors/camera/lens/lens_models.h"

namespace groundray::testing {

struct LensSample {
  std::string name;
  LensModel model;
  glm::ivec2 size_px;
};

/// Returns lenses of every model, with mild and strong distortion: some fold over within their
/// image.
std::vector<LensSample> sample_lenses();

/// Returns a scale whose principal point is the centre of the image, in pixel-centre coordinates.
PixelScale centred(double focal_px, glm::ivec2 size_px);

}  // namespace groundray::testing
