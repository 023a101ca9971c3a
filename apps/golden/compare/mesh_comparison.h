#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/golden/report.h"
#include "core/mesh.h"

namespace groundray::golden {

/// How finely two meshes are compared. 0 stands for what suits the reference's size: 1e-6 of the
/// diagonal of its box, and about a million samples each way.
struct MeshFineness {
  double tolerance_m = 0;        ///< between the bounds of largest distances
  double step_m = 0;             ///< between samples of mean distances, and of areas
  std::vector<double> within_m;  ///< tolerances for precision and completeness
};

/// Holds a mesh against a reference, both ways: from the other to the reference tells how far it
/// strays, from the reference to the other what it lacks. Tells the Hausdorff distance between
/// bounds that are proved, means with bounds, precision and completeness at tolerances, angles
/// between normals, areas, how distances are spread, and where they are largest. Nothing is held
/// against limits. Files may be any that read_mesh reads; where both say where their origin lies,
/// that is heeded.
/// @throws Error as read_mesh; if both name a reference system and these differ; as MeshDistance.
Section compare_meshes(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const MeshFineness& fineness = {});

/// As above, of meshes in memory, in one frame. @param title  of the section.
/// @throws Error as MeshDistance.
Section compare_meshes(const TriangleMesh& reference, const TriangleMesh& other,
                       const std::string& title, const MeshFineness& fineness = {});

}  // namespace groundray::golden
