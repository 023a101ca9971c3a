#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/measured_mesh.h"
#include "reconstruction/work.h"

namespace groundray {

/// Which holes are filled.
struct HoleLimits {
  double longest_m = 0;  ///< rim, at most
  std::size_t most_edges =
      1000;  ///< of a rim; so many take about 9 s, and twice as many four times that
};

/// A closed chain of border edges.
struct Rim {
  std::vector<std::uint32_t> vertices;  ///< in order, as triangles that fill it would run
  double length_m = 0;
  glm::dvec3 middle_m{0};  ///< the mean along the rim
};

/// Why a hole was not filled.
enum class HoleLeft {
  Outline,  ///< the surface ends there: it lies inside of the rim rather than round it
  TooLong,  ///< longer than the limit
  TooManyEdges,
  NotManifold,  ///< an edge of it has more triangles than the one beside the hole
  NoFilling,    ///< no triangles between its vertices make a manifold surface
  Crossing,     ///< what would fill it meets other triangles
};

/// A hole that is closed now.
struct FilledHole {
  Rim rim;
  std::uint32_t first_vertex = 0, vertices = 0;  ///< of the mesh: those within the rim
  std::uint32_t first_triangle = 0, triangles = 0;
  std::uint32_t islands = 0;  ///< pieces of surface in the hole that were joined to it
  bool is_smooth = true;      ///< whether it goes on smoothly from the rim; else it is flat
};

/// A hole that was left, and why.
struct OpenHole {
  Rim rim;
  HoleLeft why = HoleLeft::TooLong;
};

/// A mesh some of whose holes were filled.
struct FilledMesh {
  MeasuredMesh mesh;                   ///< what was measured, as it was; then what was filled in
  std::size_t measured_vertices = 0;   ///< the first so many vertices were measured,
  std::size_t measured_triangles = 0;  ///< and the first so many triangles; no others
  std::vector<FilledHole> filled;      ///< in the order of their triangles
  std::vector<OpenHole> left;
};

/// Fills the holes of a mesh with surface as fine as round about, that goes on smoothly.
///
/// A hole is a rim, a closed chain of borders, with the surface round it. Where the surface lies
/// inside, the rim is an outline and stays, however short it is: scans end somewhere, and so do the
/// pieces that they fall into. They are told apart by how the surface beside the rim faces: an
/// outline is where that is, in the mean, within 60 degrees of a sheet inside the rim that is wound
/// likewise. So both ends of a tube are holes, the border of a flat dome is an outline, and that of
/// all of a ball but a small cap is a hole. What fills a hole passes by pieces of surface within;
/// those that it would cross are joined to the rim. Holes with a piece that touches the rim at a
/// vertex alone are mostly left.
///
/// Vertices that are filled in have no confidence, the label of the nearest vertex of the rim, and
/// a standard deviation of its `sd_m` and a third of its distance, in quadrature: that covers, with
/// three standard deviations, surface that leaves the rim by up to 45 degrees. Levels are left out.
///
/// Filling moves nothing, joins no more than two triangles at an edge, and crosses nothing: where
/// the smooth surface would, a flat one is tried before the hole is left. Results do not depend on
/// the number of threads.
/// @throws Error naming every fault of the mesh, as check_mesh; if `sd_m`, `labels` or `confidence`
///         are not one for each vertex or none; if longest_m is negative or not a number; or if
///         more memory is needed than `work` allows.
/// @see Liepa, Filling holes in meshes, SGP (2003); Botsch, Kobbelt, An intuitive framework for
///      real-time freeform modeling, SIGGRAPH (2004).
FilledMesh fill_holes(MeasuredMesh mesh, const HoleLimits& limits, const Work& work = {});

}  // namespace groundray
