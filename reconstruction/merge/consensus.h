#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "reconstruction/measured_mesh.h"
#include "reconstruction/merge/quilt.h"
#include "reconstruction/merge/redundant_faces.h"

namespace groundray {

/// A scan as consensus asks it.
struct ConsensusScan {
  const RatedSurface* rated = nullptr;
  const MeasuredMesh* mesh = nullptr;    ///< labels and confidence
  const VertexCovers* covers = nullptr;  ///< of its vertices
};

/// Moves each vertex along its normal to the mean of where scans have the surface, weighted by what
/// their triangles are worth there over their variance; the standard deviation becomes that of this
/// mean, as if it came from as many independent vertices. Label and confidence become those of the
/// scan worth most. Triangles that are refuted say nothing.
/// @return the number of vertices that more than one scan has seen.
/// @see Turk, Levoy, Zippered polygon meshes from range images (1994), section 6.
std::size_t move_to_consensus(Quilt& quilt, std::span<const ConsensusScan> scans);

}  // namespace groundray
