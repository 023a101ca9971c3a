#include <fmt/format.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

#include "core/geometry/height_grid.h"
#include "terrain/lod/quadtree.h"
#include "test/device/host_arrays.h"
#include "test/device/opencl_device.h"
#include "test/support/terrain/adversarial_terrain.h"
#include "test/support/terrain/pass_results.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::device_test {
namespace {

constexpr std::size_t passes = 18;
constexpr std::size_t most_bytes = std::size_t{64} << 20;  // of all arrays of a run

using testing::HostArrays;
using testing::NamedTerrain;
using testing::OpenClDevice;

std::filesystem::path kernels() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "kernels";
}

// Part of a grid, of any size.
HeightGrid part_of(const HeightGrid& grid, glm::ivec2 size) {
  std::vector<float> heights;
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column) heights.push_back(grid.height_m(column, row));
  }
  return {size, grid.origin_m(), grid.step_m(), heights};
}

HeightGrid rounded_to(const HeightGrid& grid, float step_m) {
  std::vector<float> heights;
  for (const float height_m : grid.heights_m())
    heights.push_back(step_m * std::round(height_m / step_m));
  return {{grid.columns(), grid.rows()}, grid.origin_m(), grid.step_m(), heights};
}

// DEMs of floats, integers, odd sizes and holes, and those that break meshers.
std::vector<NamedTerrain> terrains() {
  const HeightGrid ground = testing::fractal(129, 2, 40, Seed{3});
  std::vector<NamedTerrain> all = testing::adversarial_terrain();
  all.push_back({"floats", ground});
  all.push_back({"integers", rounded_to(ground, 1)});
  all.push_back({"odd size", part_of(ground, {101, 74})});
  all.push_back({"holes", testing::with_holes(ground, 6, 5, Seed{8})});
  all.push_back(
      {"holes, odd size", part_of(testing::with_holes(ground, 9, 4, Seed{9}), {118, 93})});
  return all;
}

std::vector<MeshBound> bounds_of(const HeightGrid& grid) {
  const glm::dvec2 cell_m = glm::abs(grid.step_m());
  const glm::dvec2 middle_m = 0.5 * cell_m * glm::dvec2(grid.columns(), grid.rows());
  return {{.tolerance_m = 0.5, .cell_m = cell_m},
          {.tolerance_m = 0.125,
           .angle_rad = 0.01,
           .low_m = {middle_m, 10},
           .high_m = {middle_m + 1.0, 11},
           .cell_m = cell_m}};
}

// Returns a copy of a grid and its samples.
HeightGrid copy_of(const HeightGrid& grid) { return part_of(grid, {grid.columns(), grid.rows()}); }

class OnDevice : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto name = OpenClDevice::name();
    if (!name) GTEST_SKIP() << "there is no OpenCL device with double precision";
    fmt::print("device: {}\n", *name);
    // Where PoCL keeps what it compiled.
    ::setenv("POCL_CACHE_DIR", (kernels() / "cache").c_str(), 0);
  }
};

// Returns where the device's results for a DEM differ from the CPU's; empty if nowhere.
// `results(grid, runner)` computes them.
std::string difference_on(OpenClDevice& device, HostArrays& arrays, const HeightGrid& dem,
                          const auto& results) {
  const auto expected = results(dem, PassRunner());
  std::string difference;
  {
    const HostArrays::Use use(&arrays);
    const auto found = results(copy_of(dem), PassRunner(device));
    const HostArrays::Use elsewhere(nullptr);
    difference = testing::difference(found, expected);
  }
  arrays.clear();
  return difference;
}

// Results for a whole DEM.
auto results_for(const MeshBound& bound, int block_cells) {
  return [=](const HeightGrid& grid, const PassRunner& runner) {
    return testing::results_of(grid, bound, block_cells, runner);
  };
}

// Results for windows of 8 x 8 nodes round a place.
auto results_for_windows(const MeshBound& bound, int block_cells) {
  return [=](const HeightGrid& grid, const PassRunner& runner) {
    const glm::dvec2 place = glm::dvec2(grid.columns(), grid.rows()) * glm::dvec2(0.4, 0.7);
    return testing::window_results(grid, place, 8, bound, block_cells, runner);
  };
}

// Results for a clipmap that is built, moved and moved far.
auto results_for_clipmap(const MeshBound& bound) {
  return [=](const HeightGrid& grid, const PassRunner& runner) {
    return testing::clipmap_results(grid, bound.tolerance_m, bound.angle_rad,
                                    testing::places_on(grid), runner);
  };
}

// A DEM of steps, and a bound for each of its levels that is exactly the key of a node, which tells
// > from >=.
struct Ties {
  HeightGrid grid = rounded_to(testing::fractal(129, 2, 40, Seed{3}), 0.25f);
  std::vector<MeshBound> bounds;

  Ties() {
    const MeshBound any = bounds_of(grid).front();
    const std::vector<NodeLevel> levels = testing::results_of(grid, any, 2, {}).levels;
    for (std::size_t level = 1; level < levels.size(); ++level) {
      bounds.push_back(any);
      bounds.back().tolerance_m = levels[level].key_m[levels[level].key_m.size() / 2];
    }
  }
};

TEST_F(OnDevice, PassesWriteTheSameBytesForTheWholeDem) {
  HostArrays arrays(most_bytes);
  OpenClDevice device(kernels() / "sound", arrays);
  for (const NamedTerrain& terrain : terrains()) {
    for (const int block_cells : {2, 4, 8, 64}) {
      for (const MeshBound& bound : bounds_of(terrain.grid)) {
        EXPECT_EQ(difference_on(device, arrays, terrain.grid, results_for(bound, block_cells)), "")
            << terrain.name << ", " << block_cells << " cells, angle " << bound.angle_rad;
      }
    }
  }
}

TEST_F(OnDevice, PassesWriteTheSameBytesForWindows) {
  HostArrays arrays(most_bytes);
  OpenClDevice device(kernels() / "sound", arrays);
  const auto expect_same = [&](const NamedTerrain& terrain, int block_cells) {
    for (const MeshBound& bound : bounds_of(terrain.grid)) {
      EXPECT_EQ(
          difference_on(device, arrays, terrain.grid, results_for_windows(bound, block_cells)), "")
          << terrain.name << ", " << block_cells << " cells, angle " << bound.angle_rad;
    }
  };
  for (const NamedTerrain& terrain : terrains()) {
    for (const int block_cells : {2, 4, 8, 64}) expect_same(terrain, block_cells);
  }
  // Smaller DEMs have no window of 8 such nodes.
  const HeightGrid large =
      testing::with_holes(testing::fractal(1025, 2, 40, Seed{3}), 9, 4, Seed{8});
  expect_same({"large", part_of(large, {641, 577})}, 64);
}

TEST_F(OnDevice, PassesWriteTheSameBytesForClipmaps) {
  HostArrays arrays(most_bytes);
  OpenClDevice device(kernels() / "sound", arrays);
  std::vector<NamedTerrain> all = terrains();
  all.push_back({"three levels", testing::fractal(257, 2, 40, Seed{4})});
  for (const NamedTerrain& terrain : all) {
    for (const MeshBound& bound : bounds_of(terrain.grid)) {
      EXPECT_EQ(difference_on(device, arrays, terrain.grid, results_for_clipmap(bound)), "")
          << terrain.name << ", angle " << bound.angle_rad;
    }
  }
}

TEST_F(OnDevice, PassesWriteTheSameBytesForTies) {
  HostArrays arrays(most_bytes);
  OpenClDevice device(kernels() / "sound", arrays);
  const Ties ties;
  for (const MeshBound& bound : ties.bounds) {
    EXPECT_EQ(difference_on(device, arrays, ties.grid, results_for(bound, 2)), "")
        << bound.tolerance_m;
    EXPECT_EQ(difference_on(device, arrays, ties.grid, results_for_windows(bound, 2)), "")
        << bound.tolerance_m;
    EXPECT_EQ(difference_on(device, arrays, ties.grid, results_for_clipmap(bound)), "")
        << bound.tolerance_m;
  }
}

// The faults are listed in CMakeLists.txt.
TEST_F(OnDevice, FindsFaultsOfKernels) {
  const Ties ties;
  const HeightGrid floats = testing::fractal(129, 2, 40, Seed{3});
  std::size_t faults = 0;
  for (const auto& folder : std::filesystem::directory_iterator(kernels() / "faults")) {
    HostArrays arrays(most_bytes);
    OpenClDevice device(folder.path(), arrays);
    std::string found =
        difference_on(device, arrays, floats, results_for(bounds_of(floats).back(), 2));
    for (std::size_t i = 0; i < ties.bounds.size() && found.empty(); ++i)
      found = difference_on(device, arrays, ties.grid, results_for(ties.bounds[i], 2));
    if (found.empty())
      found =
          difference_on(device, arrays, floats, results_for_windows(bounds_of(floats).back(), 2));
    EXPECT_NE(found, "") << folder.path().filename();
    fmt::print("{}: {}\n", folder.path().filename().string(), found);
    ++faults;
  }
  EXPECT_EQ(faults, 5u);
}

std::size_t count_in(const std::filesystem::path& file, const std::string& pattern) {
  std::ifstream in(file);
  EXPECT_TRUE(in) << file;
  const std::regex wanted(pattern);
  std::size_t count = 0;
  for (std::string line; std::getline(in, line);) count += std::regex_search(line, wanted);
  return count;
}

// Multiplication and addition are rounded separately, as on the CPU, and nothing is divided, which
// not all devices round correctly.
TEST(Kernels, FuseNoOperations) {
  EXPECT_EQ(count_in(kernels() / "passes.ptx", R"(^\s*(fma|div)\.[a-z]*\.f64)"), 0u);
  EXPECT_GT(count_in(kernels() / "passes.fused.ptx", R"(^\s*fma\.rn\.f64)"), 0u);
  EXPECT_EQ(count_in(kernels() / "passes.ptx", R"(\.entry )"), passes);
  EXPECT_EQ(count_in(kernels() / "passes.gcn", R"(^\s*v_(fma|fmac|mad|mac|div\w*)_f64)"), 0u);
  constexpr const char* contraction_off = R"(ExecutionMode \d+ 31 *$)";
  EXPECT_EQ(count_in(kernels() / "sound/passes.spt", contraction_off), passes);
}

TEST(Kernels, NeedLittlePrivateMemory) {
  std::ifstream in(kernels() / "passes.gcn");
  const std::regex size(R"(\.private_segment_fixed_size: *(\d+))");
  std::size_t kernels_found = 0;
  for (std::string line; std::getline(in, line);) {
    std::smatch match;
    if (!std::regex_search(line, match, size)) continue;
    EXPECT_LE(std::stoul(match[1]), 2048u) << line;
    ++kernels_found;
  }
  EXPECT_EQ(kernels_found, passes);
}

}  // namespace
}  // namespace groundray::device_test
