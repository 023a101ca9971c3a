#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/python/scene_state.h"
#include "core/image/image.h"
#include "sensors/camera/auto_exposure.h"

namespace groundray::python {

/// Image of a scene's camera: channels whose names include their units.
struct CameraImage {
  struct Channel {
    std::string name;
    std::variant<ImageF, Image<double>, Image8, Image16, Image32> pixels;
  };
  std::vector<Channel> channels;
  std::vector<std::uint16_t> labels;  ///< labels of the layers of `coverage`
  std::int64_t frame = 0;
  std::string sensor;
  std::chrono::nanoseconds begin{0};           ///< of the exposure of its first row
  ExposureSetting exposure = {};               ///< of its light; a time of 0 if it has none
  std::optional<double> saturated_share = {};  ///< if it has products of the imager
};

/// Makes an image with all products that the camera's file requests.
/// @param check  called repeatedly, on any thread; an exception from it ends the image.
/// @throws Error as the functions that make the products.
CameraImage make_image(SceneState& state, std::size_t camera, std::int64_t frame,
                       const std::function<void()>& check);

/// Returns the values from which restored_image makes an equal image.
nb::list state_of(nb::handle_t<CameraImage> self);

/// Makes an image from a pickle.
/// @throws Error naming the damaged value.
CameraImage restored_image(const nb::tuple& values);

}  // namespace groundray::python
