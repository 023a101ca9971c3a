#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <ostream>
#include <regex>
#include <string>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/tracing/ray_tracer.h"
#include "terrain/lod/clipmap.h"
#include "terrain/lod/quadtree.h"
#include "terrain/terrain_scene.h"
#include "test/device/host_arrays.h"
#include "test/device/kernel_device.h"
#include "test/support/terrain/adversarial_terrain.h"
#include "test/support/terrain/hard_rays.h"
#include "test/support/terrain/pass_rays.h"
#include "test/support/terrain/pass_results.h"
#include "test/support/terrain/sample_clipmap.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::device_test {
namespace {

constexpr std::size_t passes = 20;
constexpr std::size_t most_bytes = std::size_t{512} << 20;  // of all arrays of a run

using ::testing::ElementsAre;
using testing::Gpu;
using ::testing::Gt;
using testing::HostArrays;
using ::testing::IsEmpty;
using testing::KernelCode;
using testing::KernelDevice;
using testing::NamedTerrain;
using ::testing::Not;
using testing::open_gpu;
using ::testing::Pair;

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

// The fakes are fake_driver.cpp: they show that the runners give a driver what it expects, no more.
enum class Backend { OpenCl, Cuda, Hip, FakeCuda, FakeHip };

std::unique_ptr<KernelDevice> open_device(Backend backend, const KernelCode& code,
                                          HostArrays& arrays) {
  const std::string fake = (kernels() / "libfake_driver.so").string();
  switch (backend) {
    case Backend::OpenCl:
      break;
    case Backend::Cuda:
      return open_gpu(Gpu::Cuda, code, arrays);
    case Backend::Hip:
      return open_gpu(Gpu::Hip, code, arrays);
    case Backend::FakeCuda:
      return open_gpu(Gpu::Cuda, code, arrays, fake);
    case Backend::FakeHip:
      return open_gpu(Gpu::Hip, code, arrays, fake);
  }
  // Where PoCL keeps what it compiled.
  ::setenv("POCL_CACHE_DIR", (kernels() / "cache").c_str(), 0);
  return testing::open_opencl(code, arrays);
}

std::ostream& operator<<(std::ostream& out, Backend backend) {
  return out << static_cast<int>(backend);
}

class OnDevice : public ::testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    try {
      device_ = open_device(GetParam(), testing::read_kernels(kernels() / "sound"), arrays_);
    } catch (const testing::NoDevice& reason) {
      GTEST_SKIP() << reason.what();
    }
    fmt::print("device: {}\n", device_->name());
  }

  HostArrays arrays_{most_bytes};
  std::unique_ptr<KernelDevice> device_;
};

using OnDeviceProof = OnDevice;

INSTANTIATE_TEST_SUITE_P(OpenCl, OnDevice, ::testing::Values(Backend::OpenCl));
INSTANTIATE_TEST_SUITE_P(Cuda, OnDevice, ::testing::Values(Backend::Cuda));
INSTANTIATE_TEST_SUITE_P(Hip, OnDevice, ::testing::Values(Backend::Hip));
INSTANTIATE_TEST_SUITE_P(Fake, OnDevice, ::testing::Values(Backend::FakeCuda, Backend::FakeHip));
INSTANTIATE_TEST_SUITE_P(OpenCl, OnDeviceProof, ::testing::Values(Backend::OpenCl));
INSTANTIATE_TEST_SUITE_P(Cuda, OnDeviceProof, ::testing::Values(Backend::Cuda));
INSTANTIATE_TEST_SUITE_P(Hip, OnDeviceProof, ::testing::Values(Backend::Hip));

// Returns where the device's results for a DEM differ from the CPU's; empty if nowhere.
// `results(grid, runner)` computes them.
std::string difference_on(KernelDevice& device, HostArrays& arrays, const HeightGrid& dem,
                          const auto& results) {
  const auto expected = results(dem, PassRunner());
  std::string difference;
  {
    const HostArrays::Use use(&arrays);
    const HeightGrid grid = testing::deep_copy(dem);
    // A device of the CPU's would read others too.
    EXPECT_TRUE(arrays.holds(grid.heights_m().data()));
    const auto found = results(grid, PassRunner(device));
    const HostArrays::Use elsewhere(nullptr);
    difference = testing::difference(found, expected);
  }
  arrays.clear();
  return difference;
}

// Rays, and levels that they are traced through.
struct Shots {
  RayTracer tracer;
  std::vector<Ray> rays;
};

std::vector<Shots> all_shots(std::size_t rays) {
  const HeightGrid dem =
      testing::with_holes(testing::fractal(513, 5, 300, Seed{11}), 60, 5, Seed{12});
  const glm::dvec3 p_DL = float_frame_origin({0, 0, dem.max_height_m()});
  // The memory limit makes the windows small.
  const Clipmap clipmap(testing::certified_tiles(dem), dem.frame(),
                        {.tolerance_m = 0.01, .angle_rad = 0.002, .memory_bytes = 5'000'000},
                        testing::sensor_at({100, 50, 200}));
  std::vector<Shots> all;
  all.push_back({RayTracer({full_resolution_level(dem)}, p_DL, Tracing::Exact),
                 testing::hard_rays(dem, rays, Seed{13})});
  all.push_back(
      {RayTracer(clipmap.levels(), p_DL, Tracing::Exact), testing::hard_rays(dem, rays, Seed{14})});
  return all;
}

// Returns where hits differ from those of exact tracing; empty if nowhere.
std::string difference_on(KernelDevice& device, HostArrays& arrays, const Shots& shots) {
  std::string difference;
  {
    const HostArrays::Use use(&arrays);
    const auto found = testing::trace_by_passes(shots.tracer, shots.rays, PassRunner(device));
    const HostArrays::Use elsewhere(nullptr);
    std::size_t met = 0;
    difference = testing::difference_from_exact(found, shots.tracer, shots.rays, met);
    EXPECT_GT(met, shots.rays.size() / 4);
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

// A DEM of steps, and bounds that are exactly the key of a node of each level, which tells > from
// >=: as a tolerance, and as an angle seen from above the node.
struct Ties {
  HeightGrid grid = rounded_to(testing::fractal(129, 2, 40, Seed{3}), 0.25f);
  std::vector<MeshBound> tolerances, angles;

  explicit Ties(int block_cells) {
    const MeshBound any = bounds_of(grid).front();
    const std::vector<NodeLevel> levels = testing::results_of(grid, any, block_cells, {}).levels;
    for (std::size_t level = 0; level < levels.size(); ++level) {
      const NodeLevel& nodes = levels[level];
      const glm::ivec2 node = nodes.size / 2;
      const auto row = static_cast<std::size_t>(node.y), column = static_cast<std::size_t>(node.x);
      const std::size_t at = row * static_cast<std::size_t>(nodes.size.x) + column;
      const double key_m = nodes.key_m[at];
      if (!(key_m > 0)) continue;
      tolerances.push_back(any);
      tolerances.back().tolerance_m = key_m;
      // A power of two, so that the square of the angle times that of the distance is the key's.
      constexpr double angle_rad = 1.0 / 16;
      const double cells = std::ldexp(block_cells, static_cast<int>(level));
      const glm::dvec3 above_m(glm::dvec2(node) * cells * any.cell_m,
                               nodes.high_m[at] + key_m / angle_rad);
      angles.push_back(any);
      angles.back().tolerance_m = 0;
      angles.back().angle_rad = angle_rad;
      angles.back().low_m = angles.back().high_m = above_m;
    }
  }
};

TEST_P(OnDevice, PassesWriteTheSameBytesForTheWholeDem) {
  for (const NamedTerrain& terrain : terrains()) {
    for (const int block_cells : {2, 4, 8, 64}) {
      for (const MeshBound& bound : bounds_of(terrain.grid)) {
        EXPECT_EQ(difference_on(*device_, arrays_, terrain.grid, results_for(bound, block_cells)),
                  "")
            << terrain.name << ", " << block_cells << " cells, angle " << bound.angle_rad;
      }
    }
  }
}

TEST_P(OnDevice, PassesWriteTheSameBytesForWindows) {
  const auto expect_same = [&](const NamedTerrain& terrain, int block_cells) {
    for (const MeshBound& bound : bounds_of(terrain.grid)) {
      EXPECT_EQ(
          difference_on(*device_, arrays_, terrain.grid, results_for_windows(bound, block_cells)),
          "")
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

TEST_P(OnDevice, PassesWriteTheSameBytesForClipmaps) {
  std::vector<NamedTerrain> all = terrains();
  all.push_back({"three levels", testing::fractal(257, 2, 40, Seed{4})});
  for (const NamedTerrain& terrain : all) {
    for (const MeshBound& bound : bounds_of(terrain.grid)) {
      EXPECT_EQ(difference_on(*device_, arrays_, terrain.grid, results_for_clipmap(bound)), "")
          << terrain.name << ", angle " << bound.angle_rad;
    }
  }
}

TEST_P(OnDevice, PassesWriteTheSameBytesForTies) {
  for (const int block_cells : {2, 4, 8, 64}) {
    const Ties ties(block_cells);
    for (const std::vector<MeshBound>& bounds : {ties.tolerances, ties.angles}) {
      ASSERT_THAT(bounds, Not(IsEmpty()));
      for (const MeshBound& bound : bounds) {
        const auto expect_same = [&](const auto& results) {
          EXPECT_EQ(difference_on(*device_, arrays_, ties.grid, results), "")
              << block_cells << " cells, " << bound.tolerance_m << " m, " << bound.angle_rad;
        };
        expect_same(results_for(bound, block_cells));
        expect_same(results_for_windows(bound, block_cells));
      }
    }
  }
  const Ties ties(testing::certified_tiles(Ties(2).grid)->lattice().block_cells);
  for (const MeshBound& bound : ties.tolerances)
    EXPECT_EQ(difference_on(*device_, arrays_, ties.grid, results_for_clipmap(bound)), "")
        << bound.tolerance_m;
}

TEST_P(OnDeviceProof, RaysHitWhatExactTracingHits) {
  for (const Shots& shots : all_shots(testing::proof_size(100'000, 1'000'000)))
    EXPECT_EQ(difference_on(*device_, arrays_, shots), "") << shots.tracer.levels().size();
}

// The faults are listed in CMakeLists.txt. They show that the comparison finds them, so one device
// is enough.
TEST(OpenCl, FindsFaultsOfKernels) {
  const Ties ties(2);
  const HeightGrid floats = testing::fractal(129, 2, 40, Seed{3});
  const std::vector<Shots> shots = all_shots(20'000);
  std::size_t faults = 0;
  for (const auto& folder : std::filesystem::directory_iterator(kernels() / "faults")) {
    HostArrays arrays(most_bytes);
    std::unique_ptr<KernelDevice> device;
    try {
      device = open_device(Backend::OpenCl, testing::read_kernels(folder.path()), arrays);
    } catch (const testing::NoDevice& reason) {
      GTEST_SKIP() << reason.what();
    }
    const std::string name = folder.path().filename();
    ++faults;
    // Only what a fault can change: compiling the other kernels takes seconds.
    if (name == "contraction" || name == "hits_from_below" || name == "single_precision_of_rays") {
      EXPECT_NE(difference_on(*device, arrays, shots.back()), "") << name;
      continue;
    }
    const MeshBound bound = bounds_of(floats).back();
    std::string found = difference_on(*device, arrays, floats, results_for(bound, 2));
    for (const std::vector<MeshBound>& bounds : {ties.tolerances, ties.angles}) {
      for (std::size_t i = 0; i < bounds.size() && found.empty(); ++i)
        found = difference_on(*device, arrays, ties.grid, results_for(bounds[i], 2));
    }
    if (found.empty())
      found = difference_on(*device, arrays, floats, results_for_windows(bound, 2));
    EXPECT_NE(found, "") << name;
    fmt::print("{}: {}\n", name, found);
  }
  EXPECT_EQ(faults, 9u);
}

// Returns the message of opening CUDA's driver with a module.
std::string fault_of_cuda(const std::string& ptx, const std::string& library) {
  HostArrays arrays(most_bytes);
  try {
    open_gpu(Gpu::Cuda, {.ptx = ptx}, arrays, library);
  } catch (const std::runtime_error& fault) {
    return fault.what();
  }
  return "";
}

TEST(Driver, FaultsHaveItsLogAndFile) {
  EXPECT_EQ(fault_of_cuda("no PTX", (kernels() / "libfake_driver.so").string()),
            "CUDA rejects the kernels: error 200 no entry of a kernel");
  EXPECT_EQ(fault_of_cuda("", "/no/driver.so"),
            "there is no driver: /no/driver.so cannot be opened");
}

// Number of lines of each kernel that match a pattern; kernels without any are left out.
using Counts = std::map<std::string, std::size_t>;

// @param begins  matches the line at which a kernel begins, with its name.
Counts count_in(const std::filesystem::path& file, const std::string& begins,
                const std::string& pattern) {
  std::ifstream in(file);
  EXPECT_TRUE(in) << file;
  const std::regex kernel(begins), wanted(pattern);
  Counts counts;
  std::string name;
  std::smatch match;
  for (std::string line; std::getline(in, line);) {
    if (std::regex_search(line, match, kernel)) name = match[1];
    if (std::regex_search(line, wanted)) ++counts[name];
  }
  return counts;
}

// Code for each of AMD's architectures.
std::vector<std::filesystem::path> gcn_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& file : std::filesystem::directory_iterator(kernels())) {
    if (file.path().extension() == ".gcn") files.push_back(file.path());
  }
  EXPECT_THAT(files, Not(IsEmpty()));
  return files;
}

constexpr const char* in_ptx = R"(\.entry (\w+))";
constexpr const char* in_gcn = R"(^(\w+Pass):)";

// Multiplication and addition are rounded separately, as on the CPU. Meshing divides nothing, which
// not all devices round correctly; tracing does.
TEST(Kernels, FuseNoOperations) {
  EXPECT_EQ(count_in(kernels() / "sound/passes.ptx", in_ptx, in_ptx).size(), passes);
  EXPECT_THAT(count_in(kernels() / "sound/passes.ptx", in_ptx, R"(^\s*fma\.[a-z]*\.f64)"),
              IsEmpty());
  // Without a rounding, ptxas may fuse them.
  EXPECT_THAT(count_in(kernels() / "sound/passes.ptx", in_ptx, R"(^\s*(mul|add|sub)\.f64)"),
              IsEmpty());
  EXPECT_THAT(count_in(kernels() / "sound/passes.ptx", in_ptx, R"(^\s*div\.[a-z]*\.f64)"),
              ElementsAre(Pair("TraceLevelPass", Gt(0u))));
  EXPECT_THAT(count_in(kernels() / "passes.fused.ptx", in_ptx, R"(^\s*fma\.rn\.f64)"),
              Not(IsEmpty()));
  for (const std::filesystem::path& file : gcn_files()) {
    SCOPED_TRACE(file);
    const Counts divisions = count_in(file, in_gcn, R"(^\s*v_div_fixup_f64)");
    ASSERT_THAT(divisions, ElementsAre(Pair("TraceLevelPass", Gt(0u))));
    // A division is five fused operations, of which the last is v_div_fmas.
    EXPECT_EQ(count_in(file, in_gcn, R"(^\s*v_div_fmas_f64)"), divisions);
    EXPECT_THAT(count_in(file, in_gcn, R"(^\s*v_(fma|fmac|mad|mac)_f64)"),
                ElementsAre(Pair("TraceLevelPass", 5 * divisions.at("TraceLevelPass"))));
  }
  const Counts contraction_off =
      count_in(kernels() / "sound/passes.spt", "()^", R"(ExecutionMode \d+ 31 *$)");
  EXPECT_THAT(contraction_off, ElementsAre(Pair("", passes)));
}

// All kernels on gfx1030, and on every architecture the one that keeps rows of vertex numbers. With
// Clang 18, DeviationPass takes 2680 bytes on gfx90a.
TEST(Kernels, NeedLittlePrivateMemory) {
  const std::regex size(R"(\.private_segment_fixed_size: *(\d+))"),
      symbol(R"(\.symbol: *(\w+)\.kd)");
  for (const std::filesystem::path& file : gcn_files()) {
    std::ifstream in(file);
    std::map<std::string, unsigned long> bytes;
    unsigned long last = 0;
    std::smatch match;
    for (std::string line; std::getline(in, line);) {
      if (std::regex_search(line, match, size)) last = std::stoul(match[1]);
      if (std::regex_search(line, match, symbol)) bytes[match[1]] = last;
    }
    ASSERT_EQ(bytes.size(), passes) << file;
    for (const auto& [kernel, private_bytes] : bytes) {
      if (file.stem() != "gfx1030" && kernel != "EmitTrianglesPass") continue;
      EXPECT_LE(private_bytes, 2048u) << file << ": " << kernel;
    }
  }
}

}  // namespace
}  // namespace groundray::device_test
