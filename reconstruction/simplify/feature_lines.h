#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/simplify/collapsible_mesh.h"

namespace groundray {

/// What an edge that is to be kept is part of.
enum class LineKind : std::uint8_t { Border, Labels, Crease };

/// Edges that are to be kept: where surfaces end, on either side of where labels change, and where
/// a surface is bent. A vertex amid a line may leave it along the line alone; one where lines end
/// or meet stays. Each edge knows which vertices of the line left for it.
class FeatureLines {
 public:
  /// @param angle_rad  between the normals of two triangles, above which their edge is a crease;
  ///                   `deep_m` of each vertex: nearer to its neighbour's plane, a triangle is not
  ///                   bent. Empty for 0.
  /// @param labels     of each vertex, or none for all.
  FeatureLines(const CollapsibleMesh& mesh, const std::vector<glm::dvec3>& places_m,
               const std::vector<std::uint16_t>& labels, double angle_rad,
               const std::vector<float>& deep_m);

  /// The edges of lines at a vertex.
  struct Crossing {
    std::size_t edges = 0;
    std::array<std::size_t, 2> spokes{};  ///< of the first two: which of the ring's vertices
  };
  Crossing crossing(const Star& star) const noexcept;

  /// Whether the centre may move onto ring[to] for all that lines say. Where it is amid a line, it
  /// remains to see whether the line stays where it was.
  bool may_leave(const Star& star, const Crossing& crossing, std::size_t to) const noexcept {
    if (!labels_.empty() && labels_[star.centre] != labels_[star.ring[to]]) return false;
    return crossing.edges == 0 || (crossing.edges == 2 && may_leave_along(star, crossing, to));
  }

  /// The edge that two of a line become, and what it will stand for.
  struct Merged {
    LineKind kind = LineKind::Border;
    std::uint32_t onto = none, other_end = none;
    std::vector<std::uint32_t> vertices;  ///< all that left, the centre last
  };
  void gather(const Star& star, const Crossing& crossing, std::size_t to, Merged& merged) const;

  /// Notes, right before the mesh does so, that the centre moves onto ring[to].
  void collapse(const CollapsibleMesh& mesh, const Star& star, const Crossing& crossing,
                std::size_t to);

  /// Adds a vertex to those that left for the edge of a line.
  void add(HalfEdge edge, std::uint32_t vertex);
  /// Whether a vertex left for an edge of a line.
  bool is_left(std::uint32_t vertex) const noexcept { return is_left_[vertex]; }
  /// Whether the edge is one of a line.
  bool has(HalfEdge edge) const noexcept { return edges_[edge] != none; }

  /// Returns the edge from a star's centre to ring[i].
  static HalfEdge spoke(const Star& star, std::size_t i) noexcept {
    return i < star.spokes.size() ? star.spokes[i] : before(star.spokes.back());
  }

 private:
  struct Edge {
    LineKind kind = LineKind::Border;
    std::uint32_t first = none, last = none;  // of those that left for it
  };

  bool may_leave_along(const Star& star, const Crossing& crossing, std::size_t to) const noexcept;
  void mark(const CollapsibleMesh& mesh, HalfEdge h, LineKind kind);
  void append(Edge& edge, std::uint32_t first, std::uint32_t last) noexcept;

  std::vector<std::uint32_t> edges_;  // of each half-edge: which of `lines_`, or none
  std::vector<Edge> lines_;
  std::vector<std::uint32_t> next_;  // of each vertex that left
  std::vector<std::uint8_t> is_on_;  // of each vertex: was on a line at first; else it never will
  std::vector<bool> is_left_;
  std::vector<std::uint16_t> labels_;
};

}  // namespace groundray
