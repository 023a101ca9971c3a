#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/groundray/mesh/rebuild_report.h"
#include "reconstruction/measured_mesh.h"
#include "reconstruction/scan/scan_mesh.h"

namespace groundray {

/// Where results go.
struct RebuildOutput {
  std::filesystem::path mesh;
  std::optional<std::filesystem::path> occlusion;          ///< what beams passed by
  std::optional<std::filesystem::path> report;             ///< JSON
  std::vector<std::pair<std::string, std::string>> facts;  ///< for the report
};

/// Checks, before work that may take long, that results can be written, each to a file of its own.
/// @param inputs  what will be read: none of these may be written over.
/// @throws Error naming the first fault.
void check_output(const RebuildOutput& output, std::span<const std::filesystem::path> inputs);

/// Writes all that `output` asks for; no file appears before each is whole.
/// @throws Error as the functions for their forms.
void write_output(const RebuildOutput& output, const MeasuredMesh& mesh,
                  const OcclusionFaces& occlusion, const RebuildReport& report);

}  // namespace groundray
