#pragma once

#include "apps/golden/conform/pass_folder.h"
#include "apps/golden/report.h"
#include "terrain/terrain_mesh.h"

namespace groundray::golden {

/// Reads a mesh between samples of a DEM.
/// @throws Error if a vertex is no sample, or a triangle names no vertex.
TerrainMesh read_sample_mesh(const HeightGrid& grid, const ArrayFolder& folder);

/// Class `bytes`: all arrays of the mesher are equal, byte for byte.
Section judge_bytes(const PassFolder& ours, const ArrayFolder& theirs);

/// Class `mesh`: the same leaves and triangles, in any order; keys are never below ours, and at
/// most one float above.
Section judge_mesh(const PassFolder& ours, const ArrayFolder& theirs);

/// Class `bound`: any mesh between samples that covers each facet of the DEM once, without
/// T-junctions, and deviates by no more than the bound.
Section judge_bound(const PassFolder& ours, const ArrayFolder& theirs);

}  // namespace groundray::golden
