#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/mesh/measured_mesh.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Limits on the holes to fill.
struct HoleLimits {
  double longest_m = 0;  ///< longest boundary
  /// Largest number of boundary edges: 1000 take about 9 s, twice as many four times that.
  std::size_t most_edges = 1000;
};

/// Closed chain of boundary edges.
struct HoleBoundary {
  std::vector<std::uint32_t> vertices;  ///< in the winding order of triangles that fill it
  double length_m = 0;
  glm::dvec3 middle_m{0};  ///< mean position along the boundary
};

/// Reason why a hole was not filled.
enum class HoleLeft {
  Outline,  ///< the chain is the outline of the surface, which lies inside it rather than around it
  TooLong,  ///< boundary longer than HoleLimits::longest_m
  TooManyEdges,
  NotManifold,  ///< an edge of the boundary has more than one triangle, or there are only two edges
  NoFilling,    ///< no triangulation of the boundary's vertices is manifold
  Crossing,     ///< the patch would intersect other triangles
};

/// Hole that was filled.
struct FilledHole {
  HoleBoundary boundary;
  std::uint32_t first_vertex = 0, vertices = 0;  ///< added vertices, numbered in the mesh
  std::uint32_t first_triangle = 0, triangles = 0;
  std::uint32_t islands = 0;  ///< pieces of surface in the hole that were joined to its boundary
  bool is_smooth = true;      ///< true if continued smoothly from the boundary; else flat
};

/// Hole that was left open, and the reason.
struct OpenHole {
  HoleBoundary boundary;
  HoleLeft why = HoleLeft::TooLong;
};

/// Mesh some of whose holes were filled.
struct FilledMesh {
  MeasuredMesh mesh;                   ///< the measured mesh, unchanged, followed by the patches
  std::size_t measured_vertices = 0;   ///< number of measured vertices, which come first
  std::size_t measured_triangles = 0;  ///< number of measured triangles, which come first
  std::vector<FilledHole> filled;      ///< in the order of their triangles
  std::vector<OpenHole> left;
};

/// Fills holes of a mesh with smooth surface as fine as the surrounding triangles.
///
/// A hole is a closed chain of boundary edges with surface around it. If the surface lies inside
/// the chain, the chain is an outline and stays, however short it is: the end of a scan, or of a
/// separate piece of surface. The two are distinguished by the orientation of the surface along the
/// chain: at an outline it is, on average, within 60 degrees of a sheet inside the chain with the
/// same winding. Both ends of a tube are thus holes, the boundary of a flat dome is an outline, and
/// that of a ball without a small cap is a hole. Patches avoid pieces of surface inside a hole;
/// pieces that a patch would intersect are joined to the boundary. Holes with a piece that touches
/// the boundary at a single vertex are mostly left open.
///
/// Filled-in vertices have confidence 0, the label of the nearest boundary vertex, and a standard
/// deviation that covers surface which leaves the boundary at up to 45 degrees. Levels are omitted.
///
/// Filling moves no vertex, leaves at most two triangles at an edge, and creates no intersections:
/// where the smooth patch would intersect, a flat one is tried before the hole is left open.
/// Results do not depend on the number of threads.
/// @throws Error listing every fault of the mesh, as check_mesh; if `sd_m`, `labels` or
///         `confidence` do not have one value per vertex or none; if longest_m is negative or not a
///         number; or if more memory is needed than `work` allows.
/// @see Liepa, Filling holes in meshes, SGP (2003); Botsch, Kobbelt, An intuitive framework for
///      real-time freeform modeling, SIGGRAPH (2004).
FilledMesh fill_holes(MeasuredMesh mesh, const HoleLimits& limits, const RunControl& work = {});

}  // namespace groundray
