#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/closest_point.h"
#include "core/mesh.h"
#include "core/ray_tracer.h"
#include "reconstruction/accuracy/angle_spread.h"
#include "reconstruction/accuracy/area_share.h"

namespace groundray {

/// The largest distance that a point of one surface has from another, enclosed: rounding is within
/// the bounds.
struct LargestDistance {
  double at_least_m = 0;            ///< a point of the surface is that far: `from`
  double at_most_m = 0;             ///< none is farther, between vertices either
  glm::dvec3 from{0};               ///< on the surface
  glm::dvec3 to{0};                 ///< the other's point nearest to it
  std::uint32_t from_triangle = 0;  ///< that `from` lies on
  std::uint32_t to_triangle = 0;    ///< that `to` lies on
  std::size_t pieces = 0;           ///< of triangles that were looked at
};

/// The Hausdorff distance between two surfaces, enclosed.
struct HausdorffDistance {
  double at_least_m = 0, at_most_m = 0;
};

/// Returns the larger of what was found from one surface to another and back.
HausdorffDistance hausdorff(const LargestDistance& forth, const LargestDistance& back);

/// Equal steps of distance from 0 on.
struct DistanceBins {
  double width_m = 0;  ///< 0 for no bins
  std::size_t count = 0;
};

/// A length that was measured, and bounds between which the true one lies.
struct BoundedLength {
  double value_m = 0;
  double at_least_m = 0, at_most_m = 0;
};

/// Means over a surface, each part by its area, of the distance to another.
struct MeanDistance {
  BoundedLength mean, rms;
  /// Angles between the surface's normals and those of the nearest triangles: of samples.
  AngleSpread turn;
  double area_m2 = 0;
  std::size_t samples = 0;
  std::vector<double> bins_m2;    ///< area of each bin's distances, then of those beyond
  std::vector<double> largest_m;  ///< of each triangle, the largest distance of its samples
};

/// How finely an error is measured.
struct ErrorFineness {
  /// Where surfaces cross within the parts that have a sample, means come out low: by 1 % of
  /// terrain that was thinned eightfold, with a sample for each triangle.
  /// About, at least one for each triangle; up to 16 times as many where there are needles, and
  /// then fewer by area.
  double samples = 1e5;
  double largest_share = 0.05;  ///< between the bounds of the largest distance, of the upper one
  /// To look at. Where they do not suffice, as where the error is even and far below the size of
  /// triangles, the bounds hold but are farther apart.
  std::size_t most_pieces = 50'000;
};

/// How far a surface is from another, one way, in four figures.
struct OneSidedError {
  double at_least_m = 0, at_most_m = 0;  ///< between which the largest distance lies
  BoundedLength mean, rms;               ///< over the surface, by area
};

/// How far a surface is from another, one way: from each point of it to the nearest point of the
/// other. Where the other surface goes on and this one ends nothing is seen, so ask both ways.
/// Immutable; any number of threads may ask at once. Results do not depend on the number of
/// threads that work.
class MeshDistance {
 public:
  /// @throws Error naming every fault of a mesh, as check_mesh.
  MeshDistance(const TriangleMesh& from, const TriangleMesh& to,
               const RayDevice& device = RayDevice());

  /// As above, of meshes in one frame. Their origin should not be much farther than they are large,
  /// for doubles to tell small distances: all is computed in that frame.
  MeshDistance(const TriangleMesh& from, const ClosestPoint& to);

  /// Finds the largest distance: splits triangles where it may lie until the bounds are
  /// `tolerance_m` apart.
  /// @param most_pieces  to look at; where they do not suffice the bounds hold but are farther
  ///                     apart.
  /// @throws Error if the tolerance is not positive, or below what doubles tell of such meshes.
  LargestDistance largest(double tolerance_m, std::size_t most_pieces = 20'000'000) const;

  /// Measures means with a sample amid each of the triangles' parts, whose edges are at most
  /// `step_m` long. The bounds come from a distance changing by no more than the place does, and
  /// from that to one triangle being convex: the upper ones are near, the lower ones are some
  /// 0.29 steps away unless the distances themselves are small.
  /// @throws Error if the step is not positive or asks for more than 1e9 samples, or the surface
  ///         has no area.
  MeanDistance mean(double step_m, const DistanceBins& bins = {}) const;

  /// Measures all at once, by default in some microseconds for each triangle of the finer surface.
  /// @throws Error if the fineness is not positive, or the surface has no area.
  OneSidedError error(const ErrorFineness& fineness = {}) const;

  /// Measures, for each tolerance, how much of the surface is no farther than it: the precision of
  /// a mesh from which one asks for a truth, the completeness the other way round.
  /// @param weight  what places count, none for all alike; one value is taken for each part, amid
  ///                it, and bounds hold for weights that are so.
  /// @throws Error if a tolerance is not positive, there are more than 12 quarterings, a weight is
  ///         negative or not finite, nothing has weight, or as mean.
  std::vector<AreaShare> within(std::span<const double> tolerances_m,
                                const ShareFineness& fineness = {},
                                const SurfaceWeight& weight = {}) const;

  /// Returns the step that takes about so many samples, if triangles are larger than it.
  double step_for_m(double samples) const noexcept;

  double area_m2() const noexcept { return area_m2_; }
  /// Bounds what rounding does to a distance, metres.
  double rounding_m() const noexcept { return rounding_m_; }

 private:
  void measure();
  void check_area() const;

  glm::dvec3 origin_m_{0};  // of the frame in which all is computed
  TriangleMesh from_;       // in that frame
  ClosestPoint to_;
  double area_m2_ = 0;
  double rounding_m_ = 0;
};

}  // namespace groundray
