#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/mesh.h"
#include "reconstruction/work.h"

namespace groundray {

/// A mesh with fewer triangles than it had.
struct ReducedMesh {
  TriangleMesh mesh;  ///< manifold, every vertex in use; no levels
  /// Of each vertex: which of the original vertices that went into it is the nearest.
  std::vector<std::uint32_t> sources;
  /// Of each original vertex: the vertex that it went into, 0xffffffff if no triangle had it. One
  /// that joined triangles at its point alone was parted; this is where its first part went.
  std::vector<std::uint32_t> became;
  std::size_t tangled_edges = 0;  ///< of more than two triangles or wound unlike: cut open before
  std::size_t dropped = 0;        ///< triangles that repeated a vertex or another triangle
  bool is_height_field = false;   ///< whether no triangle hung over; then none does now
};

/// Reduces a mesh to so many triangles: edges are collapsed, the one next that changes volume and
/// border least, to the place that changes them least. No error is bounded: measure it. The cost
/// and place are CGAL's, and so is the error to a tenth of a percent; it takes less than half as
/// long.
///
/// The result has as many triangles as asked or one less, for an edge takes two along; more where
/// nothing is left that may collapse: no collapse changes what is connected or turns a triangle
/// over. If seen from above all triangles are counter-clockwise, all stay so. A vertex
/// that nothing went into keeps its position to the last bit. Equal meshes give equal results.
/// @param triangles  at least 1.
/// @throws Error naming every fault of the mesh, as check_mesh; if no triangle is asked for; or if
///         more memory is needed than `work` allows.
/// @see Lindstrom, Turk, Fast and memory efficient polygonal simplification, IEEE Visualization
///      (1998); Evaluation of memoryless simplification, IEEE TVCG 5(2) (1999).
ReducedMesh reduce(const TriangleMesh& mesh, std::size_t triangles, const Work& work = {});

}  // namespace groundray
