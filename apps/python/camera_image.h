#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "apps/python/scene_state.h"
#include "core/image.h"

namespace groundray::python {

/// One image of a scene's camera: channels by names with units.
struct CameraImage {
  struct Channel {
    std::string name;
    std::variant<ImageF, Image<double>, Image8, Image16, Image32> pixels;
  };
  std::vector<Channel> channels;
  std::vector<std::uint16_t> labels;  ///< of the layers of `coverage`
  std::int64_t frame = 0;
  std::shared_ptr<const SceneState> state;
  std::size_t camera = 0;  ///< among the scene's

  const PlacedCamera& placed() const { return state->world.cameras[camera]; }
};

/// Makes an image with all products that the camera's file asks for.
/// @param check  called now and then; what it throws ends the image.
/// @throws Error as the parts do.
CameraImage make_image(const std::shared_ptr<SceneState>& state, std::size_t camera,
                       std::int64_t frame, const std::function<void()>& check);

}  // namespace groundray::python
