#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh_io.h"
#include "reconstruction/accuracy/two_sided_error.h"
#include "reconstruction/holes/hole_fill.h"
#include "reconstruction/merge/mesh_merge.h"
#include "reconstruction/simplify/simplify.h"

namespace groundray {

/// What became of one scan.
struct ScanTally {
  std::string name;
  std::size_t rows = 0;           ///< of the file
  std::size_t no_returns = 0;     ///< among them
  std::size_t other_returns = 0;  ///< of a pulse for which another return stands
  std::size_t crowded = 0;        ///< returns that share a cell with another pulse's
  std::size_t used = 0;           ///< returns that are left
  std::size_t accepted = 0;       ///< triangles that are surface
  std::size_t rejected = 0;       ///< those that are not: occlusion faces
};

/// What became of holes.
struct HoleTally {
  std::size_t filled = 0, triangles = 0;
  std::vector<OpenHole> left;
};

/// What became of a mesh as it was simplified.
struct SimplifyTally {
  std::size_t from = 0, to = 0;  ///< triangles
  HaltReason halted_by = HaltReason::Bound;
  MeshRepairs repairs;                    ///< of the mesh before
  TwoSidedError error;                    ///< of the mesh before (first) and after (second)
  std::optional<VerticalError> vertical;  ///< of terrain
};

/// All that a reconstruction did.
struct RebuildReport {
  std::vector<std::pair<std::string, std::string>> facts;  ///< of the command, by name
  std::vector<ScanTally> scans;
  std::optional<MergeCounts> merged;
  std::optional<HoleTally> holes;
  std::optional<SimplifyTally> simplified;
  std::size_t vertices = 0, triangles = 0;  ///< of what was written
  double area_m2 = 0;
  Georeference georeference;
  std::vector<std::pair<std::string, double>> seconds;  ///< of each stage
  std::vector<std::string> notes;
};

/// Prints a report for people.
void print(const RebuildReport& report);

/// Writes a report as JSON (docs/formats.md). @throws Error as write_whole.
void write_json(const std::filesystem::path& path, const RebuildReport& report);

}  // namespace groundray
