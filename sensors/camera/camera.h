#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/image/image.h"
#include "core/random.h"
#include "core/tracing/scene.h"
#include "sensors/camera/camera_spec.h"
#include "sensors/camera/lens/lens.h"
#include "sensors/camera/path_tracer.h"

namespace groundray {

/// Degrees of freedom of Student's t for intervals from standard errors: the radiance lies within
/// t(p) standard errors of a pixel's mean with probability p. Pixels of two or three paths have
/// one.
/// @see docs/theory/camera_light.md, standard error
inline constexpr int standard_error_freedom = 3;

/// Light of an image: means over each pixel's square, the aperture and the exposure. A pixel at the
/// boundary of the lens' field shows the mean over the positions that the lens images; a pixel
/// whose centre has no viewing direction shows nothing.
struct Exposure {
  ImageF
      radiance;  ///< linear sRGB, W/(m^2 sr), see docs/theory/sky.md; 0 without a viewing direction
  ImageF standard_error;  ///< standard error of each channel, of standard_error_freedom degrees of
                          ///< freedom; infinite for a single path
  ImageF samples;         ///< number of paths of each pixel
  /// Fraction of each pixel that shows a label, one channel per requested label; 0 where a pixel
  /// has no viewing direction. Empty if no label was requested.
  ImageF coverage;
};

/// Light of a pixel that automatic exposure measures.
struct MeteredPixel {
  glm::ivec2 pixel{0};
  glm::vec3 radiance{0};  ///< linear sRGB, W/(m^2 sr)
};

/// Returns all labels that a scene can show, ascending; the first is 0, for the sky.
std::vector<std::uint16_t> labels_of(const Scene& scene);

/// Camera: a lens with aperture, shutter and sampling. Immutable; any number of threads may expose
/// with one.
class Camera {
 public:
  /// @throws Error listing every field of `spec` that is out of bounds.
  explicit Camera(const CameraSpec& spec);

  const CameraSpec& spec() const noexcept { return spec_; }
  const Lens& lens() const noexcept { return lens_; }

  /// Returns the viewing directions of all pixel centres, unit vectors in C, row by row; zero for
  /// pixels without one. Computed at the first call, 24 bytes per pixel, and shared by copies of
  /// the camera.
  std::span<const glm::dvec3> directions() const;

  /// Renders the light of one image, on all cores.
  /// @param X_DC  trajectory of the camera; must cover `begin` to the end of the last row's
  ///        exposure.
  /// @param begin  start of the first row's exposure.
  /// @param key  names sensor and frame: equal keys give equal images, on any number of threads.
  /// @param labels  labels whose coverage is requested, ascending.
  /// @param check  called on any thread before each block of rows; an exception from it ends the
  ///        image.
  /// @param exposure_s  exposure time of this image, up to that of the shutter, which is the
  ///        default; the middle of each row's exposure is that of the shutter's.
  /// @throws Error if X_DC does not cover the exposure.
  Exposure expose(const PathTracer& light, const Trajectory& X_DC, std::chrono::nanoseconds begin,
                  const RandomKey& key, std::span<const std::uint16_t> labels = {},
                  const std::function<void()>& check = {},
                  std::optional<double> exposure_s = std::nullopt) const;

  /// Returns how often `expose` calls `check`: nearly in proportion to its work, if the number of
  /// paths per pixel is fixed.
  std::size_t checks() const noexcept;

  /// Measures the light of an image at up to about 3000 pixels of a square lattice, as a camera
  /// does before an automatic exposure: with 16 paths per pixel, over the shutter's exposure time.
  /// The paths are independent of those of `expose`. Parameters and errors are as there.
  /// @return the pixels that have a viewing direction, row by row.
  std::vector<MeteredPixel> meter(const PathTracer& light, const Trajectory& X_DC,
                                  std::chrono::nanoseconds begin, const RandomKey& key) const;

  /// Returns the time from the image's start to the end of the last row's exposure.
  std::chrono::nanoseconds duration() const noexcept;
  /// Returns the time from the image's start to the middle of a row's exposure.
  /// @param row  row number; may be fractional.
  std::chrono::nanoseconds middle_of(double row) const noexcept;

  /// Checks that X_DC covers an image that begins at `begin`. @throws Error if it does not.
  void check_cover(const Trajectory& X_DC, std::chrono::nanoseconds begin) const;

 private:
  struct Directions;

  CameraSpec spec_;
  Lens lens_;
  std::shared_ptr<Directions> directions_;
};

}  // namespace groundray
