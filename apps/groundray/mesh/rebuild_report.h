#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/io/mesh_io.h"
#include "reconstruction/mesh/accuracy/agreement.h"
#include "reconstruction/mesh/holes/hole_fill.h"
#include "reconstruction/mesh/merge/mesh_merge.h"
#include "reconstruction/mesh/simplify/simplify.h"

namespace groundray {

/// Statistics of one scan.
struct ScanTally {
  std::string name;
  std::size_t rows = 0;           ///< rows of the file
  std::size_t no_returns = 0;     ///< rows without a return
  std::size_t other_returns = 0;  ///< omitted returns: another one of their pulse is used
  std::size_t crowded = 0;        ///< omitted returns: another pulse is in their cell
  std::size_t used = 0;           ///< remaining returns
  std::size_t accepted = 0;       ///< triangles accepted as surface
  std::size_t rejected = 0;       ///< rejected triangles: occlusion faces
};

/// Statistics of holes.
struct HoleTally {
  std::size_t filled = 0, triangles = 0;
  std::vector<OpenHole> left;
};

/// Statistics of simplification.
struct SimplifyTally {
  std::size_t from = 0, to = 0;  ///< numbers of triangles
  HaltReason halted_by = HaltReason::Bound;
  MeshRepairs repairs;  ///< repairs of the original mesh
  TwoSidedError error;  ///< between the original (first) and the simplified mesh (second)
  std::optional<VerticalError> vertical;  ///< present for terrain without overhangs
};

/// Report on a reconstruction.
struct RebuildReport {
  std::vector<std::pair<std::string, std::string>> facts;  ///< names and values about the command
  std::vector<ScanTally> scans;
  std::optional<MergeCounts> merged;
  std::optional<HoleTally> holes;
  std::optional<SimplifyTally> simplified;
  std::size_t vertices = 0, triangles = 0;  ///< numbers in the written mesh
  double area_m2 = 0;
  Georeference georeference;
  std::vector<std::pair<std::string, double>> seconds;  ///< duration of each stage
  std::vector<std::string> notes;
};

/// Prints a report as text.
void print(const RebuildReport& report);

/// Writes a report as JSON (docs/reference/formats.md). @throws Error as write_whole.
void write_json(const std::filesystem::path& path, const RebuildReport& report);

}  // namespace groundray
