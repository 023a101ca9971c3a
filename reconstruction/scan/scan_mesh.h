#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/measured_mesh.h"
#include "reconstruction/scan/organised_scan.h"

namespace groundray {

/// Which links between neighbouring returns are taken for surface.
struct ScreeningLimits {
  double incidence_rad = 0;  ///< between a beam and the normal of what it meets, at most
  double longest_m = 0;      ///< edge
  double noise_sds = 3;      ///< how many standard deviations of range an edge may owe to noise

  /// For robots on the ground, most of which they see at grazing incidence: 88 degrees, 3 m.
  static ScreeningLimits ground() noexcept;
  /// Where what is there counts for more than how much of it: 85 degrees, 2 m.
  static ScreeningLimits strict() noexcept;
  /// For objects scanned from near: edges of at most four times the spacing of beams, which is 75.5
  /// degrees, and of any length.
  /// @see Turk, Levoy, Zippered polygon meshes from range images (1994), section 3.
  static ScreeningLimits object() noexcept;
};

/// What a beam passed before it met something, as triangles between beams whose link was not taken
/// for surface. Nothing stands between them and where the beams began.
struct OcclusionFaces {
  TriangleMesh shape;
  std::vector<glm::dvec3> origins_m;  ///< of each vertex: where its beam began
};

/// One scan as a mesh. Vertices are those that a triangle has, in the order of cells.
struct ScanMesh {
  MeasuredMesh mesh;
  std::vector<float> face_confidence;  ///< of each triangle, 0 to 1
  std::vector<glm::dvec3> origins_m;   ///< of each vertex: where its beam began
  std::vector<std::uint32_t> cells;    ///< of each vertex: number of its cell in the scan
  OcclusionFaces occlusion;
};

/// Links beams that are neighbours in rows and columns: four returns make two triangles along the
/// shorter diagonal, three make one. All triangles face where their beams began.
///
/// An edge is surface if it is no longer than `longest_m`, and than one that two beams could see on
/// a plane at the incidence limit, noise allowed for: across / cos(incidence) + noise_sds * sd,
/// where `across` is how far the beams are apart at the nearer return (from the angle between them,
/// and how far apart they began), and sd that of the two ranges' difference. A triangle is surface
/// if its edges are and its own incidence is no greater, with the same allowance: the plane's slope
/// against the beams is linear in the three ranges, so the sd of the slope is known. The other
/// triangles are occlusion faces: no four or three returns are left out. A triangle whose beams
/// cross is among these, so all others have one orientation.
///
/// A face's confidence is the cosine of its incidence, times 4 area / longest² where that is below
/// 1 (it is 1 for half of a square), times the mean of what its vertices are worth, which is 1/4 on
/// the mesh's border and rises to 1 three edges inside. A vertex's is the mean of its faces' first
/// two factors, times what it is worth.
///
/// A scan of one row or column, or without returns, has no triangle. Takes one pass after another
/// over the cells, and some 200 bytes for each.
/// @throws Error naming every fault of the limits or the scan.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994), sections 3 and 4: links,
///      and confidence that falls to the border.
ScanMesh link(const OrganisedScan& scan, const ScreeningLimits& limits);

}  // namespace groundray
