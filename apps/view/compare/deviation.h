#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "apps/scene/simulation.h"
#include "apps/view/rendering/layer.h"
#include "core/geometry/mesh.h"
#include "core/tracing/closest_point.h"
#include "reconstruction/mesh/accuracy/agreement.h"
#include "terrain/ground.h"

namespace groundray {

/// Histogram of deviations, with bins of equal width.
struct DeviationHistogram {
  double low_m = 0, high_m = 0;
  std::vector<std::size_t> counts;   ///< counts per bin, from low to high
  std::size_t below = 0, above = 0;  ///< number of deviations outside [low_m, high_m]
};

/// Statistics of deviations; NaN if there are none.
struct DeviationFigures {
  std::size_t count = 0;   ///< number of points with a deviation
  std::size_t beyond = 0;  ///< number of points without a counterpart in the truth
  double mean_m = 0, rms_m = 0;
  double median_m = 0;
  double nmad_m = 0;     ///< 1.4826 times the median absolute deviation from the median
  double p95_m = 0;      ///< 95 % quantile of the absolute deviation
  double largest_m = 0;  ///< largest absolute deviation
  double low_m = 0, high_m = 0;
};

/// Signed distances of points from the truth.
struct Deviation {
  std::vector<float> signed_m;  ///< deviation per point: positive above or outside; NaN if none
  DeviationFigures figures;
};

/// Progress callback: receives the completed fraction, 0 to 1.
using ShareDone = std::function<void(double share)>;

/// Measures the vertical distances of points from the ground.
/// @param places_m  points in the ground's D.
/// @throws Interrupted if a stop is requested.
Deviation deviation_from_ground(const std::vector<glm::dvec3>& places_m, const Ground& truth,
                                const std::stop_token& stop = {}, const ShareDone& progress = {});

/// Mesh that serves as the truth. Vertices at the same position are merged. Immutable: any number
/// of threads may use one.
class TrueMesh {
 public:
  /// @throws Error as check_mesh.
  explicit TrueMesh(TriangleMesh mesh);

  /// Returns the signed distance of a point from the mesh: positive on the side that the triangles
  /// face. NaN if the point is not finite, or if the nearest point lies on the mesh's boundary and
  /// the offset along the surface exceeds the offset normal to it.
  /// @param near  index of a triangle near the point, as a starting guess; set to the nearest
  ///              triangle.
  /// @see Baerentzen and Aanaes, Signed distance computation using the angle weighted pseudonormal,
  ///      IEEE TVCG 11(3) (2005).
  double signed_distance_m(const glm::dvec3& p, std::uint32_t& near) const;

  const TriangleMesh& mesh() const noexcept { return nearest_.mesh(); }

 private:
  // Feature of a triangle on which a point lies: a corner, the side that starts at a corner, or the
  // face.
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
  std::vector<std::uint32_t> place_;      // first vertex at the position of each vertex
  std::vector<std::uint32_t> next_;       // next half-edge along the same side, cyclic
  std::vector<glm::dvec3> place_normal_;  // angle-weighted, of the first vertex at each position
  std::vector<bool> is_border_;           // true if that vertex lies on the mesh's boundary
};

/// Measures the signed distances of points from a mesh, as TrueMesh::signed_distance_m.
/// @param places_m  points in the mesh's D.
/// @throws Interrupted if a stop is requested.
Deviation deviation_from_mesh(const std::vector<glm::dvec3>& places_m, const TrueMesh& truth,
                              const std::stop_token& stop = {}, const ShareDone& progress = {});

/// Computes agreement() with its default fineness, but stops on request.
/// @throws Interrupted if a stop is requested.
std::vector<Agreement> agreement_until(const TriangleMesh& mesh, const TriangleMesh& truth,
                                       std::span<const double> tolerances_m,
                                       const std::stop_token& stop);

/// Returns the statistics of deviations; NaN counts as `beyond`.
DeviationFigures figures_of(const std::vector<float>& signed_m);

/// Counts deviations in bins.
/// @param range_m  range of the bins; by default the 0.5 % to 99.5 % quantiles and 0.
/// @throws Error if there are no bins or the range is empty or not finite.
DeviationHistogram histogram_of(const std::vector<float>& signed_m, std::size_t bins,
                                std::optional<std::pair<double, double>> range_m = std::nullopt);

/// Returns the names and values of the statistics: "mean", "0.012 m".
std::vector<std::pair<std::string, std::string>> figure_texts(const DeviationFigures& figures);

/// Returns the statistics as text lines: "mean 0.012 m".
std::vector<std::string> figure_lines(const DeviationFigures& figures);
std::vector<std::string> agreement_lines(const std::vector<Agreement>& agreements);

/// Reference that a layer is compared with.
struct Truth {
  /// DEM file.
  struct DemFile {
    std::filesystem::path path;
  };
  std::string name;  ///< name for display, unique among the truths that are offered
  /// Reference surface of a scene, that of a DEM file, or a displayed surface.
  std::variant<std::shared_ptr<const Simulation>, DemFile, Layer> what;
  std::string layer{};  ///< name of the layer that shows it, which is not compared with it
};

/// Comparison of a layer with the truth.
struct Comparison {
  std::string layer, truth;
  Deviation deviation;  ///< deviations of the layer's points
  DeviationHistogram histogram;
  std::vector<Agreement> agreements;  ///< agreement of two surfaces, if a tolerance is given
};

/// Measures the distances of a layer's points from the truth. Thread-safe.
/// @param tolerance_m  tolerance for precision and completeness of two surfaces; 0 to omit them.
/// @throws Interrupted if a stop is requested.
/// @throws Error if a file is invalid, the truth has no triangle, or no point has a deviation.
Comparison compare(const Layer& layer, const Truth& truth, double tolerance_m,
                   const std::stop_token& stop, const ShareDone& progress);

/// Returns the layer coloured by its deviations, as the column "deviation".
Layer coloured_by_deviation(Layer layer, const Comparison& comparison);

}  // namespace groundray
