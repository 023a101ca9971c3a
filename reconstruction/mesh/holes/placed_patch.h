#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "reconstruction/mesh/holes/hole_patch.h"
#include "reconstruction/mesh/holes/mesh_boundary.h"

namespace groundray {

/// Patch and the boundary that it closes.
struct PlacedPatch {
  const HolePatch* patch = nullptr;
  std::span<const std::uint32_t> boundary;  ///< vertices of the mesh, in the patch's order
};

/// Appends a patch's points and triangles to the mesh.
void append(TriangleMesh& mesh, const PlacedPatch& placed);

/// Result of testing whether a patch may stay.
struct Fit {
  bool is_good = true;
  std::vector<std::uint32_t> crossed;  ///< triangles of the mesh that it intersects, ascending
};

/// Selects the patches that can be added to a mesh together: none shares an edge with another or
/// the mesh, except for the boundary, and none intersects itself, another or the mesh. Of two in
/// conflict, the first stays.
/// @param mesh   changed temporarily; restored on return.
/// @param stars  of the mesh, as from stars_of.
/// @param kept   patches that stay in any case.
/// @return one for each of `tried`.
std::vector<Fit> find_fitting(TriangleMesh& mesh, const Buckets& stars,
                              std::span<const PlacedPatch> kept,
                              std::span<const PlacedPatch> tried);

}  // namespace groundray
