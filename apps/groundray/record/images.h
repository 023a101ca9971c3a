#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "apps/groundray/record/dataset.h"
#include "apps/scene/world.h"

namespace groundray {

/// Returns what the names of all files of an image of a camera end with.
std::vector<std::string> image_suffixes(const MountedCamera& camera);

/// What making an image took, and what of it was left out.
struct ImageTally {
  std::uint64_t paths = 0;           ///< of light
  std::uint64_t flows_left_out = 0;  ///< beyond what KITTI's files hold
};

/// Makes an image of a camera and all that is asked for with it, and writes it.
/// @param camera  index among the world's. @param image  number of the camera's.
/// @throws Error if a file cannot be written.
ImageTally make_image(const World& world, const Dataset& dataset, std::size_t camera,
                      std::int64_t image, const Scene& scene);

/// Writes where an image shows the echoes of the lidars that it is asked to show: of the last scan
/// that has begun when it is half exposed. What hides them is looked for in the scene of the scan,
/// on whose surface they lie.
/// @param scene_for  returns the scene of a frame.
/// @throws Error if a scan cannot be read, or a file cannot be written.
void show_echoes(const World& world, const Dataset& dataset, std::size_t camera, std::int64_t image,
                 const std::function<const Scene&(const Exposed&)>& scene_for);

}  // namespace groundray
