#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Mesh with fewer triangles than the original.
struct ReducedMesh {
  TriangleMesh mesh;  ///< manifold, every vertex in use; without levels
  /// Nearest original vertex, among those merged into each vertex.
  std::vector<std::uint32_t> sources;
  /// Vertex into which each original vertex was merged; 0xffffffff if no triangle used it. For an
  /// original vertex that was divided because it joined several fans, this is that of the first
  /// fan.
  std::vector<std::uint32_t> became;
  std::size_t tangled_edges = 0;  ///< non-manifold or inconsistently wound edges, cut open first
  std::size_t dropped = 0;        ///< triangles that repeated a vertex or another triangle
  bool is_height_field = false;   ///< true if the mesh had no overhang; then the result has none
};

/// Reduces a mesh to a number of triangles. Collapses the edge that changes volume and boundary
/// least, to the position that changes them least, by CGAL. The error is not bounded; measure it.
/// The time grows with the cube of the number of triangles at a vertex: 0.4 s where there are 400,
/// 45 s where there are 2000.
///
/// The result has `triangles` triangles or one fewer, because an interior collapse removes two. It
/// has more if no permitted collapse is left: no collapse changes the topology, or turns a triangle
/// by more than a right angle.
/// If all triangles are counter-clockwise as seen from above, all stay so. A vertex into which none
/// was merged keeps its exact position. Equal meshes give equal results.
/// @param triangles  at least 1.
/// @throws Error listing every fault of the mesh, as check_mesh; if `triangles` is 0; or if more
///         memory is needed than `work` allows.
/// @see Lindstrom, Turk, Fast and memory efficient polygonal simplification, IEEE Visualization
///      (1998); Evaluation of memoryless simplification, IEEE TVCG 5(2) (1999).
ReducedMesh reduce(const TriangleMesh& mesh, std::size_t triangles, const RunControl& work = {});

}  // namespace groundray
