#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "core/closest_point.h"
#include "core/height_grid.h"
#include "core/mesh.h"
#include "reconstruction/accuracy/agreement.h"
#include "terrain/ground.h"

namespace groundray {

/// Counts of deviations in equal steps.
struct DeviationHistogram {
  double low_m = 0, high_m = 0;
  std::vector<std::size_t> counts;   ///< from low to high
  std::size_t below = 0, above = 0;  ///< of what lies beyond
};

/// Numbers over deviations. NaN of none.
struct DeviationFigures {
  std::size_t count = 0;   ///< of places that have a deviation
  std::size_t beyond = 0;  ///< of places that the truth has nothing below, above or beside
  double mean_m = 0, rms_m = 0;
  double median_m = 0;
  double nmad_m = 0;     ///< 1.4826 times the median of distances to the median
  double p95_m = 0;      ///< 95 % are no larger, in size
  double largest_m = 0;  ///< in size
  double low_m = 0, high_m = 0;
};

/// How far places are from the truth.
struct Deviation {
  std::vector<float> signed_m;  ///< of each place: above or outside is positive; NaN beyond
  DeviationFigures figures;
};

/// What the one that waits is told: the share that is done, 0 to 1.
using ShareDone = std::function<void(double share)>;

/// Measures how far places are above the ground, up and down.
/// @param places_m  in the ground's D, plus `shift_m`.
/// @throws Interrupted if asked to stop.
Deviation deviation_from_ground(const std::vector<glm::dvec3>& places_m, const Ground& truth,
                                const glm::dvec3& shift_m = glm::dvec3(0),
                                const std::stop_token& stop = {}, const ShareDone& progress = {});

/// A mesh that others are measured against. Vertices at one place are one. Immutable; any number of
/// threads may ask.
class TrueMesh {
 public:
  /// @throws Error as check_mesh.
  explicit TrueMesh(TriangleMesh mesh);

  /// Returns how far a place is from the mesh: positive on the side that triangles face; NaN where
  /// the nearest point is on the mesh's border and the place more aside of it than above, or is not
  /// finite.
  /// @param near  a triangle near the place, for speed; set to the nearest.
  /// @see Baerentzen and Aanaes, Signed distance computation using the angle weighted pseudonormal,
  ///      IEEE TVCG 11(3) (2005).
  double signed_distance_m(const glm::dvec3& p, std::uint32_t& near) const;

  const TriangleMesh& mesh() const noexcept { return nearest_.mesh(); }

 private:
  // Where on a triangle a point lies: on its corner, its side from that corner on, or amid it.
  enum class Part { Corner, Side, Face };
  struct Feature {
    Part part = Part::Face;
    std::uint32_t half_edge = 0;  // 3 * triangle + corner
  };
  void link_sides();
  void weigh_normals();
  Feature feature_of(const NearestPoint& nearest) const;
  glm::dvec3 face_normal(std::uint32_t triangle) const;
  glm::dvec3 side_normal(std::uint32_t half_edge) const;

  ClosestPoint nearest_;
  std::vector<std::uint32_t> place_;      // of each vertex: the first one at its place
  std::vector<std::uint32_t> next_;       // of each half-edge: the next of those along one side
  std::vector<glm::dvec3> place_normal_;  // of each vertex that is the first at its place
  std::vector<bool> is_border_;           // likewise: whether the mesh ends there
};

/// Measures how far places are from a mesh, as TrueMesh::signed_distance_m.
/// @param places_m  in the mesh's D, plus `shift_m`. @throws Interrupted if asked to stop.
Deviation deviation_from_mesh(const std::vector<glm::dvec3>& places_m, const TrueMesh& truth,
                              const glm::dvec3& shift_m = glm::dvec3(0),
                              const std::stop_token& stop = {}, const ShareDone& progress = {});

/// As agreement() at its usual fineness, but ends when asked to. @throws Interrupted then.
std::vector<Agreement> agreement_until(const TriangleMesh& mesh, const TriangleMesh& truth,
                                       std::span<const double> tolerances_m,
                                       const std::stop_token& stop);

/// Returns the numbers over deviations, those that are NaN being beyond.
DeviationFigures figures_of(const std::vector<float>& signed_m);

/// Counts deviations. @param range_m  else from the 0.5 % to the 99.5 % quantile, with 0 in it.
/// @throws Error if there are no bins or the range is empty or not finite.
DeviationHistogram histogram_of(const std::vector<float>& signed_m, std::size_t bins,
                                std::optional<std::pair<double, double>> range_m = std::nullopt);

/// Returns the numbers as lines for people: "mean 0.012 m".
std::vector<std::string> figure_lines(const DeviationFigures& figures);
std::vector<std::string> agreement_lines(const std::vector<Agreement>& agreements);

/// Returns the places of all samples of a DEM, row by row; those of holes have a height of NaN, and
/// so no deviation.
std::vector<glm::dvec3> sample_places_m(const HeightGrid& dem);

}  // namespace groundray
