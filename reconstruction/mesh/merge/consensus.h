#pragma once

#include <cstddef>
#include <span>

#include "reconstruction/mesh/measured_mesh.h"
#include "reconstruction/mesh/merge/redundant_faces.h"
#include "reconstruction/mesh/merge/stitched_mesh.h"

namespace groundray {

/// Scan as used for the consensus.
struct ConsensusScan {
  const RatedSurface* rated = nullptr;
  const MeasuredMesh* mesh = nullptr;    ///< labels and confidence
  const VertexCovers* covers = nullptr;  ///< coverage of its vertices by other scans
};

/// Moves each vertex along its normal to the weighted mean of the scans' surfaces; the weight is
/// that of the scan's triangle there over its variance. The standard deviation becomes that of this
/// mean, as for independent vertices. Label and confidence are taken from the scan with the
/// greatest triangle weight. Refuted triangles are ignored.
/// @return number of vertices that more than one scan has seen.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994), section 6.
std::size_t move_to_consensus(StitchedMesh& stitched, std::span<const ConsensusScan> scans);

}  // namespace groundray
