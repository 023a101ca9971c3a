#pragma once

#include <algorithm>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sensors/camera/imager.h"
#include "sensors/camera/lens_models.h"

namespace groundray {

/// When rows see the world: each from its begin for `exposure_s`.
struct ShutterSpec {
  double exposure_s = 0.005;
  double row_s =
      0;  ///< from the begin of a row to that of the next one below; 0 for a global shutter
};

/// What light passes on its way to the sensor.
struct ApertureSpec {
  double focal_length_m = 0;
  double f_number = 0;
  /// Distance of the plane that is sharp, from the lens along the axis, may be infinite. Without it
  /// all is sharp, as through a pinhole.
  std::optional<double> focus_m = {};
  double transmission = 1;  ///< of the glass, > 0 up to 1
  /// v1, v2, v3 of the light that the rim keeps back: 1 + v1 r^2 + v2 r^4 + v3 r^6, where r is the
  /// distance from the principal point over half the image's diagonal.
  glm::dvec3 vignetting{0};
  /// How the pupil stands to light from aside.
  enum class Pupil {
    Flat,     ///< across the axis: it takes in the cosine of what it would on the axis
    Turning,  ///< towards the light, as fisheyes' do: it takes in the same from everywhere
  };
  Pupil pupil = Pupil::Flat;
};

/// How many paths the light of a pixel is the mean of.
struct SamplingSpec {
  int samples = 16;           ///< of every pixel, a power of two
  int most_samples = 16;      ///< up to where they are doubled if that many before, which are then
                              ///< dropped, tell...
  double relative_error = 0;  ///< ...that the mean's standard error is more than this of it
  int depth = 4;              ///< longest paths, in rays; see PathTracer
};

/// What a camera gives of each image.
enum class CameraProduct {
  Radiance,    ///< with its standard error and number of samples
  Truth,       ///< what each pixel's centre sees
  Bound,       ///< of the truth's ranges, certified; takes many times as long as the truth
  Flow,        ///< in the EXR file, forward and backward
  FlowFlo,     ///< forward, as Middlebury's .flo
  FlowKitti,   ///< forward, as KITTI's PNG
  Coverage,    ///< share of each pixel by label
  Irradiance,  ///< of the sensor
  Photons,     ///< on each pixel
  Electrons,   ///< after the exposure
  Raw,         ///< digital numbers
  Picture,     ///< for people: developed from the raw image
};

/// How raw images become pictures.
struct PictureSpec {
  enum class Encoding { Srgb, Linear };
  Encoding encoding = Encoding::Srgb;
  int bits = 8;                          ///< 8 or 16
  std::optional<glm::dvec3> gains = {};  ///< of red, green and blue; without them those that show
                                         ///< grey surfaces in light of equal R, G and B as grey
};

/// Everything that makes one camera.
struct CameraSpec {
  std::string model = {};  ///< for people: "Intel RealSense D455, left infrared"
  LensModel lens;
  glm::ivec2 size_px{0};
  double rate_hz = 10;
  double first_s = 0;  ///< when the first image begins
  ShutterSpec shutter = {};
  std::optional<ApertureSpec> aperture = {};  ///< there must be one if there is an imager
  SamplingSpec sampling = {};
  std::optional<ImagerSpec> imager = {};
  PictureSpec picture = {};
  std::vector<CameraProduct> products = {CameraProduct::Radiance, CameraProduct::Truth};
};

/// Whether a product is asked for.
inline bool gives(const CameraSpec& camera, CameraProduct product) {
  return std::ranges::find(camera.products, product) != camera.products.end();
}

/// Whether a product is made of the light of the scene.
constexpr bool is_of_light(CameraProduct product) {
  return product == CameraProduct::Radiance || product >= CameraProduct::Coverage;
}

/// Whether any product of a camera is.
inline bool needs_light(const CameraSpec& camera) {
  return std::ranges::any_of(camera.products, is_of_light);
}

}  // namespace groundray
