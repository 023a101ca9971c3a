#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <set>
#include <utility>

#include "reconstruction/mesh/scan/organised_scan.h"
#include "reconstruction/mesh/scan/scan_mesh.h"
#include "test/support/scans/beam_fan.h"

namespace groundray::testing {

inline ScreeningLimits limits(double incidence_deg,
                              double longest_m = std::numeric_limits<double>::infinity(),
                              double noise_sds = 0) {
  return {.incidence_rad = incidence_deg * degree, .longest_m = longest_m, .noise_sds = noise_sds};
}

inline OrganisedScan scan_of(const BeamFan& fan, const RangeOf& range_m) {
  return organise(seen(fan, range_m), ReturnChoice::Last, RowOrder::Number).scan;
}

/// Triangles as triples of scan cells, each starting with the least.
inline std::set<std::array<std::uint32_t, 3>> faces_of(const ScanMesh& made) {
  std::set<std::array<std::uint32_t, 3>> faces;
  for (const glm::uvec3& t : made.mesh.shape.triangles) {
    std::array<std::uint32_t, 3> face{made.cells[t.x], made.cells[t.y], made.cells[t.z]};
    std::ranges::rotate(face, std::ranges::min_element(face));
    faces.insert(face);
  }
  return faces;
}

inline std::size_t all_faces(const ScanMesh& made) {
  return made.mesh.shape.triangles.size() + made.occlusion.shape.triangles.size();
}

/// Checks the invariants of every mesh that link makes, for any input.
inline void expect_sound(const ScanMesh& made, const OrganisedScan& scan) {
  const TriangleMesh& mesh = made.mesh.shape;
  ASSERT_EQ(made.cells.size(), mesh.vertices_m.size());
  ASSERT_EQ(made.origins_m.size(), mesh.vertices_m.size());
  ASSERT_EQ(made.mesh.confidence.size(), mesh.vertices_m.size());
  ASSERT_EQ(made.face_confidence.size(), mesh.triangles.size());
  ASSERT_TRUE(std::ranges::is_sorted(made.cells));
  for (std::size_t i = 0; i < made.cells.size(); ++i) {
    ASSERT_EQ(mesh.vertices_m[i], scan.points_m[made.cells[i]]);
    ASSERT_EQ(made.origins_m[i], scan.origins_m[made.cells[i]]);
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const glm::uvec3& t : mesh.triangles) {
    const auto &a = mesh.vertices_m[t.x], &b = mesh.vertices_m[t.y], &c = mesh.vertices_m[t.z];
    ASSERT_GT(glm::dot(glm::cross(b - a, c - a), made.origins_m[t.x] - a), 0) << "turned away";
    ASSERT_TRUE(edges.emplace(t.x, t.y).second) << "an edge twice in one direction";
    ASSERT_TRUE(edges.emplace(t.y, t.z).second);
    ASSERT_TRUE(edges.emplace(t.z, t.x).second);
  }
  for (const float c : made.face_confidence) ASSERT_TRUE(0 <= c && c <= 1) << c;
  for (const float c : made.mesh.confidence) ASSERT_TRUE(0 <= c && c <= 1) << c;
  ASSERT_EQ(made.occlusion.origins_m.size(), made.occlusion.shape.vertices_m.size());
}

}  // namespace groundray::testing
