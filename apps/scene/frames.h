#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "apps/scene/simulation.h"
#include "core/image/image.h"
#include "core/tracing/scene.h"
#include "sensors/camera/auto_exposure.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/image_boxes.h"
#include "sensors/camera/image_truth.h"
#include "sensors/camera/picture.h"
#include "sensors/lidar/lidar.h"
#include "terrain/lod/clipmap.h"

namespace groundray {

/// Builder of the scenes of frames. The origin of L follows the sensor over its lattice, and the
/// terrain's levels follow the sensor's positions during the frame, so that a frame's result
/// depends on the frame alone.
class FrameSceneBuilder {
 public:
  /// @param simulation  must outlive this.
  explicit FrameSceneBuilder(const Simulation& simulation) : simulation_(simulation) {}

  /// Returns the scene of a frame; valid until the next call.
  /// @throws Error if it needs more memory than the scene file permits.
  const Scene& operator()(const Exposed& frame);

 private:
  void take(RayTracer rays);

  const Simulation& simulation_;
  glm::dvec3 p_DL_{0};
  std::optional<Clipmap> clipmap_;
  std::optional<Scene> scene_;
};

/// Frames of a simulation: one sweep of a lidar or one image of a camera. A frame depends only on
/// the scene file, the seed and the frame's number, not on the frames made before. Sensors are
/// numbered as in dataset.yaml: the lidars first, then the cameras.

/// Simulates a sweep of a lidar.
/// @param lidar  index in Simulation::lidars.
/// @param scene  scene of this frame, from FrameSceneBuilder.
/// @throws as Lidar::scan.
LidarScan make_scan(const Simulation& simulation, std::size_t lidar, std::int64_t sweep,
                    const Scene& scene, const SweepWatch& watch = {});

/// Builds the scene of a sweep and simulates it. FrameSceneBuilder saves time where there are
/// several frames.
/// @throws as FrameSceneBuilder and Lidar::scan.
LidarScan make_scan(const Simulation& simulation, std::size_t lidar, std::int64_t sweep);

/// Image in memory, with the products that its camera requests.
struct MadeImage {
  std::optional<Exposure> light;
  std::optional<ImageTruth> truth;
  std::vector<ImagedInstance> instances;  ///< if the camera's products include boxes
  std::vector<std::uint16_t> labels;      ///< labels of the channels of the light's coverage
  std::uint64_t paths = 0;                ///< number of light paths traced
  ExposureSetting exposure;               ///< exposure time and gain of the light
};

/// Returns the exposure time and gain of an image: those of its light, if they are automatic.
/// @param scene  scene of this frame, from FrameSceneBuilder.
/// @throws Error as Camera::meter and choose_exposure.
ExposureSetting exposure_of(const Simulation& simulation, std::size_t camera, std::int64_t image,
                            const Scene& scene);

/// Renders an image and computes its truth, as far as its camera's products require.
/// @param camera  index in Simulation::cameras.
/// @param image   number of the image.
/// @param scene   scene of this frame, from FrameSceneBuilder.
/// @param check   called repeatedly, on any thread; an exception from it ends the image.
/// @throws Error as Camera::expose and image_truth.
MadeImage make_image(const Simulation& simulation, std::size_t camera, std::int64_t image,
                     const Scene& scene, const std::function<void()>& check = {});

/// Builds the scene of an image and renders it, as above.
MadeImage make_image(const Simulation& simulation, std::size_t camera, std::int64_t image);

/// Signal of an image at each stage of the imager.
struct ImagerStages {
  ImageF irradiance_w_m2;
  ImageF photons;
  ImageF electrons;
  Image16 raw_dn;
  std::optional<DevelopedPicture> picture;  ///< if the camera's products include it
  double saturated_share = 0;               ///< fraction of the pixels that are saturated
};

/// Simulates the imager and develops the picture.
/// @param made  image with light.
/// @return nothing if no product of the camera comes from its imager.
std::optional<ImagerStages> simulate_imager(const Simulation& simulation, std::size_t camera,
                                            std::int64_t image, const MadeImage& made);

}  // namespace groundray
