#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/mesh/simplify/star.h"
#include "reconstruction/mesh/surface_mesh.h"

namespace groundray {

/// Kind of line that an edge to be kept belongs to.
enum class LineKind : std::uint8_t { Border, Labels, Crease };

/// Edges that are kept: boundaries, both sides of changes of label, and creases. A vertex inside a
/// line may only collapse along it; one where lines end or meet stays. Each edge stores the
/// vertices of the line that were collapsed into it.
class FeatureLines {
 public:
  /// @param labels     of each vertex, or empty.
  /// @param angle_rad  angle between the normals of two triangles above which their edge is a
  ///                   crease.
  /// @param deep_m     of each vertex: smallest depth of a crease, i.e. distance from the
  ///                   neighbouring triangle's plane. Empty for 0.
  FeatureLines(const SurfaceMesh& mesh, const std::vector<std::uint16_t>& labels, double angle_rad,
               const std::vector<float>& deep_m);

  /// Edges of lines at a vertex.
  struct Crossing {
    std::size_t edges = 0;
    std::array<std::size_t, 2> spokes{};  ///< of the first two: index in the ring
  };
  Crossing crossing(const Star& star) const noexcept;

  /// Returns true if lines and labels permit the centre to move onto ring[to]. If it is inside a
  /// line, the caller must still check that the line stays in place.
  bool may_leave(const Star& star, const Crossing& crossing, std::size_t to) const {
    if (!labels_.empty() && labels_[star.centre] != labels_[star.ring[to]]) return false;
    return crossing.edges == 0 || (crossing.edges == 2 && may_leave_along(star, crossing, to));
  }

  /// Edge that two edges of a line become, and the vertices that it will represent.
  struct Merged {
    LineKind kind = LineKind::Border;
    std::uint32_t onto = none, other_end = none;
    std::vector<std::uint32_t> vertices;  ///< all that were collapsed, the centre last
  };
  void gather(const Star& star, const Crossing& crossing, std::size_t to, Merged& merged) const;

  /// Records that the centre moves onto ring[to]; to be called right before the mesh does so.
  void collapse(const Star& star, const Crossing& crossing, std::size_t to);

  /// Adds a vertex to those collapsed into the edge of a line.
  void add(SurfaceMesh::HalfedgeHandle edge, std::uint32_t vertex);
  /// Returns true if a vertex was collapsed into an edge of a line.
  bool is_left(std::uint32_t vertex) const noexcept { return is_left_[vertex]; }
  /// Returns true if the edge belongs to a line.
  bool has(SurfaceMesh::HalfedgeHandle edge) const noexcept { return line(edge) != none; }

 private:
  struct Edge {
    LineKind kind = LineKind::Border;
    std::uint32_t first = none, last = none;  // of the vertices collapsed into it
  };

  // Returns the index in `lines_` of the edge of a half-edge, or none.
  std::uint32_t line(SurfaceMesh::HalfedgeHandle h) const noexcept {
    return edges_[number_of(h) / 2];
  }
  bool may_leave_along(const Star& star, const Crossing& crossing, std::size_t to) const;
  void mark(const SurfaceMesh& mesh, SurfaceMesh::HalfedgeHandle h, LineKind kind);
  void append(Edge& edge, std::uint32_t first, std::uint32_t last) noexcept;

  std::vector<std::uint32_t> edges_;  // of each edge: index in `lines_`, or none
  std::vector<Edge> lines_;
  std::vector<std::uint32_t> next_;  // of each collapsed vertex
  std::vector<std::uint8_t> is_on_;  // of each vertex: initially on a line; others never will be
  std::vector<bool> is_left_;
  std::vector<std::uint16_t> labels_;
};

/// Returns twice the area of a triangle in plan view, positive if it is counter-clockwise.
template <typename Point>
double twice_plan_area_m2(const Point& a, const Point& b, const Point& c) noexcept {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Returns the vector from `p` to the nearest point of the edge from `a` to `b`.
inline glm::dvec3 vector_to_edge(const glm::dvec3& p, const glm::dvec3& a,
                                 const glm::dvec3& b) noexcept {
  const glm::dvec3 edge = b - a, from = a - p;
  const double square = glm::dot(edge, edge);
  if (!(square > 0)) return from;
  return from + std::clamp(-glm::dot(from, edge) / square, 0.0, 1.0) * edge;
}

/// Vertex of the original: its position and, once collapsed, the list that it belongs to.
struct Sample {
  glm::dvec3 p_m{0};
  std::uint32_t next = none;  ///< next vertex collapsed into the same triangle
  float tolerance_m = 0;      ///< permitted distance of the surface
};

/// Mesh that is being simplified. Its vertices do not move: one is removed when an edge collapses
/// onto its other end.
struct DecimationState {
  /// @param shape  a manifold.
  /// @param labels, crease_rad, deep_m  as for FeatureLines.
  /// @param tolerances_m  permitted distance of the surface from each vertex.
  DecimationState(const TriangleMesh& shape, const std::vector<std::uint16_t>& labels,
                  double crease_rad, const std::vector<float>& tolerances_m,
                  const std::vector<float>& deep_m);

  SurfaceMesh mesh;
  FeatureLines lines;
  std::vector<Sample> samples;  ///< of each vertex
  std::size_t triangles = 0;    ///< number of triangles left
};

/// Rules that decide which collapses are permitted. Collapses are tested and made one at a time.
class CollapseRules {
 public:
  CollapseRules() = default;
  CollapseRules(const CollapseRules&) = delete;
  CollapseRules& operator=(const CollapseRules&) = delete;
  virtual ~CollapseRules() = default;

  /// Returns true if the star's centre may move onto ring[to], which lines and labels allow.
  virtual bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) = 0;
  /// Records the collapse, right after it was allowed and before the mesh and its lines change.
  virtual void collapse(const Star& star, const FeatureLines::Crossing& crossing,
                        std::size_t to) = 0;
};

/// Treatment of overhangs in a surface without any: allowed, or rejected.
enum class Overhang { Allow, Refuse };

/// Keeps a surface manifold and its triangles from being flipped or becoming slivers, regardless of
/// the distance from the original.
class ShapeRules final : public CollapseRules {
 public:
  /// @param piece  must outlive this.
  ShapeRules(const DecimationState& piece, Overhang overhang)
      : piece_(piece), overhang_(overhang) {}

  bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;
  void collapse(const Star&, const FeatureLines::Crossing&, std::size_t) override {}

  /// Returns the fan of the latest collapse tested.
  const Fan& fan() const noexcept { return fan_; }
  /// Returns the outer ends of its edges, in order.
  const std::vector<glm::dvec3>& rim_m() const noexcept { return rim_m_; }
  const glm::dvec3& tip_m() const noexcept { return tip_m_; }

 private:
  bool is_sound(const Star& star, std::size_t i) const;

  const DecimationState& piece_;
  Overhang overhang_;
  Fan fan_;
  glm::dvec3 tip_m_{0};
  std::vector<glm::dvec3> rim_m_;
};

}  // namespace groundray
