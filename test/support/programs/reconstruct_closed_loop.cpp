// Scans a known scene, reconstructs it in two ways, and scores these meshes and those of other
// programs against the truth. For test/benchmark/reconstruction_peers.py and
// test/apps/reconstruct_test.py.
#include <fmt/format.h>

#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <glm/geometric.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/io/mesh_io.h"
#include "core/io/ply_io.h"
#include "core/model/mesh_reader.h"
#include "reconstruction/mesh/merge/mesh_merge.h"
#include "reconstruction/mesh/scan/advancing_front.h"
#include "reconstruction/mesh/scan/organised_scan.h"
#include "reconstruction/mesh/scan/scan_mesh.h"
#include "test/support/programs/closed_loop_scene.h"

namespace groundray::testing {
namespace {

namespace fs = std::filesystem;

constexpr double within_m = 25, tolerance_m = 0.1, longest_perimeter_m = 3;
constexpr std::size_t truth_samples = 1'000'000;

// CPU time of the process, all threads, s.
double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

ScanReturns returns_of(const PointCloud& scan) {
  ScanReturns returns;
  const auto x = scan.column<float>("x"), y = scan.column<float>("y"), z = scan.column<float>("z");
  for (std::size_t i = 0; i < scan.rows(); ++i) returns.p_S.emplace_back(x[i], y[i], z[i]);
  const auto rings = scan.column<std::uint16_t>("ring");
  returns.rings.assign(rings.begin(), rings.end());
  const auto times_s = scan.column<float>("time");
  returns.times_s.assign(times_s.begin(), times_s.end());
  returns.sd_m.assign(scan.rows(), static_cast<float>(ClosedLoopLidar::noise_m));
  return returns;
}

// Points of all scans, in D: positions, true normals, and origins of the beams.
struct Points {
  std::vector<glm::dvec3> p_D, origins_m;
  std::vector<glm::vec3> normals;
};

Points points_of(const ClosedLoopScene& scene, std::span<const PointCloud> scans) {
  Points points;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    for (const glm::dvec3& p_S : returns_of(scans[k]).p_S) {
      points.p_D.push_back(scene.X_DS[k] * p_S);
      points.origins_m.push_back(scene.X_DS[k].translation_m);
    }
    const auto x = scans[k].column<float>("nx"), y = scans[k].column<float>("ny"),
               z = scans[k].column<float>("nz");
    for (std::size_t i = 0; i < scans[k].rows(); ++i) points.normals.emplace_back(x[i], y[i], z[i]);
  }
  return points;
}

void write_points(const fs::path& path, std::span<const glm::dvec3> points,
                  std::span<const glm::vec3> normals) {
  PointCloud cloud(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    const auto values = cloud.add<double>(std::string(1, "xyz"[axis]));
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
  }
  for (int axis = 0; axis < 3 && !normals.empty(); ++axis) {
    const auto values = cloud.add<float>(fmt::format("n{}", "xyz"[axis]));
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = normals[i][axis];
  }
  write_ply(path, cloud, {});
}

std::vector<glm::dvec3> read_points(const fs::path& path) {
  const PointCloud cloud = read_ply(path).cloud;
  std::vector<glm::dvec3> points;
  const auto x = cloud.column<double>("x"), y = cloud.column<double>("y"),
             z = cloud.column<double>("z");
  for (std::size_t i = 0; i < cloud.rows(); ++i) points.emplace_back(x[i], y[i], z[i]);
  return points;
}

struct Rebuilt {
  TriangleMesh mesh;
  double cpu_s = 0;
};

Rebuilt rebuild(const ClosedLoopScene& scene, std::span<const PointCloud> scans) {
  std::vector<ScanReturns> returns;
  for (const PointCloud& scan : scans) returns.push_back(returns_of(scan));
  const double begin_s = cpu_s();
  std::vector<ScanMesh> meshes;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    meshes.push_back(
        link(place(organise(returns[k]).scan, scene.X_DS[k]), ScreeningLimits::ground()));
  }
  TriangleMesh mesh =
      meshes.size() == 1 ? meshes[0].mesh.shape : merge(meshes, MergeLimits{}).mesh.shape;
  return {std::move(mesh), cpu_s() - begin_s};
}

Rebuilt rebuild_by_advancing_front(const Points& points) {
  const double begin_s = cpu_s();
  TriangleMesh mesh = advance_front(points.p_D, longest_perimeter_m, points.origins_m).mesh;
  return {std::move(mesh), cpu_s() - begin_s};
}

std::string json(const TriangleMesh& mesh, const ClosedLoopScore& score) {
  return fmt::format(
      "\"triangles\": {}, \"precision\": {:.6f}, \"completeness\": {:.6f}, \"f1\": {:.6f}",
      mesh.triangles.size(), score.precision, score.completeness, score.f1);
}

void rebuild_all(const fs::path& folder, Seed seed, int poses, const ClosedLoopLidar& lidar) {
  const ClosedLoopScene scene = closed_loop_scene(seed, poses);
  const std::vector<PointCloud> scans = scans_of(scene, lidar, seed);
  const Points points = points_of(scene, scans);
  const std::vector<glm::dvec3> visible = visible_samples(scene, within_m, truth_samples, seed);
  write_points(folder / "points.ply", points.p_D, points.normals);
  write_points(folder / "visible.ply", visible, {});
  write_mesh(folder / "truth.ply", scene.truth, {});
  const Rebuilt ours = rebuild(scene, scans);
  const Rebuilt theirs = rebuild_by_advancing_front(points);
  write_mesh(folder / "groundray.ply", ours.mesh, {});
  write_mesh(folder / "advancing_front.ply", theirs.mesh, {});
  const ClosestPoint truth(scene.truth);
  fmt::print(
      "{{\"points\": {}, \"visible\": {}, \"groundray\": {{\"cpu_s\": {:.4f}, {}}}, "
      "\"advancing_front\": {{\"cpu_s\": {:.4f}, {}}}}}\n",
      points.p_D.size(), visible.size(), ours.cpu_s,
      json(ours.mesh, score(ours.mesh, truth, visible, tolerance_m)), theirs.cpu_s,
      json(theirs.mesh, score(theirs.mesh, truth, visible, tolerance_m)));
}

void evaluate(const fs::path& folder, const fs::path& path) {
  const ClosestPoint truth(read_mesh(folder / "truth.ply").mesh);
  const TriangleMesh mesh = read_mesh(path).mesh;
  const std::vector<glm::dvec3> visible = read_points(folder / "visible.ply");
  fmt::print("{{{}}}\n", json(mesh, score(mesh, truth, visible, tolerance_m)));
}

constexpr const char* usage =
    "usage: reconstruct_closed_loop rebuild FOLDER SEED POSES RINGS COLUMNS\n"
    "       reconstruct_closed_loop evaluate FOLDER MESH\n";

int run_command(std::span<char*> arguments) {
  const std::string command = arguments.size() > 1 ? arguments[1] : "";
  if (command == "rebuild" && arguments.size() == 7) {
    rebuild_all(arguments[2], Seed{std::stoull(arguments[3])}, std::stoi(arguments[4]),
                {.rings = std::stoi(arguments[5]), .columns = std::stoi(arguments[6])});
    return 0;
  }
  if (command == "evaluate" && arguments.size() == 4) {
    evaluate(arguments[2], arguments[3]);
    return 0;
  }
  fmt::print(stderr, "{}", usage);
  return 2;
}

}  // namespace
}  // namespace groundray::testing

int main(int argc, char** argv) {
  try {
    return groundray::testing::run_command({argv, static_cast<std::size_t>(argc)});
  } catch (const std::exception& error) {
    fmt::print(stderr, "reconstruct_closed_loop: {}\n", error.what());
    return 1;
  }
}
