#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/tracing/closest_point.h"
#include "core/tracing/ray_tracer.h"
#include "reconstruction/mesh/accuracy/angle_spread.h"

namespace groundray {

/// Fraction of an area, 0 to 1, estimated from samples, with bounds that enclose the true fraction.
struct AreaShare {
  double value = 0;
  double at_least = 0, at_most = 1;
};

/// Resolution at which area fractions are measured.
struct ShareFineness {
  double step_m = 0;  ///< longest edge of the sampled parts; 0 for about 1e5 parts
  /// Largest number of times that a part is divided into four while its bounds leave open whether
  /// all of it is within a tolerance; at most 12.
  unsigned quarterings = 2;
};

/// Weight of a point of a surface, 0 or more; for instance 0 where it cannot be seen. Called by
/// several threads at once, with a triangle and a point on it; must always return the same value.
using SurfaceWeight = std::function<double(std::uint32_t triangle, const glm::dvec3& p)>;

/// Largest distance from a point of one surface to another surface, enclosed between bounds that
/// include rounding errors.
struct LargestDistance {
  double at_least_m = 0;            ///< lower bound, attained at `from`
  double at_most_m = 0;             ///< upper bound for all points, not only vertices
  glm::dvec3 from{0};               ///< point of the first surface
  glm::dvec3 to{0};                 ///< nearest point of the other surface
  std::uint32_t from_triangle = 0;  ///< triangle that contains `from`
  std::uint32_t to_triangle = 0;    ///< triangle that contains `to`
  std::size_t pieces = 0;           ///< parts of triangles examined
};

/// Bounds of the Hausdorff distance between two surfaces.
struct HausdorffDistance {
  double at_least_m = 0, at_most_m = 0;
};

/// Returns the bounds of the Hausdorff distance: the larger of the distances in both directions.
HausdorffDistance hausdorff(const LargestDistance& forth, const LargestDistance& back);

/// Histogram bins of equal width, from distance 0 on.
struct DistanceBins {
  double width_m = 0;  ///< 0 for no histogram
  std::size_t count = 0;
};

/// Measured length, with bounds that enclose the true length.
struct BoundedLength {
  double value_m = 0;
  double at_least_m = 0, at_most_m = 0;
};

/// Sample of a surface, at the centroid of a part of it.
struct DistanceSample {
  glm::dvec3 p{0};
  double distance_m = 0;  ///< to the other surface
  double area_m2 = 0;     ///< of the part
};

/// Receives each sample that counts, in an order that does not depend on the number of threads; one
/// call at a time.
using SampleVisitor = std::function<void(const DistanceSample&)>;

/// Area-weighted means over a surface of the distance to another surface.
struct MeanDistance {
  BoundedLength mean, rms;
  /// Angles between the surface's normals and those of the nearest triangles, at the samples.
  AngleSpread turn;
  double area_m2 = 0;
  std::size_t samples = 0;
  std::vector<double> bins_m2;    ///< area in each bin, then the area beyond the last bin
  std::vector<double> largest_m;  ///< of each triangle, the largest distance of its samples
  double ignored_m2 = 0;          ///< area of the parts that were left out
  /// Bounds of the largest distance from the parts that count.
  double largest_at_least_m = 0, largest_at_most_m = 0;
};

/// Resolution of an error measurement.
struct ErrorFineness {
  /// Approximate number of samples, at least one per triangle. Sliver triangles can raise it up to
  /// 16-fold; beyond that, the sampling by area becomes coarser. Means are underestimated where the
  /// surfaces intersect within the part that a sample represents: by 1 % for terrain decimated
  /// eightfold, with one sample per triangle.
  double samples = 1e5;
  double largest_share = 0.05;  ///< permitted gap between the bounds of the largest distance,
                                ///< relative to the upper bound
  /// Largest number of parts to examine. If it does not suffice, for instance where the error is
  /// uniform and far below the size of triangles, the bounds remain valid but lie farther apart.
  std::size_t most_pieces = 50'000;
};

/// One-sided distance from a surface to another: bounds of the largest distance, mean and root mean
/// square.
struct OneSidedError {
  double at_least_m = 0, at_most_m = 0;  ///< bounds of the largest distance
  BoundedLength mean, rms;               ///< area-weighted over the surface
};

/// One-sided distance between two surfaces: from each point of `from` to the nearest point of `to`.
/// Parts of `to` that extend beyond `from` do not contribute, so measure both directions.
/// Immutable; safe for concurrent use. Results do not depend on the number of threads.
class MeshDistance {
 public:
  /// @throws Error listing every fault of a mesh, as check_mesh.
  MeshDistance(const TriangleMesh& from, const TriangleMesh& to,
               const RayDevice& device = RayDevice());

  /// Overload for meshes in one frame, in which all computations take place. The frame's origin
  /// should be no farther from the meshes than about their size, so that double precision resolves
  /// small distances.
  MeshDistance(const TriangleMesh& from, const ClosestPoint& to);

  /// Finds the largest distance: splits triangles where it may lie until the bounds are
  /// `tolerance_m` apart.
  /// @param most_pieces  largest number of parts to examine; if it does not suffice, the bounds
  ///                     remain valid but lie farther apart.
  /// @throws Error if the tolerance is not positive, or below the rounding error of such meshes.
  LargestDistance largest(double tolerance_m, std::size_t most_pieces = 20'000'000) const;

  /// Measures means with one sample at the centroid of each part of the triangles. The edges of the
  /// parts are at most `step_m` long. The bounds follow from the distance being 1-Lipschitz and
  /// from the distance to a single triangle being convex. Upper bounds are tight; lower bounds are
  /// about 0.29 steps too low unless the distances themselves are small.
  /// @param ignore_beyond_m  parts whose centroid is farther than this from the other surface are
  ///                         left out of all results but `area_m2` and `ignored_m2`. If all are,
  ///                         the means are NaN.
  /// @throws Error if the step is not positive or requires more than 1e9 samples, or the surface
  ///         has no area.
  MeanDistance mean(double step_m, const DistanceBins& bins = {},
                    double ignore_beyond_m = std::numeric_limits<double>::infinity(),
                    const SampleVisitor& visit = {}) const;

  /// Measures the largest distance and the means in one call; by default in a few microseconds per
  /// triangle of the finer surface.
  /// @throws Error if `fineness` is out of range, or the surface has no area.
  OneSidedError error(const ErrorFineness& fineness = {}) const;

  /// Measures the fraction of the surface that is within each tolerance of the other: the precision
  /// if `from` is a mesh and `to` the truth, the completeness in the other direction.
  /// @param weight  weight of each point, uniform if empty; evaluated once per part, at its
  ///                centroid. The bounds hold for weights that are constant over each part.
  /// @throws Error if a tolerance is not positive, there are more than 12 quarterings, a weight is
  ///         negative or not finite, the total weight is zero, or as mean().
  std::vector<AreaShare> within(std::span<const double> tolerances_m,
                                const ShareFineness& fineness = {},
                                const SurfaceWeight& weight = {}) const;

  /// Returns the step, m, that yields about `samples` samples if the triangles are larger than it.
  double step_for_m(double samples) const noexcept;

  double area_m2() const noexcept { return area_m2_; }
  /// Returns a bound of the rounding error of a distance, m.
  double rounding_m() const noexcept { return rounding_m_; }

 private:
  void measure();
  void check_area() const;

  glm::dvec3 origin_m_{0};  // origin of the frame of all computations
  TriangleMesh from_;       // in that frame
  ClosestPoint to_;
  double area_m2_ = 0;
  double rounding_m_ = 0;
};

}  // namespace groundray
