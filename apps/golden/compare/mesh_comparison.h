#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/golden/report.h"
#include "core/geometry/mesh.h"
#include "core/model/mesh_reader.h"

namespace groundray::golden {

/// Resolution of a mesh comparison. 0 selects a value that suits the reference's size: 1e-6 of the
/// diagonal of its bounding box (at least 8 rounding errors), and about a million samples in each
/// direction.
struct MeshFineness {
  double tolerance_m = 0;        ///< permitted gap between the bounds of a largest distance
  double step_m = 0;             ///< spacing of samples for mean distances and areas
  std::vector<double> within_m;  ///< tolerances for precision and completeness
};

/// Compares a mesh with a reference in both directions: distances from the other to the reference
/// show where it deviates, distances from the reference to the other what it lacks. Reports the
/// Hausdorff distance between proven bounds, mean and RMS distances with bounds, precision and
/// completeness at tolerances, angles between normals, areas, the distribution of distances, and
/// the positions of the largest ones. Nothing is checked against limits. Accepts any file that
/// read_mesh reads; if both files state their origins, the other is shifted to the reference's
/// frame.
/// @throws Error as read_mesh; if both name a CRS and these differ; as MeshDistance.
Section compare_meshes(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const MeshFineness& fineness = {});

/// As above, for meshes in memory, in a common frame.
/// @param title  title of the section.
/// @throws Error as MeshDistance.
Section compare_meshes(const TriangleMesh& reference, const TriangleMesh& other,
                       const std::string& title, const MeshFineness& fineness = {});

}  // namespace groundray::golden
