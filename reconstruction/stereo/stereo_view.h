#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "core/geometry/pose.h"

namespace groundray {

/// Camera for stereo: its pose, and the exact relation between pixels and rays. Both functions may
/// be called by several threads at a time.
struct StereoView {
  glm::ivec2 size_px{0};  ///< columns and rows; integer coordinates are pixel centres
  Pose X_DC;              ///< pose of C in D; C: x right, y down, z ahead
  /// Returns the image position of a point of C, or of a direction: inside the image or not.
  /// Nothing if it is not imaged.
  std::function<std::optional<glm::dvec2>(const glm::dvec3& p_C)> project;
  /// Returns the direction of a pixel's ray in C, of any length. Nothing if it has none.
  std::function<std::optional<glm::dvec3>(glm::dvec2 pixel)> ray;
};

/// Side of a camera in a pair: depths belong to the pixels of the left one.
enum class StereoSide { Left, Right };

}  // namespace groundray
