#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/mesh/merge/cover_surface.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Surface of one scan with weights of its triangles: where two scans show the same surface, the
/// triangle with the greater weight is kept.
struct RatedSurface {
  CoverSurface surface;
  std::vector<float> worth;      ///< weight of each triangle
  std::vector<char> is_refuted;  ///< of each triangle: 1 if other scans contradict it; or empty

  bool refutes(std::size_t triangle) const {
    return !is_refuted.empty() && is_refuted[triangle] != 0;
  }
};

/// Returns the weights of triangles: their confidence, smoothed because that of a single triangle
/// is noisy, and reduced towards the boundary, where the visible surface is about to turn away.
/// @param confidence  of each triangle, or empty for 1.
std::vector<float> rate_faces(const CoverSurface& surface, std::span<const float> confidence);

/// Returns the mean weight of each vertex's triangles; 0 if it has none.
std::vector<float> worth_of_vertices(const RatedSurface& rated);

constexpr std::uint32_t not_covered = 0xffffffff;

/// Coverage of one scan's vertices: for each vertex v, from v * scans on, the triangle of each scan
/// that covers it, or `not_covered`. Refuted triangles cover nothing; a scan does not cover its own
/// vertices.
struct VertexCovers {
  std::size_t scans = 0;
  std::vector<std::uint32_t> triangles;

  std::span<const std::uint32_t> of(std::uint32_t vertex) const {
    return std::span(triangles).subspan(vertex * scans, scans);
  }
};

/// Returns the coverage of each scan's vertices.
std::vector<VertexCovers> find_covers(std::span<const RatedSurface> scans, const RunControl& work);

/// Returns for each scan which of its triangles to keep. A triangle is redundant if every position
/// on it is covered by a kept triangle of another scan with a greater weight, or with an equal one
/// in an earlier scan. No refuted triangle is kept. The positions tested are its corners and, where
/// the covering triangles are finer, further samples. To keep seams short, small holes that this
/// leaves are closed again, and small islands are removed where other kept triangles cover them.
/// @param covers         of each scan, from find_covers.
/// @param interpolation  permitted distance of a triangle from the surface between its corners, per
///                       metre of its longest edge.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994), section 4.1.
std::vector<std::vector<char>> keep_best_faces(std::span<const RatedSurface> scans,
                                               std::span<const VertexCovers> covers,
                                               double interpolation, const RunControl& work);

}  // namespace groundray
