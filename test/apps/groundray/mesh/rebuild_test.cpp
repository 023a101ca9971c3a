#include "apps/groundray/mesh/rebuild.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <glm/vec3.hpp>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "core/io/ply_io.h"
#include "reconstruction/mesh/measured_mesh_io.h"
#include "test/support/scans/beam_fan.h"
#include "test/support/temporary_folder.h"

namespace groundray::rebuild_test {
namespace {

using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

// Scan of a slope with a step, from 2 m above its foot.
ScanReturns scan_of_slope() {
  const RangeOf slope = plane_at({0.1, 0.05, -1}, 2), step = plane_at({0.1, 0.05, -1}, 1.6);
  return seen({.rings = 12,
               .lowest_rad = -50 * degree,
               .highest_rad = -15 * degree,
               .columns = 90,
               .columns_per_turn = 90},
              [&](const glm::dvec3& towards) {
                return towards.x * slope(towards) > 3 ? step(towards) : slope(towards);
              });
}

void write_scan(const std::filesystem::path& path, const ScanReturns& returns) {
  PointCloud cloud(returns.p_S.size());
  for (int axis = 0; axis < 3; ++axis) {
    const auto values = cloud.add<double>(std::string(1, "xyz"[axis]));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = returns.p_S[i][axis];
  }
  const auto rings = cloud.add<std::uint16_t>("ring");
  const auto columns = cloud.add<std::int32_t>("column");
  for (std::size_t i = 0; i < rings.size(); ++i) {
    rings[i] = static_cast<std::uint16_t>(returns.rings[i]);
    columns[i] = returns.columns[i];
  }
  write_ply(path, cloud, {});
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// The program reads two scans and their poses from files; the library gets them in memory.
TEST(Rebuild, WritesTheMeshThatTheLibraryBuilds) {
  const TemporaryFolder folder;
  const ScanReturns returns = scan_of_slope();
  const std::vector<glm::dvec3> places_m{{0, 0, 2}, {1, -0.5, 1.975}};
  std::ofstream poses(folder / "poses.tum");
  std::vector<ScanMesh> scans;
  ScanChoice choice{.poses = folder / "poses.tum"};
  for (const glm::dvec3& place_m : places_m) {
    const auto number = std::to_string(scans.size());
    choice.inputs.push_back(folder / (number + ".ply"));
    write_scan(choice.inputs.back(), returns);
    poses << number << ' ' << place_m.x << ' ' << place_m.y << ' ' << place_m.z << " 0 0 0 1\n";
    scans.push_back(link(place(organise(returns).scan, Pose{.translation_m = place_m}),
                         ScreeningLimits::ground()));
  }
  poses.close();
  MeshRequest request{.perimeter_m = {}, .steps = {.fill_m = 2, .stop = FaceBudget{500}}};
  request.output.mesh = folder / "program.ply";
  rebuild_mesh(choice, {}, request);
  const MeshResult result = build_mesh(std::move(scans), request.steps);
  EXPECT_GT(result.full_triangles, 1000U);
  EXPECT_LE(result.mesh.shape.triangles.size(), 500U);
  write_measured_mesh(folder / "library.ply", result.mesh, {});
  EXPECT_EQ(text_of(folder / "program.ply"), text_of(folder / "library.ply"));
}

}  // namespace
}  // namespace groundray::rebuild_test
