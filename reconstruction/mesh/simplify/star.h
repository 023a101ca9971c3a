#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "reconstruction/mesh/surface_mesh.h"

namespace groundray {

/// Vertex and its neighbourhood, counter-clockwise as seen from outside.
struct Star {
  const SurfaceMesh* mesh = nullptr;
  std::uint32_t centre = 0;
  std::vector<std::uint32_t> ring;                  ///< neighbours
  std::vector<SurfaceMesh::HalfedgeHandle> spokes;  ///< from the centre to each of the ring

  /// Returns true if the vertex is on the boundary. Then the ring has one vertex more than there
  /// are triangles; otherwise the last triangle ends where the first begins.
  bool is_open() const noexcept { return mesh->is_boundary(spokes.back()); }
  /// Returns the number of triangles; triangle i is centre, ring[i], ring[i + 1].
  std::size_t triangles() const noexcept { return spokes.size() - (is_open() ? 1 : 0); }
  std::uint32_t triangle(std::size_t i) const noexcept {
    return number_of(mesh->face_handle(spokes[i]));
  }
};

/// Collects the neighbourhood of a vertex.
void gather(const SurfaceMesh& mesh, std::uint32_t vertex, Star& star);

/// Fan of triangles that replaces a star when its centre moves onto ring[to]. Its outer edges are
/// consecutive edges of the ring; triangles are numbered from the first of them on.
struct Fan {
  std::size_t first = 0;      ///< triangle of the star that becomes the first of the fan
  std::size_t triangles = 0;  ///< number of triangles that remain

  Fan() = default;
  Fan(const Star& star, std::size_t to) noexcept {
    const std::size_t count = star.triangles();
    first = star.is_open() ? (to == 0 ? 1 : 0) : (to + 1) % count;
    triangles = star.is_open() ? count - 1 : count - 2;
  }
};

/// Returns true if the surface stays a manifold of the same topology when the centre moves onto
/// ring[to]: the link condition holds, and no triangle vanishes whose two other edges are both on
/// the boundary. For a star at the boundary, `to` must be the first or the last.
/// @see Dey, Edelsbrunner, Guha, Nekhayev, Topology preserving edge contraction (1999).
bool may_collapse(const Star& star, std::size_t to);

/// Moves the centre onto ring[to]: one triangle vanishes at the boundary, otherwise two.
void collapse(SurfaceMesh& mesh, const Star& star, std::size_t to);

}  // namespace groundray
