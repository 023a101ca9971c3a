#include "core/geometry/mesh.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace groundray {

void check_mesh(const TriangleMesh& mesh, const std::string& name, EmptyMesh empty) {
  constexpr double most_m = 1e15;  // squares remain far below the largest float
  const std::size_t vertices = mesh.vertices_m.size();
  const auto bad_vertex = std::ranges::find_if_not(mesh.vertices_m, [](const glm::dvec3& p) {
    return std::abs(p.x) <= most_m && std::abs(p.y) <= most_m && std::abs(p.z) <= most_m;
  });
  const auto bad_triangle = std::ranges::find_if(mesh.triangles, [&](const glm::uvec3& t) {
    return std::max({t.x, t.y, t.z}) >= vertices;
  });
  Violations broken(name);
  broken.unless(!mesh.triangles.empty() || empty == EmptyMesh::Allow,
                "there is no triangle: is it a point cloud?");
  broken.unless(
      bad_vertex == mesh.vertices_m.end(),
      "vertex {} must have a finite position within {:.0e} m of the origin: is it in metres?",
      bad_vertex - mesh.vertices_m.begin(), most_m);
  broken.unless(bad_triangle == mesh.triangles.end(),
                "triangle {} refers to a vertex beyond the last of {}; indices begin at 0",
                bad_triangle - mesh.triangles.begin(), vertices);
  broken.unless(mesh.levels.empty() || mesh.levels.size() == mesh.triangles.size(),
                "there are {} levels for {} triangles; give one per triangle, or none",
                mesh.levels.size(), mesh.triangles.size());
  broken.throw_if_any();
}

}  // namespace groundray
