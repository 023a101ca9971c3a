#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/accuracy/accuracy.h"

/// Division of surfaces into small parts, each sampled at its centroid, for means over an area. Not
/// installed.
namespace groundray {

/// Triangle with the quantities that quadrature requires.
struct QuadratureTriangle {
  glm::dvec3 a, ab, ac;
  glm::dvec3 normal;  ///< twice the area long
  double area_m2 = 0;
  double longest_m = 0;  ///< longest edge
  double spread_m2 = 0;  ///< mean square of the distance from its centroid
  double radius_m = 0;   ///< largest distance from its centroid

  QuadratureTriangle(const TriangleMesh& mesh, std::size_t triangle);
};

/// Part of a triangle, similar to it.
struct SurfacePart {
  std::uint32_t triangle = 0;
  glm::dvec3 middle{0};
  double scale = 1;  ///< relative to the triangle; negative if turned by 180 degrees

  double area_m2(const QuadratureTriangle& facet) const noexcept {
    return scale * scale * facet.area_m2;
  }
  std::array<glm::dvec3, 3> corners(const QuadratureTriangle& facet) const noexcept;
  /// Returns the four parts into which the midpoints of its edges divide it.
  std::array<SurfacePart, 4> quarters(const QuadratureTriangle& facet) const noexcept;
};

/// Surface divided into parts whose edges are at most one step long; identical for any number of
/// threads. A triangle without area is a single part, whatever its length. The mesh must outlive
/// it.
class SurfaceParts {
 public:
  /// @throws Error if the step is not positive or yields more than 1e9 parts.
  SurfaceParts(const TriangleMesh& mesh, double step_m);

  /// Returns `step_m`, doubled until the mesh has at most 16 parts for each of `samples` and one
  /// for each triangle. Sliver triangles may otherwise yield many more parts than the step was
  /// chosen for.
  static double widened_m(const TriangleMesh& mesh, double step_m, double samples);

  /// Calls `visit(facet, part, sums)` for each part. Batches (lots) of neighbouring parts are
  /// visited in order, each with a copy of `empty`, and several batches at once; `take(sums)` is
  /// called for each batch in order, by one thread at a time.
  template <typename Sums, typename Visit, typename Take>
  void sum_up(const Sums& empty, const Visit& visit, const Take& take) const {
    constexpr std::size_t at_once = 256;  // lots in memory
    for (std::size_t first = 0; first < lots(); first += at_once) {
      std::vector<Sums> some(std::min(at_once, lots() - first), empty);
      in_parallel(some.size(), [&](std::size_t i) {
        for (std::size_t rows = lots_[first + i]; rows < lots_[first + i + 1]; ++rows)
          visit_rows(rows_[rows], some[i], visit);
      });
      for (Sums& sums : some) take(sums);
    }
  }

  std::size_t lots() const noexcept { return lots_.size() - 1; }
  /// Returns a bound of the relative rounding error of a sum of areas.
  double sum_rounding() const noexcept;

 private:
  /// Rows of a triangle's parts: the triangle is divided into splits^2 parts.
  struct Rows {
    std::uint32_t triangle = 0;
    std::uint32_t splits = 1;
    std::uint32_t begin = 0, end = 0;
  };

  /// Calls `work(i)` for each i below `count`, several at once.
  static void in_parallel(std::size_t count, const std::function<void(std::size_t)>& work);

  template <typename Sums, typename Visit>
  void visit_rows(const Rows& rows, Sums& sums, const Visit& visit) const {
    const QuadratureTriangle facet(mesh_, rows.triangle);
    const double third = 1 / (3.0 * rows.splits), scale = 1.0 / rows.splits;
    for (std::uint32_t row = rows.begin; row < rows.end; ++row) {
      const std::uint32_t in_row = 2 * (rows.splits - row) - 1;  // upright and inverted parts
      for (std::uint32_t k = 0; k < in_row; ++k) {
        const bool is_turned = k % 2 != 0;
        const double middle = is_turned ? 2 : 1, column = (k - k % 2) / 2.0;
        const glm::dvec3 p = facet.a + (3 * column + middle) * third * facet.ab +
                             (3 * row + middle) * third * facet.ac;
        visit(facet, SurfacePart{rows.triangle, p, is_turned ? -scale : scale}, sums);
      }
    }
  }

  const TriangleMesh& mesh_;
  std::vector<Rows> rows_;
  std::vector<std::size_t> lots_;  // first entry of each in `rows_`, and the end
};

/// Area-weighted sums over the parts of a surface.
struct DistanceSums {
  double distance = 0, square = 0;   // of the distance at the centroids, and its square
  double low = 0, low_square = 0;    // of lower bounds of the parts' means
  double high = 0, high_square = 0;  // of upper bounds of the parts' means
  double spread = 0, area_m2 = 0;
  std::size_t samples = 0;

  /// Adds a part.
  /// @param distance_m       at the part's centroid.
  /// @param spread_m         bound of the root-mean-square difference from it over the part.
  /// @param high_m           upper bound of the mean over the part.
  /// @param high_square_m2   upper bound of the mean square over the part.
  void add(double distance_m, double spread_m, double high_m, double high_square_m2,
           double part_m2) noexcept;
  void operator+=(const DistanceSums& more) noexcept;

  struct Means {
    BoundedLength mean, rms;
  };
  /// @param rounding_m    rounding error of each distance.
  /// @param sum_rounding  relative rounding error of the sums.
  Means means(double rounding_m, double sum_rounding) const noexcept;
};

/// Distance of a surface part: at its centroid, and bounds over all its points.
struct PartDistance {
  double middle_m = 0;
  double at_least_m = 0, at_most_m = 0;
};

/// Areas within each tolerance.
struct ShareSums {
  struct Areas {
    double within = 0;  // by the distance at the centroids
    double surely_within = 0, maybe_within = 0;
  };
  std::vector<Areas> areas;
  double all = 0;
  std::uint32_t near = 0;
  bool has_bad_weight = false;  // true if any is negative or not finite

  void add(const PartDistance& distance, double area, std::span<const double> tolerances_m);
  void operator+=(const ShareSums& more);
  /// Returns the fraction of the area within each tolerance.
  /// @throws Error if the total weight is zero, or any weight is negative or not finite.
  std::vector<AreaShare> shares(double sum_rounding) const;
};

/// @throws Error naming the first that is not positive and finite, or if there is none.
void check_tolerances(std::span<const double> tolerances_m);

/// @throws Error if there are more than 12: each takes four times as long.
void check_quarterings(unsigned quarterings);

/// Returns true if, for any tolerance, the bounds leave open whether all of a part is within it.
bool is_open(const PartDistance& distance, std::span<const double> tolerances_m);

/// Adds a part's weighted area; divides the part into four, up to `quarterings` times, where its
/// bounds leave a tolerance open.
/// @param distance  returns the PartDistance of (facet, part, near), and may change near.
/// @param weight    returns the weight of (part).
template <typename Distance, typename Weight>
void add_shares(const QuadratureTriangle& facet, const SurfacePart& part,
                std::span<const double> tolerances_m, unsigned quarterings,
                const Distance& distance, const Weight& weight, ShareSums& sums) {
  const PartDistance found = distance(facet, part, sums.near);
  if (quarterings > 0 && is_open(found, tolerances_m)) {
    for (const SurfacePart& quarter : part.quarters(facet)) {
      add_shares(facet, quarter, tolerances_m, quarterings - 1, distance, weight, sums);
    }
    return;
  }
  const double counts = weight(part);
  if (!(counts >= 0) || !std::isfinite(counts)) sums.has_bad_weight = true;
  sums.add(found, counts * part.area_m2(facet), tolerances_m);
}

}  // namespace groundray
