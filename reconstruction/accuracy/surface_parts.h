#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

#include "core/mesh.h"

/// Surfaces in small parts, each with a sample amid it: for those who measure over an area. Not
/// installed.
namespace groundray {

/// A triangle as quadrature sees it.
struct Facet {
  glm::dvec3 a, ab, ac;
  glm::dvec3 normal;  ///< twice the area long
  double area_m2 = 0;
  double longest_m = 0;  ///< edge
  double spread_m2 = 0;  ///< mean square of the distance from its middle
  double radius_m = 0;   ///< largest distance from its middle

  Facet(const TriangleMesh& mesh, std::size_t triangle);
};

/// A part of a triangle, of its shape.
struct SurfacePart {
  std::uint32_t triangle = 0;
  glm::dvec3 middle{0};
  double scale = 1;  ///< of the triangle; negative where it is turned by half

  double area_m2(const Facet& facet) const noexcept { return scale * scale * facet.area_m2; }
  std::array<glm::dvec3, 3> corners(const Facet& facet) const noexcept;
  /// Returns the parts that the middles of its edges cut it into.
  std::array<SurfacePart, 4> quarters(const Facet& facet) const noexcept;
};

/// A surface cut into parts whose edges are at most one step long, the same for any number of
/// threads. A triangle without area is one part, whatever its length. The mesh must outlive it.
class SurfaceParts {
 public:
  /// @throws Error if the step is not positive or there were more than 1e9 parts.
  SurfaceParts(const TriangleMesh& mesh, double step_m);

  /// Widens a step that was chosen for so many samples, which by needles may become many more:
  /// doubles it until a mesh has at most 16 parts for each sample and one for each triangle.
  static double widened_m(const TriangleMesh& mesh, double step_m, double samples);

  /// Calls `visit(facet, part, sums)` for each part. Lots of neighbouring parts are visited in
  /// order, each with a copy of `empty`, and several lots at once; `take(sums)` is called for each
  /// lot in order, by one thread at a time.
  template <typename Sums, typename Visit, typename Take>
  void sum_up(const Sums& empty, const Visit& visit, const Take& take) const {
    constexpr std::size_t at_once = 256;  // lots that are kept
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
  /// Bounds what adding up areas loses, as a share of the sum.
  double sum_rounding() const noexcept;

 private:
  /// Some rows of a triangle's parts: the triangle is cut into splits^2.
  struct Rows {
    std::uint32_t triangle = 0;
    std::uint32_t splits = 1;
    std::uint32_t begin = 0, end = 0;
  };

  /// Calls `work(i)` for each i below `count`, several at once.
  static void in_parallel(std::size_t count, const std::function<void(std::size_t)>& work);

  template <typename Sums, typename Visit>
  void visit_rows(const Rows& rows, Sums& sums, const Visit& visit) const {
    const Facet facet(mesh_, rows.triangle);
    const double third = 1 / (3.0 * rows.splits), scale = 1.0 / rows.splits;
    for (std::uint32_t row = rows.begin; row < rows.end; ++row) {
      const std::uint32_t in_row = 2 * (rows.splits - row) - 1;  // upright parts and turned ones
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
  std::vector<std::size_t> lots_;  // first rows of each, and the end
};

}  // namespace groundray
