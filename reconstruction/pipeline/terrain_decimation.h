#pragma once

#include "core/geometry/height_grid.h"
#include "reconstruction/run_control.h"
#include "terrain/judge/mesh_deviation.h"
#include "terrain/terrain_mesh.h"

namespace groundray {

/// Triangle mesh of few triangles, and its measured deviation from the reference surface.
struct DecimatedTerrain {
  TerrainMesh mesh;  ///< without levels
  judge::MeshDeviation deviation;
};

/// Returns the mesh of a DEM with as few triangles as edge collapses leave. It covers exactly the
/// facets of the reference surface, and deviates from it by at most `max_error_m`, at samples and
/// between them; the deviation of the whole mesh is measured without sampling. A quarter to a half
/// of the triangles of build_terrain_mesh, in some twenty times its time.
/// @param max_error_m  positive.
/// @param work         takes up to 1.4 kB per sample.
/// @throws Error as simplify; if there is no facet.
DecimatedTerrain decimate_terrain(const HeightGrid& grid, double max_error_m,
                                  const RunControl& work = {});

}  // namespace groundray
