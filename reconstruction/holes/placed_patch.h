#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh.h"
#include "reconstruction/holes/hole_patch.h"
#include "reconstruction/holes/mesh_rims.h"

namespace groundray {

/// A patch and the rim that it closes.
struct PlacedPatch {
  const HolePatch* patch = nullptr;
  std::span<const std::uint32_t> rim;  ///< its vertices in the mesh, in the patch's order
};

/// Adds a patch's points and triangles behind those of the mesh.
void append(TriangleMesh& mesh, const PlacedPatch& placed);

/// Whether a patch may stay.
struct Fit {
  bool is_good = true;
  std::vector<std::uint32_t> crossed;  ///< triangles of the mesh, ascending
};

/// Finds the patches that may be added to a mesh together: none has an edge that another or the
/// mesh has as well, but for the rim, and none crosses itself, another or the mesh. Of two that are
/// in each other's way the first stays.
/// @param mesh   gets the patches for a while; is as it was in the end.
/// @param stars  of the mesh.
/// @param kept   stay in any case.
/// @return for each of `tried`.
std::vector<Fit> find_fitting(TriangleMesh& mesh, const VertexStars& stars,
                              std::span<const PlacedPatch> kept,
                              std::span<const PlacedPatch> tried);

}  // namespace groundray
