#include "test/support/scans/mesh_neighbours.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

namespace groundray::testing {

std::vector<glm::uvec3> neighbours_of(const TriangleMesh& mesh) {
  using Place = std::tuple<double, double, double>;
  std::map<std::pair<Place, Place>, std::vector<std::pair<std::uint32_t, int>>> sides;
  const auto place_of = [&](std::uint32_t vertex) {
    const glm::dvec3& p = mesh.vertices_m[vertex];
    return Place(p.x + 0.0, p.y + 0.0, p.z + 0.0);  // turns -0 into 0
  };
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Place a = place_of(mesh.triangles[i][k]), b = place_of(mesh.triangles[i][(k + 1) % 3]);
      if (a != b) sides[{std::min(a, b), std::max(a, b)}].emplace_back(i, k);
    }
  }
  std::vector<glm::uvec3> neighbours(mesh.triangles.size(), glm::uvec3(no_neighbour));
  for (const auto& [ends, of] : sides) {
    if (of.size() != 2 || of[0].first == of[1].first) continue;
    neighbours[of[0].first][of[0].second] = of[1].first;
    neighbours[of[1].first][of[1].second] = of[0].first;
  }
  return neighbours;
}

}  // namespace groundray::testing
