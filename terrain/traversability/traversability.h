#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/geometry/grid_frame.h"
#include "terrain/ground.h"
#include "terrain/traversability/footprint_stencil.h"

namespace groundray {

/// Bounds that a vehicle permits; one that is not set does not count.
struct TraversabilityLimits {
  std::optional<double> slope_deg;
  std::optional<double> roughness_m;
  std::optional<double> step_m;
  double least_clearance_m = 0;  ///< ground this close to the underbody, or closer, is an obstacle
};

/// Vehicle, and the windows in which ground is judged.
struct TraversabilitySpec {
  double cell_m = 0;  ///< distance of samples
  VehicleSize vehicle;
  int headings = 8;  ///< number of headings, evenly over half a turn, from east on
  /// Radius of the disc whose plane has the slope; by default the vehicle's half diagonal.
  std::optional<double> plane_radius_m;
  /// Radius of the disc in which steps are measured; by default that of a wheel.
  std::optional<double> step_radius_m;
  TraversabilityLimits limits;
};

/// Reason why ground is not traversable: bit of a verdict.
enum class GroundObstacle : std::uint8_t { Slope = 1, Roughness = 2, Step = 4, Clearance = 8 };

/// Verdict or flag where the ground is not known within the windows and under the vehicle.
inline constexpr std::uint8_t no_verdict = 255;

/// Layers on a grid of square cells, row by row from north to south. NaN, or `no_verdict`, where a
/// sample that the layer needs is missing.
/// @see docs/reference/traversability.md for the definitions.
struct TraversabilityLayers {
  GridFrame frame;
  std::vector<float> elevation_m;
  std::vector<float> slope_deg;    ///< of the least squares plane of the disc
  std::vector<float> roughness_m;  ///< root mean square of vertical residuals about that plane
  std::vector<float> step_m;       ///< highest minus lowest sample of the disc of steps
  std::vector<float> clearance_m;  ///< least distance of ground from the underbody, at any heading
  std::vector<std::uint8_t> belly_contact;  ///< 1 where the clearance is 0 or less
  std::vector<std::uint8_t> verdict;        ///< sum of GroundObstacle; 0: traversable
};

/// Computes the layers of the ground. Heights at samples are those of the surface; between samples
/// the layers are those of the triangles of the samples, exactly. Equal to the last bit for any
/// number of threads.
/// @param memory_bytes  limit for the layers.
/// @param progress      receives the fraction that is done; what it throws ends the work.
/// @throws Error listing every invalid value; if the layers take more memory; or if no sample has
///         ground under the whole vehicle.
TraversabilityLayers traversability(const Ground& ground, const TraversabilitySpec& spec,
                                    std::size_t memory_bytes,
                                    const std::function<void(double share)>& progress = {});

/// Number of samples by their verdict.
struct VerdictCounts {
  std::size_t known = 0;        ///< samples with a verdict
  std::size_t traversable = 0;  ///< those with verdict 0
  /// Samples with the obstacle, in the order of GroundObstacle; one sample may have several.
  std::array<std::size_t, 4> obstacles{};
};

/// Counts the verdicts.
VerdictCounts count_verdicts(const TraversabilityLayers& layers);

}  // namespace groundray
