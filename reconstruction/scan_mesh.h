#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "reconstruction/measured_mesh.h"
#include "reconstruction/organised_scan.h"

namespace groundray {

/// Which links between neighbouring returns are taken for surface.
struct ScreeningLimits {
  double incidence_rad = 0;  ///< between a beam and the normal of what it meets, at most
  double longest_m = 0;      ///< edge
  double noise_sds = 3;      ///< how many standard deviations of range an edge may owe to noise
};

/// What a beam passed before it met something, as triangles between beams whose link was not taken
/// for surface. Nothing stands between them and where the beams began.
struct OcclusionFaces {
  TriangleMesh shape;
  std::vector<glm::dvec3> origins_m;  ///< of each vertex: where its beam began
};

/// One scan as a mesh.
struct ScanMesh {
  MeasuredMesh mesh;
  std::vector<float> face_confidence;  ///< of each triangle, 0 to 1
  std::vector<glm::dvec3> origins_m;   ///< of each vertex: where its beam began
  std::vector<std::uint32_t> cells;    ///< of each vertex: number of its cell in the scan
  OcclusionFaces occlusion;
};

}  // namespace groundray
