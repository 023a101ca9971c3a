#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/dataset/scan_files.h"
#include "apps/dataset/scan_input.h"
#include "apps/groundray/command.h"
#include "core/io/mesh_io.h"
#include "reconstruction/mesh/scan/scan_mesh.h"
#include "reconstruction/pipeline/mesh_pipeline.h"

namespace groundray {

/// Output files.
struct MeshOutput {
  std::filesystem::path mesh;
  std::optional<std::filesystem::path> occlusion;  ///< mesh of the rejected links
  std::optional<std::filesystem::path> report;     ///< JSON
  ReportFacts facts;
};

/// Request for a mesh from scans, or from an existing mesh.
struct MeshRequest {
  std::optional<ScreeningLimits> screening;  ///< default: ground(), or object() for range grids
  std::optional<double> incidence_rad, longest_m, noise_sds;  ///< replace those of the screening
  std::optional<double> perimeter_m;  ///< unorganised points: largest perimeter of a triangle
  std::optional<double> sd_m;  ///< standard deviation of vertices; replaces an existing mesh's own
  MeshBuildOptions steps;
  MeshOutput output;
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();
};

/// Builds a mesh from scans, writes it and prints a report. Writes either all files or none.
/// @throws Error as the functions of the steps.
void rebuild_mesh(const ScanChoice& choice, const ScanTaking& taking, const MeshRequest& request);

/// Fills and simplifies an existing mesh in the same way.
void rework_mesh(const std::filesystem::path& mesh, const MeshRequest& request);

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

/// Mesh with the report on it.
struct RebuildReport {
  std::vector<ScanTally> scans;
  MeshResult result;
  OcclusionFaces occlusion;  ///< faces of all scans, if requested
  Georeference georeference;
  StageSeconds seconds;  ///< of linking, which comes before the stages of `result`
  std::vector<std::string> notes;
};

/// Checks, before long computations, that the results can be written, each to its own file.
/// @param inputs  input files, which must not be overwritten.
/// @throws Error naming the first fault.
void check_output(const MeshOutput& output, std::span<const std::filesystem::path> inputs);

/// Writes all requested results, with the report as JSON (docs/reference/formats.md), and prints
/// the report. No file appears before all are complete and the report is printed.
/// @throws Error as the writers of the formats.
void write_output(const MeshOutput& output, const RebuildReport& report);

}  // namespace groundray
