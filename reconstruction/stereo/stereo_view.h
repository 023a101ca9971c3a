#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "core/pose.h"

namespace groundray {

/// What stereo needs to know of a camera: where it was and, exactly, what its pixels see. Both
/// functions may be called by several threads at a time.
struct StereoView {
  glm::ivec2 size_px{0};  ///< columns and rows; integer coordinates are pixel centres
  Pose X_DC;              ///< x right, y down, z ahead
  /// Returns where a point of C, or a direction, falls: inside the image or not. Nothing if it is
  /// not imaged.
  std::function<std::optional<glm::dvec2>(const glm::dvec3& p_C)> project;
  /// Returns where a pixel looks, in C; of any length. Nothing if it looks nowhere.
  std::function<std::optional<glm::dvec3>(glm::dvec2 pixel)> ray;
};

/// Which of two cameras: left is the one whose pixels get depths.
enum class StereoSide { Left, Right };

}  // namespace groundray
