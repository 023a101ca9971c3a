#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "reconstruction/mesh/holes/hole_fill.h"
#include "reconstruction/mesh/measured_mesh.h"
#include "reconstruction/mesh/merge/mesh_merge.h"
#include "reconstruction/mesh/scan/scan_mesh.h"
#include "reconstruction/mesh/simplify/simplify.h"
#include "reconstruction/pipeline/stages.h"

namespace groundray {

/// Options of the steps from scans to a mesh.
struct MeshBuildOptions {
  MergeLimits merging;
  /// Replaces merging.apart_m. If it is empty and no scan has standard deviations, the distance is
  /// `spacing_share` of the median edge: surfaces between points are estimated.
  std::optional<double> apart_m;
  double spacing_share = 0.1;
  std::optional<double> fill_m;       ///< fill holes with a boundary up to this length
  std::optional<StopCriterion> stop;  ///< stop criterion of simplification; none: not simplified
  SimplifyOptions simplify;
};

/// Mesh with the results of each step.
struct MeshResult {
  MeasuredMesh mesh;
  std::size_t merged_scans = 0;  ///< number of scans with triangles
  MergeCounts merged;
  std::optional<double> spacing_m;       ///< MergeLimits::apart_m, if derived from the median edge
  std::optional<FilledMesh> holes;       ///< result of filling; its mesh has been moved out
  std::size_t full_triangles = 0;        ///< number of triangles before simplification
  std::optional<Simplified> simplified;  ///< result of simplification; its mesh has been moved out
  double area_m2 = 0;
  StageSeconds seconds;
};

/// Points without order, and properties of each.
struct UnorderedPoints {
  std::vector<glm::dvec3> points_m;
  std::vector<glm::dvec3> origins_m;  ///< origin of each beam
  std::vector<float> sd_m;            ///< standard deviation of each range
  std::vector<std::uint16_t> labels;  ///< semantic class of each point, or empty
};

/// Returns true if the standard deviation of any vertex is known, i.e. above 0.
bool knows_noise(const MeasuredMesh& mesh);

/// Merges scans that were meshed by link(), fills holes and simplifies. Without triangles the mesh
/// is empty, and the later steps are omitted. The result does not depend on the number of threads.
/// @throws Error as merge, fill_holes and simplify.
MeshResult build_mesh(std::vector<ScanMesh> scans, const MeshBuildOptions& options,
                      const PipelineControl& control = {});

/// Meshes points by advance_front(), with triangles of perimeters up to `perimeter_m`, fills holes
/// and simplifies. Without triangles the mesh is empty, and the later steps are omitted.
/// @throws Error as advance_front, fill_holes and simplify, or if properties are not one for each
/// point.
MeshResult build_mesh(const UnorderedPoints& points, double perimeter_m,
                      const MeshBuildOptions& options, const PipelineControl& control = {});

/// Fills holes of an existing mesh and simplifies it.
/// @throws Error as fill_holes and simplify.
MeshResult finish_mesh(MeasuredMesh mesh, const MeshBuildOptions& options,
                       const PipelineControl& control = {});

}  // namespace groundray
