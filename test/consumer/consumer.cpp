// Uses a part of each library through the installed headers alone.
#include <groundray/apps/dataset/dataset_reader.h>
#include <groundray/apps/dataset/scan_input.h>
#include <groundray/apps/dataset/write/frame_maker.h>
#include <groundray/apps/dataset/write/merge.h>
#include <groundray/apps/dataset/write/verify.h>
#include <groundray/core/geometry/pose.h>
#include <groundray/core/tracing/ray_tracer.h>
#include <groundray/reconstruction/mesh/accuracy/accuracy.h>
#include <groundray/reconstruction/mesh/simplify/lindstrom_turk.h>
#include <groundray/sensors/lidar/pattern/scan_pattern.h>
#include <groundray/terrain/terrain_scene.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>

using namespace groundray;

namespace {

// Reads back the first scan of a dataset; returns true if it has `points` points, and no file of
// the dataset has changed.
bool reads(const char* dataset, std::size_t points) {
  const ScanFiles files = find_scans({.inputs = {dataset}});
  const std::size_t rows = read_points(files, files.scans.at(0), {}).rows;
  const auto report = [](const std::string& fault) { std::printf("%s\n", fault.c_str()); };
  return rows == points && read_dataset(dataset).lidars.at(0).pending == 0 &&
         verify(dataset, report).faults == 0;
}

}  // namespace

// Without arguments, tests the other libraries; with a dataset and the number of points of its
// first scan, groundray::dataset.
int main(int count, char** arguments) {
  if (count == 3) return reads(arguments[1], std::strtoull(arguments[2], nullptr, 10)) ? 0 : 1;
  const Pose X_AB{.translation_m = {0, 0, 2}};
  const bool halfway = std::abs(Screw(X_AB).at(0.5).translation_m.z - 1) < 1e-15;

  const HeightGrid slope({2, 2}, {0, 0}, {1, -1}, {0, 1, 0, 1});  // rises 1 m to the east
  const RayTracer tracer({full_resolution_level(slope)}, {0, 0, 0}, Tracing::Exact);
  const Ray down{.origin = {0.25, -0.5, 2.25}};
  Hit hit;
  tracer.trace(std::span(&down, 1), std::span(&hit, 1));
  const bool below = std::abs(hit.range_m - 2) < 1e-8;

  const ScanPattern scan(
      SpinningPattern{.rate_hz = 10, .firing_period_s = 1e-3, .beams = {Beam{}}});
  const bool turned = scan.pulses(0) == 100 && scan.stamp(3) == std::chrono::milliseconds(300);

  const TriangleMesh low{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  const TriangleMesh high{{{0, 0, 2}, {1, 0, 2}, {0, 1, 2}}, {{0, 1, 2}}};
  const bool apart = MeshDistance(high, low).largest(1e-9).at_most_m < 2 + 1e-9;

  const bool reduced = reduce(low, 1).mesh.triangles.size() == 1;

  std::printf("halfway %d, below %d, turned %d, apart %d, reduced %d\n", halfway, below, turned,
              apart, reduced);
  return halfway && below && turned && apart && reduced ? 0 : 1;
}
