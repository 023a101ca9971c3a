#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>

#include "apps/dataset/scan_files.h"
#include "apps/dataset/scan_input.h"
#include "apps/groundray/mesh/rebuild_output.h"
#include "reconstruction/mesh/holes/hole_fill.h"
#include "reconstruction/mesh/merge/mesh_merge.h"
#include "reconstruction/mesh/scan/scan_mesh.h"
#include "reconstruction/mesh/simplify/simplify.h"

namespace groundray {

/// Steps after a mesh has been built.
struct Finishing {
  std::optional<double> fill_m;       ///< fill holes with a boundary up to this length
  std::optional<StopCriterion> stop;  ///< stop condition of simplification; none: no simplification
  SimplifyOptions simplify;
  std::optional<double> sd_m;  ///< standard deviation of vertices; replaces the mesh's own
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();
};

/// Options for building a mesh from scans.
struct Meshing {
  std::optional<ScreeningLimits> screening;  ///< default: ground(), or object() for range grids
  std::optional<double> incidence_rad, longest_m, noise_sds;  ///< replace those of the screening
  MergeLimits merging;
  std::optional<double> apart_m;  ///< replaces that of `merging`; default without noise: by spacing
  std::optional<double> perimeter_m;  ///< unorganised points: largest perimeter of a triangle
};

/// Builds a mesh from scans, writes it and prints a report. Writes either all files or none.
/// @throws Error as the functions of the steps.
void rebuild_mesh(const ScanChoice& choice, const ScanTaking& taking, const Meshing& meshing,
                  const Finishing& finishing, const RebuildOutput& output);

/// Fills and simplifies an existing mesh in the same way.
void finish_mesh(const std::filesystem::path& mesh, const Finishing& finishing,
                 const RebuildOutput& output);

}  // namespace groundray
