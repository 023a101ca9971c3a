#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <vector>

#include "core/random.h"
#include "terrain/area.h"
#include "terrain/clearing.h"
#include "terrain/density_map.h"
#include "terrain/ground.h"
#include "terrain/pass.h"

namespace groundray {

/// A closed interval.
struct Interval {
  double low = 0;
  double high = 0;
  constexpr bool contains(double x) const { return low <= x && x <= high; }
  friend constexpr bool operator==(const Interval&, const Interval&) = default;
};

/// How plants stand: their z axis along D's, or along the normal of the facet under them.
enum class Stance : std::uint8_t { Upright, OnSlope };

/// What one layer of plants, rocks or the like looks for, and how it stands.
struct ScatterSpec {
  std::uint32_t layer = 0;    ///< layers with other numbers are independent of each other
  double min_distance_m = 0;  ///< between any two places, over the map
  Interval slope_deg{0, 90};  ///< of the facet, between its normal and the vertical
  Interval height_m{-std::numeric_limits<double>::infinity(),
                    std::numeric_limits<double>::infinity()};
  Interval scale{1, 1};      ///< each scale in it equally often
  Interval yaw_deg{0, 360};  ///< likewise; about the plant's own z, from x to y
  Stance stance = Stance::Upright;
  double sink_m = 0;               ///< how deep it stands in the ground at scale 1, straight down
  std::vector<double> weights{1};  ///< how often each prototype is taken, relative to the others
  std::vector<Clearing> clearings;
  glm::dvec2 origin_w_m{0};  ///< D's origin in W: plants keep their place in W when the DEM is cut
};

/// Returns the shortest turn that takes the z axis to a unit normal that looks up.
glm::dquat tilt_to(const glm::dvec3& normal);

/// A plant's place. O is its own frame: z up the stem, the origin where that meets the ground.
struct Placement {
  glm::dvec3 p_DO{0};
  glm::dquat R_DO{1, 0, 0, 0};
  double scale = 1;
  std::uint32_t prototype = 0;  ///< index among ScatterSpec::weights
  std::uint64_t key = 0;        ///< of its own in the layer, whatever else is asked for

  friend bool operator==(const Placement&, const Placement&) = default;
};

/// A layer of plants all over a ground. Whether one stands at a place is a function of seed, layer,
/// minimum distance and highest density, and of density, clearings and ground at that place alone.
/// Immutable; any number of threads may ask.
class Scatter {
 public:
  /// More placements than this are never returned at once.
  static constexpr std::size_t max_placements = 1'000'000;

  /// @throws Error listing every field of `spec` out of bounds; if density and minimum distance
  ///         exclude each other; and if the density map misses the ground.
  Scatter(Ground ground, DensityMap density, const ScatterSpec& spec, Seed seed);

  /// Returns the plants whose places are in `area`, in order of their keys: those that any larger
  /// area has there. The expected number in any region is the integral of the density over what of
  /// it the limits allow and no clearing keeps free, to 2e-4 of it.
  /// @throws Error for more than max_placements, or if samples of the ground cannot be read.
  std::vector<Placement> placements(const Area& area = {},
                                    const PassRunner& runner = run_in_parallel) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace groundray
