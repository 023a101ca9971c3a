#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/groundray/mesh/rebuild_report.h"
#include "reconstruction/mesh/measured_mesh.h"
#include "reconstruction/mesh/scan/scan_mesh.h"

namespace groundray {

/// Output files.
struct RebuildOutput {
  std::filesystem::path mesh;
  std::optional<std::filesystem::path> occlusion;          ///< mesh of the rejected links
  std::optional<std::filesystem::path> report;             ///< JSON
  std::vector<std::pair<std::string, std::string>> facts;  ///< names and values for the report
};

/// Checks, before long computations, that the results can be written, each to its own file.
/// @param inputs  input files, which must not be overwritten.
/// @throws Error naming the first fault.
void check_output(const RebuildOutput& output, std::span<const std::filesystem::path> inputs);

/// Writes all requested results; no file appears before all are complete.
/// @throws Error as the writers of the formats.
void write_output(const RebuildOutput& output, const MeasuredMesh& mesh,
                  const OcclusionFaces& occlusion, const RebuildReport& report);

}  // namespace groundray
