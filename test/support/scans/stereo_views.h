#pragma once

#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>
#include <memory>
#include <utility>

#include "reconstruction/stereo/pinhole_pair.h"
#include "sensors/camera/lens/lens.h"

namespace groundray::testing {

/// A lens in the stereo module's representation.
inline StereoView view_of(const LensModel& model, glm::ivec2 size_px, const Pose& X_DC) {
  const auto lens = std::make_shared<Lens>(model, size_px);
  return {size_px, X_DC, [lens](const glm::dvec3& p_C) { return lens->project(p_C); },
          [lens](glm::dvec2 pixel) -> std::optional<glm::dvec3> {
            const auto ray = lens->ray(pixel);
            if (!ray) return std::nullopt;
            return ray->direction;
          }};
}

/// The rotation by the given angles about a camera's own axes (right, down, ahead).
inline glm::dquat turned(const glm::dvec3& turn_deg) {
  return glm::dquat(glm::dvec3(glm::radians(turn_deg)));
}

}  // namespace groundray::testing
