#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/merge/cover_surface.h"
#include "reconstruction/work.h"

namespace groundray {

/// One scan's surface and what its triangles are worth: of two that show the same place the one
/// worth more is kept.
struct RatedSurface {
  CoverSurface surface;
  std::vector<float> worth;      ///< of each triangle
  std::vector<char> is_refuted;  ///< of each triangle, 1 where it cannot be; or empty

  bool refutes(std::size_t triangle) const {
    return !is_refuted.empty() && is_refuted[triangle] != 0;
  }
};

/// Returns what triangles are worth: their confidence, smooth, for a single triangle's is noise,
/// and less towards the border, where what is seen is about to turn away.
/// @param confidence  of each triangle, or empty for 1.
std::vector<float> rate_faces(const CoverSurface& surface, std::span<const float> confidence);

/// Returns of each vertex what its triangles are worth in the mean; 0 where it has none.
std::vector<float> worth_of_vertices(const RatedSurface& rated);

constexpr std::uint32_t not_covered = 0xffffffff;

/// Of each vertex of one scan, the triangle of each scan that covers it, or `not_covered`; those
/// that are refuted cover nothing. Those of vertex v begin at v * scans. Its own scan covers none.
struct VertexCovers {
  std::size_t scans = 0;
  std::vector<std::uint32_t> triangles;

  std::span<const std::uint32_t> of(std::uint32_t vertex) const {
    return std::span(triangles).subspan(vertex * scans, scans);
  }
};

/// Returns those of each scan.
std::vector<VertexCovers> find_covers(std::span<const RatedSurface> scans, const Work& work);

/// Returns for each scan which of its triangles to keep. A triangle is redundant where each place
/// of it is covered by one that is kept, is another scan's, and is worth more, or as much in an
/// earlier scan; none is kept that is refuted. Places are its corners and, where what covers it is
/// finer, more of it. Holes of few triangles that this makes are closed again, and islands of few
/// triangles left out where others that are kept cover them, so that seams are few.
/// @param covers         of each scan, from find_covers.
/// @param interpolation  how far, for each metre of its longest edge, a triangle may be from the
///                       surface between its corners.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994), section 4.1.
std::vector<std::vector<char>> keep_best_faces(std::span<const RatedSurface> scans,
                                               std::span<const VertexCovers> covers,
                                               double interpolation, const Work& work);

}  // namespace groundray
