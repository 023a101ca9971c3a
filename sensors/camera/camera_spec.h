#pragma once

#include <algorithm>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sensors/camera/imager.h"
#include "sensors/camera/lens/lens_models.h"

namespace groundray {

/// Automatic exposure: the exposure time of each image follows from a measurement of its own light,
/// up to ShutterSpec::exposure_s; the gain is increased only if that is still too dark.
/// @see docs/theory/camera_imager.md
struct AutoExposureSpec {
  /// Level of an image, relative to white.
  enum class Metering {
    Percentile,  ///< `percentile` of the pixels' brightest channels
    Mean,        ///< mean of the pixels' luminance
  };
  Metering metering = Metering::Percentile;
  double percentile = 99;    ///< > 0 up to 100
  double target = 0.9;       ///< requested level, > 0 up to 1
  double shortest_s = 1e-5;  ///< shortest exposure time
  double most_gain = 1;      ///< largest factor of ImagerSpec::gain_dn_e, 1 or more
};

/// Shutter, global or rolling: each row is exposed for `exposure_s` from its own start. Automatic
/// exposures may be shorter; they have the same middle.
struct ShutterSpec {
  double exposure_s = 0.005;
  /// Time from the start of a row to that of the next one below; 0 for a global shutter.
  double row_s = 0;
  std::optional<AutoExposureSpec> automatic = {};  ///< requires an imager
};

/// Aperture of the lens, and its losses of light.
struct ApertureSpec {
  double focal_length_m = 0;
  double f_number = 0;
  /// Distance of the plane in focus from the lens, along the axis, m; may be infinite. Without it
  /// everything is in focus, as through a pinhole.
  std::optional<double> focus_m = {};
  double transmission = 1;  ///< transmission of the glass, > 0 up to 1
  /// Coefficients v1, v2, v3 of the vignetting 1 + v1 r^2 + v2 r^4 + v3 r^6, where r is the
  /// distance from the principal point over half the image's diagonal.
  glm::dvec3 vignetting{0};
  /// Area that the pupil presents to light from off the axis.
  enum class Pupil {
    Flat,     ///< disc perpendicular to the axis: the area decreases with the cosine
    Turning,  ///< tilts towards the light, as in fisheyes: the same area for all directions
  };
  Pupil pupil = Pupil::Flat;
};

/// Number of paths per pixel. If most_samples exceeds samples, it is chosen for each pixel by a
/// pilot of `samples` paths, which is then discarded (docs/theory/camera_light.md, adaptive
/// sampling).
struct SamplingSpec {
  int samples = 16;           ///< fewest paths of a pixel, a power of two
  int most_samples = 16;      ///< most paths of a pixel, a power of two
  double relative_error = 0;  ///< requested standard error of a pixel's mean, relative to the mean
  int depth = 4;              ///< most rays in a path; see PathTracer
};

/// Output of a camera for each image.
enum class CameraProduct {
  Radiance,    ///< radiance, with its standard error and number of samples
  Truth,       ///< ground truth at each pixel's centre
  Bound,       ///< certified bound of the truth's ranges; takes many times as long as the truth
  Flow,        ///< forward and backward flow, in the EXR file
  FlowFlo,     ///< forward flow, as Middlebury's .flo
  FlowKitti,   ///< forward flow, as KITTI's PNG
  Boxes,       ///< boxes of the instances that the image shows, with their visibility
  Coverage,    ///< fraction of each pixel by label
  Irradiance,  ///< irradiance of the sensor
  Photons,     ///< photons on each pixel
  Electrons,   ///< electrons at the end of the exposure
  Raw,         ///< digital numbers
  Picture,     ///< picture for viewing, developed from the raw image
};

/// Conversion of raw images to pictures.
struct PictureSpec {
  enum class Encoding { Srgb, Linear };
  Encoding encoding = Encoding::Srgb;
  int bits = 8;  ///< 8 or 16
  /// Gains of red, green and blue. By default, grey surfaces in light of equal R, G and B appear
  /// grey.
  std::optional<glm::dvec3> gains = {};
  bool balances_white = false;  ///< automatic white balance: gains from each image, not `gains`
  /// Key of the tone curve, 0 to 1: the level to which its factor takes each image's log-mean
  /// luminance, before bright values are compressed.
  std::optional<double> tone_key = {};
};

/// Parameters of one camera.
struct CameraSpec {
  std::string model = {};  ///< description: "Intel RealSense D455, left infrared"
  LensModel lens;
  glm::ivec2 size_px{0};
  double rate_hz = 10;
  double first_s = 0;  ///< time at which the first image begins
  ShutterSpec shutter = {};
  std::optional<ApertureSpec> aperture = {};  ///< required if there is an imager
  SamplingSpec sampling = {};
  std::optional<ImagerSpec> imager = {};
  PictureSpec picture = {};
  std::vector<CameraProduct> products = {CameraProduct::Radiance, CameraProduct::Truth};
};

/// Returns true if a product of the camera is requested.
inline bool gives(const CameraSpec& camera, CameraProduct product) {
  return std::ranges::find(camera.products, product) != camera.products.end();
}

/// Returns true if a product is computed from the light of the scene.
constexpr bool is_of_light(CameraProduct product) {
  return product == CameraProduct::Radiance || product >= CameraProduct::Coverage;
}

/// Returns true if any product of the camera comes from its imager.
inline bool gives_signal(const CameraSpec& camera) {
  return std::ranges::any_of(camera.products,
                             [](CameraProduct each) { return each >= CameraProduct::Irradiance; });
}

/// Returns true if any product of the camera is computed from the light of the scene.
inline bool needs_light(const CameraSpec& camera) {
  return std::ranges::any_of(camera.products, is_of_light);
}

}  // namespace groundray
