#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>

#include "apps/dataset/scan_files.h"
#include "apps/dataset/scan_input.h"
#include "apps/groundray/mesh/rebuild_output.h"
#include "reconstruction/holes/hole_fill.h"
#include "reconstruction/merge/mesh_merge.h"
#include "reconstruction/scan/scan_mesh.h"
#include "reconstruction/simplify/simplify.h"

namespace groundray {

/// What is done to a mesh once it is there.
struct Finishing {
  std::optional<double> fill_m;  ///< holes up to this rim
  std::optional<Halt> halt;      ///< simplify until then
  SimplifyOptions simplify;
  std::optional<double> sd_m;  ///< of vertices, instead of what the mesh tells
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();
};

/// How scans become one mesh.
struct Meshing {
  std::optional<ScreeningLimits> screening;  ///< else ground(), of range grids object()
  std::optional<double> incidence_rad, longest_m, noise_sds;  ///< instead of its own
  MergeLimits merging;
  std::optional<double> apart_m;      ///< instead of its own; else a guess where no noise is known
  std::optional<double> perimeter_m;  ///< points without order: of a triangle, at most
};

/// Builds a mesh from scans, writes it and prints what was done. Nothing is written unless all is.
/// @throws Error as the parts do.
void rebuild_mesh(const ScanChoice& choice, const ScanTaking& taking, const Meshing& meshing,
                  const Finishing& finishing, const RebuildOutput& output);

/// Fills and simplifies a mesh of anybody's likewise.
void finish_mesh(const std::filesystem::path& mesh, const Finishing& finishing,
                 const RebuildOutput& output);

}  // namespace groundray
