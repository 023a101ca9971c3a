#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/mesh/measured_mesh.h"
#include "reconstruction/mesh/scan/organised_scan.h"

namespace groundray {

/// Limits within which links between neighbouring returns are accepted as surface.
struct ScreeningLimits {
  double incidence_rad = 0;  ///< largest angle between a beam and the surface normal
  double longest_m = 0;      ///< longest edge
  double noise_sds = 3;      ///< standard deviations of range that noise may contribute to an edge

  /// Returns limits for ground robots, which see most of the ground at grazing incidence: 88
  /// degrees, 3 m.
  static ScreeningLimits ground() noexcept;
  /// Returns limits for use where correctness matters more than completeness: 85 degrees, 2 m.
  static ScreeningLimits strict() noexcept;
  /// Returns limits for objects scanned at close range: edges of at most four times the beam
  /// spacing, i.e. 75.5 degrees, and of any length.
  /// @see Turk, Levoy, Zippered polygon meshes from range images (1994), section 3.
  static ScreeningLimits object() noexcept;
};

/// Rejected triangles between neighbouring beams, which bound the region that no beam has seen.
/// Nothing stands between them and the origins of the beams.
struct OcclusionFaces {
  TriangleMesh shape;
  std::vector<glm::dvec3> origins_m;  ///< of each vertex: origin of its beam
};

/// Mesh of one scan. Its vertices are those that a triangle uses, in the order of cells.
struct ScanMesh {
  MeasuredMesh mesh;
  std::vector<float> face_confidence;  ///< of each triangle, 0 to 1
  std::vector<glm::dvec3> origins_m;   ///< of each vertex: origin of its beam
  std::vector<std::uint32_t> cells;    ///< of each vertex: number of its cell in the scan
  OcclusionFaces occlusion;
};

/// Links beams that are neighbours in rows and columns: four returns make two triangles along the
/// shorter diagonal, three make one. All triangles face the origins of their beams.
///
/// An edge is surface if it is at most `longest_m` long and at most as long as two beams could see
/// on a plane at the incidence limit, plus noise. A triangle is surface if its edges are and its
/// own incidence is within the limit, with the same allowance. All other triangles, including those
/// whose beams cross, are occlusion faces. The surface is thus consistently oriented.
///
/// A face's confidence is the cosine of its incidence, times 4 area / longest² if that is below 1,
/// times the mean factor of its vertices, which is 1/4 on the mesh's boundary and rises to 1 three
/// edges inside. A vertex's is the mean of its faces' first two factors, times its own factor.
///
/// A scan of one row or column, or without returns, has no triangle. Takes several passes over the
/// cells, and about 200 bytes per cell.
/// @throws Error listing every fault of the limits or the scan.
/// @see docs/theory/reconstruction.md; Turk, Levoy, Zippered polygon meshes from range images
///      (1994), sections 3 and 4: links, and confidence that falls towards the boundary.
ScanMesh link(const OrganisedScan& scan, const ScreeningLimits& limits);

}  // namespace groundray
