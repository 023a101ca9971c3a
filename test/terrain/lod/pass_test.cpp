#include "terrain/lod/pass.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <functional>
#include <map>
#include <new>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/geometry/height_grid.h"
#include "terrain/lod/deviation.h"
#include "terrain/lod/passes/deviation.h"
#include "terrain/lod/passes/emission.h"
#include "terrain/lod/passes/leaf_list.h"
#include "terrain/lod/passes/prefix_sum.h"
#include "terrain/lod/passes/selection.h"
#include "terrain/lod/quadtree.h"
#include "terrain/terrain_mesh.h"
#include "test/support/terrain/pass_results.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::pass_test {
namespace {

using ::testing::IsEmpty;

// Device that knows a pass only by its name and bytes, of which it runs a copy, last index first.
class CopyingDevice final : public PassDevice {
 public:
  CopyingDevice() {
    know<passes::DeviationPass, passes::JoinPartsPass, passes::SaturatePass, passes::SplitPass,
         passes::LeafPass, passes::CountLeavesPass, passes::ListLeavesPass, passes::SumCountsPass,
         passes::ReplaceCountsPass, passes::SumSumsPass, passes::ReplaceSumsPass,
         passes::NumberLeavesPass, passes::CountMarkedPass, passes::ListMarkedPass,
         passes::MarkVerticesPass, passes::CountMeshPass, passes::EmitVerticesPass,
         passes::EmitTrianglesPass>();
  }

  void run(std::string_view name, std::span<const std::byte> bytes, std::size_t count) override {
    unused_.erase(std::string(name));
    const std::vector<std::byte> copy(bytes.begin(), bytes.end());
    passes_.at(std::string(name))(copy, count);
  }

  // Names of the passes that have not been run.
  const std::set<std::string>& unused() const { return unused_; }

 private:
  template <typename... Passes>
  void know() {
    (know_one<Passes>(), ...);
  }
  template <typename Pass>
  void know_one() {
    unused_.insert(Pass::name);
    passes_[Pass::name] = [](std::span<const std::byte> bytes, std::size_t count) {
      ASSERT_EQ(bytes.size(), sizeof(Pass));
      alignas(Pass) std::byte storage[sizeof(Pass)];
      std::memcpy(storage, bytes.data(), sizeof(Pass));
      const Pass& pass = *std::launder(reinterpret_cast<const Pass*>(storage));
      for (std::size_t left = count; left > 0; --left) pass(left - 1);
    };
  }

  std::map<std::string, std::function<void(std::span<const std::byte>, std::size_t)>> passes_;
  std::set<std::string> unused_;
};

HeightGrid holed_ground() {
  return testing::with_holes(testing::fractal(129, 2, 40, Seed{3}), 5, 4, Seed{8});
}

const std::vector<MeshBound> bounds{{.tolerance_m = 0.5, .cell_m = {2, 2}},
                                    {.tolerance_m = 0.1,
                                     .angle_rad = 0.01,
                                     .low_m = {60, 90, 3},
                                     .high_m = {62, 91, 4},
                                     .cell_m = {2, 2}}};

TEST(Pass, RunsOnADeviceByNameAndBytes) {
  CopyingDevice device;
  const HeightGrid grid = holed_ground();
  for (const int block_cells : {2, 8, 64}) {
    for (const MeshBound& bound : bounds) {
      EXPECT_EQ(
          testing::difference(testing::results_of(grid, bound, block_cells, PassRunner(device)),
                              testing::results_of(grid, bound, block_cells, {})),
          "");
    }
  }
  // Nodes are divided into parts only where they have more than 2^17 samples.
  const HeightGrid large = testing::fractal(513, 2, 40, Seed{3});
  EXPECT_EQ(testing::difference(testing::results_of(large, bounds.front(), 2, PassRunner(device)),
                                testing::results_of(large, bounds.front(), 2, {})),
            "");
  EXPECT_THAT(device.unused(), IsEmpty());
}

TEST(Pass, SelectsAndMeshesWindowsOnADevice) {
  CopyingDevice device;
  const HeightGrid grid = holed_ground();
  const auto places = testing::places_on(grid);
  for (const MeshBound& bound : bounds) {
    for (const int block_cells : {2, 4, 8}) {
      const auto results = [&](const PassRunner& runner) {
        return testing::window_results(grid, {50, 90}, 8, bound, block_cells, runner);
      };
      EXPECT_EQ(testing::difference(results(PassRunner(device)), results({})), "");
    }
    const auto results = [&](const PassRunner& runner) {
      return testing::clipmap_results(grid, bound.tolerance_m, bound.angle_rad, places, runner);
    };
    EXPECT_EQ(testing::difference(results(PassRunner(device)), results({})), "");
  }
}

TEST(Pass, ResultsDoNotDependOnTheLengthsOfRuns) {
  const HeightGrid grid = holed_ground();
  for (const int block_cells : {2, 8}) {
    for (const MeshBound& bound : bounds) {
      const testing::PassResults expected = testing::results_of(grid, bound, block_cells, {});
      for (const int length : {1, 7, 64}) {
        PassRunner runner;
        runner.run_nodes = length;
        runner.run_samples = 4 * length;
        EXPECT_EQ(
            testing::difference(testing::results_of(grid, bound, block_cells, runner), expected),
            "");
        EXPECT_EQ(testing::difference(
                      testing::window_results(grid, {50, 90}, 8, bound, block_cells, runner),
                      testing::window_results(grid, {50, 90}, 8, bound, block_cells, {})),
                  "");
        if (block_cells != Certificate::block_cells) continue;
        const auto places = testing::places_on(grid);
        EXPECT_EQ(
            testing::difference(
                testing::clipmap_results(grid, bound.tolerance_m, bound.angle_rad, places, runner),
                testing::clipmap_results(grid, bound.tolerance_m, bound.angle_rad, places, {})),
            "");
      }
    }
  }
}

}  // namespace
}  // namespace groundray::pass_test
