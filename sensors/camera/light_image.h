#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>

#include "core/image/image.h"
#include "core/random.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/path_spread.h"

// Private to this library: the light of a camera's pixels by their paths.
namespace groundray::light_image {

inline std::chrono::nanoseconds nanoseconds_of(double seconds) {
  return std::chrono::nanoseconds(std::llround(seconds * 1e9));
}

/// Set of paths of a pixel: those that its light is the mean of, those of the pilot that chooses
/// their number, or those that measure the light for automatic exposure. They share no random
/// numbers, so that these choices do not bias the mean.
enum class Paths : std::uint32_t { OfMean, OfPilot, OfMeter };

/// Image that is to be rendered.
struct View {
  const PathTracer& light;
  const Trajectory& X_DC;
  std::chrono::nanoseconds begin;
  const RandomKey& key;
  std::function<void()> check;
  double exposure_s;  ///< with the same middle as the shutter's
};

/// Number of paths of each pixel.
using PathCounts = Image<int>;

/// Light of an image and the spreads of its paths.
struct Means {
  ImageF radiance;
  PathSpreads spreads;
  ImageF coverage;

  Means(int width, int height, std::size_t labels)
      : radiance(width, height, 3),
        spreads{ImageF(width, height, 1), ImageF(width, height, 3), ImageF(width, height, 3)},
        coverage(labels == 0 ? ImageF() : ImageF(width, height, static_cast<int>(labels))) {}
};

/// Height of the strips of rows that are rendered in parallel.
inline constexpr int strip_px = 8;

/// Renders an image.
/// @param counts  number of paths of each pixel.
/// @param labels  labels whose coverage is requested, ascending.
Means render(const Camera& camera, const View& view, const PathCounts& counts, Paths paths,
             std::span<const std::uint16_t> labels);

}  // namespace groundray::light_image
