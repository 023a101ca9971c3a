#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "core/random.h"
#include "terrain/dem/density_map.h"
#include "terrain/ground.h"
#include "terrain/lod/pass.h"
#include "terrain/scatter/clearing.h"
#include "terrain/scatter/cluster_field.h"
#include "terrain/scatter/row_lattice.h"

namespace groundray {

/// Closed interval.
struct Interval {
  double low = 0;
  double high = 0;
  constexpr bool contains(double x) const { return low <= x && x <= high; }
  friend constexpr bool operator==(const Interval&, const Interval&) = default;
};

/// Orientation of a plant's z axis: along D's, or along the normal of the facet below it.
enum class Stance : std::uint8_t { Upright, OnSlope };

/// Weibull distribution above the lower end of an interval, cut off at its upper end.
struct Weibull {
  double shape = 1;  ///< 1 for an exponential distribution
  double scale = 1;

  /// Returns the value that a share from 0 to 1 of all values does not exceed.
  double quantile(double share, const Interval& interval) const;
};

/// Placement rules of one layer of plants, rocks or other objects.
struct ScatterSpec {
  /// Function that returns the share of the plants that grow at a position of D, from 0 to 1. Any
  /// number of threads call it.
  using Suitability = std::function<double(glm::dvec2 p_D)>;

  std::uint32_t layer = 0;    ///< layers with different numbers are independent of each other
  double min_distance_m = 0;  ///< between any two positions, in plan
  /// Sites of the plants, instead of random ones. The density then decides how many of the sites
  /// have plants; it is at most that of the sites.
  std::optional<Rows> rows;
  std::optional<Clusters> clusters{};  ///< by which the density is multiplied; not with rows
  Interval slope_deg{0, 90};           ///< angle between the normal of the facet and the vertical
  Interval height_m{-std::numeric_limits<double>::infinity(),
                    std::numeric_limits<double>::infinity()};
  Interval scale{1, 1};
  std::optional<Weibull> scales{};  ///< distribution of `scale`; else uniform
  Interval yaw_deg{0, 360};         ///< uniformly distributed; about the plant's own z, from x to y
  Stance stance = Stance::Upright;
  double sink_m = 0;               ///< depth in the ground at scale 1, straight down
  std::vector<double> weights{1};  ///< relative frequencies of the prototypes
  std::vector<Clearing> clearings;
  Suitability suitability{};  ///< empty if plants grow everywhere
  glm::dvec2 origin_w_m{0};   ///< D's origin in W; if the DEM is cut, plants stay in place in W
};

/// Returns the smallest rotation that takes the z axis to a unit normal that points up.
glm::dquat tilt_to(const glm::dvec3& normal);

/// Pose of a plant. O is its own frame: z up the stem, the origin where the stem enters the ground.
struct Placement {
  glm::dvec3 p_DO{0};
  glm::dquat R_DO{1, 0, 0, 0};
  double scale = 1;
  std::uint32_t prototype = 0;  ///< index among ScatterSpec::weights
  std::uint64_t key = 0;        ///< unique in the layer, independent of the requested area

  friend bool operator==(const Placement&, const Placement&) = default;
};

/// Returns the extent of a grid's samples in D.
Area area_of(const GridFrame& frame);

/// Layer of plants over the whole ground. Whether a plant stands at a position is a function of
/// seed, layer, minimum distance or rows, clusters, highest density, and of density, suitability,
/// clearings and ground at that position alone. Immutable; any number of threads may query it.
class Scatter {
 public:
  /// Largest number of placements that are returned at once.
  static constexpr std::size_t max_placements = 1'000'000;

  /// @throws Error listing every field of `spec` that is out of bounds; if density and minimum
  ///         distance are incompatible; if cells are too small to be numbered; or if the density
  ///         map does not overlap the ground.
  Scatter(Ground ground, DensityMap density, const ScatterSpec& spec, Seed seed);

  /// Returns the plants whose positions are in `area`, in order of their keys; a larger area
  /// contains the same plants there. The expected number in any region, over all seeds, is the
  /// integral of the density times the suitability over the part of it that the limits permit and
  /// no clearing excludes, with a relative error of at most 2e-4.
  /// @throws Error for more than max_placements plants or 1e9 darts, or if samples of the ground
  ///         cannot be read.
  std::vector<Placement> placements(const Area& area = {}, const PassRunner& runner = {}) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace groundray
