#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/golden/compare/scope.h"
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

/// Positions in W of the origins of files that do not state them.
struct MeshOrigins {
  std::optional<glm::dvec3> reference_w_m, other_w_m;
};

/// Compares a mesh with a reference in both directions: distances from the other to the reference
/// show where it deviates, distances from the reference to the other what it lacks. Reports the
/// Hausdorff distance between proven bounds, mean and RMS distances with bounds, precision and
/// completeness at tolerances, angles between normals, areas, the distribution of distances, and
/// the positions of the largest ones; pictures show plan views of them. Nothing is checked against
/// limits. Accepts any file that read_mesh reads; if both origins are known, the other is shifted
/// to the reference's frame, otherwise the coordinates of both are taken as they are.
/// @param scope  its box is in W, or in the frame of both files if the reference's origin is not
///               known. Distances are from the part of a surface in the box to all of the other
///               surface. Its limit of distance leaves out parts of the sampling step's size.
/// @throws Error as check_scope; as read_mesh; if both name a CRS and these differ; if a file
/// states
///         an origin and one is given; if nothing is in the box or near enough; as MeshDistance.
Section compare_meshes(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const MeshFineness& fineness = {}, const Scope& scope = {},
                       const MeshOrigins& origins = {});

/// As above, for meshes in memory, in a common frame, which is also that of the scope's box.
/// @param title  title of the section.
Section compare_meshes(const TriangleMesh& reference, const TriangleMesh& other,
                       const std::string& title, const MeshFineness& fineness = {},
                       const Scope& scope = {});

}  // namespace groundray::golden
