#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "core/image.h"
#include "core/random.h"
#include "core/scene.h"
#include "core/trajectory.h"
#include "sensors/camera/camera_spec.h"
#include "sensors/camera/lens.h"
#include "sensors/camera/path_tracer.h"

namespace groundray {

/// The light of an image: means over each pixel's square, the aperture and the exposure. Of pixels
/// at the rim of what the lens images, those parts count that look somewhere; a pixel whose centre
/// looks nowhere has none.
struct Exposure {
  ImageF radiance;        ///< linear red, green and blue, W/(m^2 sr), see docs/sky.md; 0 where a
                          ///< pixel looks nowhere
  ImageF standard_error;  ///< of each of them; infinite where there is but one path
  ImageF samples;         ///< how many paths each pixel took
  /// How much of each pixel shows things of a label, a channel for each label asked for; 0 where a
  /// pixel looks nowhere. No image if none was asked for.
  ImageF coverage;
};

/// Returns all labels that a scene can show, ascending: 0, of the sky, is always one.
std::vector<std::uint16_t> labels_of(const Scene& scene);

/// A camera. Immutable; any number of threads may expose with one.
class Camera {
 public:
  /// @throws Error listing every field of `spec` that is out of bounds.
  explicit Camera(const CameraSpec& spec);

  const CameraSpec& spec() const noexcept { return spec_; }
  const Lens& lens() const noexcept { return lens_; }

  /// Returns where the centres of all pixels look, in C, row by row; zero for those that look
  /// nowhere. Found when asked for first; 24 bytes a pixel. Copies share it.
  std::span<const glm::dvec3> directions() const;

  /// Returns the light of one image, on all cores.
  /// @param X_DC  must cover `begin` to the end of the last row's exposure.
  /// @param begin  when the first row begins to see.
  /// @param key  names sensor and frame: equal keys give equal images, on any number of threads.
  /// @param labels  whose coverage is wanted, ascending.
  /// @param check  called by any thread before each few rows; what it throws ends the image.
  /// @throws Error if the path does not cover the exposure.
  Exposure expose(const PathTracer& light, const Trajectory& X_DC, std::chrono::nanoseconds begin,
                  const RandomKey& key, std::span<const std::uint16_t> labels = {},
                  const std::function<void()>& check = {}) const;

  /// Returns when the last row has seen all, after the image's begin.
  std::chrono::nanoseconds duration() const noexcept;
  /// Returns the middle of a row's exposure, after the image's begin.
  /// @param row  whole or, between two, a fraction.
  std::chrono::nanoseconds middle_of(double row) const noexcept;

  /// @throws Error unless `X_DC` covers an image that begins at `begin`.
  void check_cover(const Trajectory& X_DC, std::chrono::nanoseconds begin) const;

 private:
  class Rows;
  struct Directions;

  CameraSpec spec_;
  Lens lens_;
  std::shared_ptr<Directions> directions_;
};

}  // namespace groundray
