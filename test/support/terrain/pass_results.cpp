#include "test/support/terrain/pass_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <glm/common.hpp>
#include <string_view>
#include <utility>

#include "terrain/lod/clipmap.h"
#include "terrain/lod/deviation.h"
#include "test/support/terrain/sample_clipmap.h"

namespace groundray::testing {
namespace {

template <typename T>
std::string difference(const std::vector<T>& found, const std::vector<T>& expected,
                       std::string_view what) {
  if (found.size() != expected.size())
    return fmt::format("{}: {} elements, not {}", what, found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): tells 0 from -0, and NaNs apart
    if (std::memcmp(&found[i], &expected[i], sizeof(T)) != 0)
      return fmt::format("{}: element {}", what, i);
  }
  return "";
}

std::string difference(const TerrainMesh& found, const TerrainMesh& expected) {
  std::string all = difference(found.vertices, expected.vertices, "vertices");
  if (all.empty()) all = difference(found.triangles, expected.triangles, "triangles");
  if (all.empty()) all = difference(found.levels, expected.levels, "levels of triangles");
  return all;
}

// Few enough that a DEM wider than 128 cells has several levels.
std::size_t memory_of_small_windows(const Lattice& lattice) {
  std::size_t levels = 1;
  for (int level = 0; std::max(lattice.cells(level).x, lattice.cells(level).y) > 64; ++level)
    ++levels;
  return std::size_t{40} * 96 * 96 * levels;
}

}  // namespace

HeightGrid deep_copy(const HeightGrid& grid) {
  const auto heights_m = grid.heights_m();
  return {{grid.columns(), grid.rows()},
          grid.origin_m(),
          grid.step_m(),
          {heights_m.begin(), heights_m.end()}};
}

PassResults results_of(const HeightGrid& grid, const MeshBound& bound, int block_cells,
                       const PassRunner& runner) {
  PassResults out;
  out.levels = certify(grid, block_cells, NodeDetail::Full, runner);
  std::vector<NodeWindow> windows;
  for (const NodeLevel& level : out.levels) windows.push_back(whole_window(level));
  const Lattice lattice{{grid.columns(), grid.rows()}, block_cells};
  const Selection selection = select_nodes(lattice, windows, bound, runner);
  for (const Selection::Level& level : selection.levels) out.states.push_back(level.state);
  out.leaves = list_leaves(selection, windows, 0, runner);
  out.mesh = build_terrain_mesh(grid, bound, block_cells, runner);
  return out;
}

std::vector<Level> levels_of(const HeightGrid& grid, const Known& known, const Selection& selection,
                             const PassRunner& runner) {
  const Lattice& lattice = known.lattice;
  std::vector<Level> levels;
  for (int level = 0; level <= lattice.top_level(); ++level) {
    const NodeWindow& window = known.windows[static_cast<std::size_t>(level)];
    if (window.size.x <= 0) continue;
    const glm::ivec2 first = window.first * lattice.block_cells;
    const glm::ivec2 end =
        glm::min((window.first + window.size) * lattice.block_cells, lattice.cells(level));
    std::vector<float> heights;
    for (int row = first.y; row <= end.y; ++row) {
      for (int column = first.x; column <= end.x; ++column) {
        const glm::ivec2 sample = lattice.sample(level, {column, row});
        heights.push_back(grid.height_m(sample.x, sample.y));
      }
    }
    levels.push_back({.frame = grid.frame(),
                      .heights = HeightArray(end - first + 1, std::move(heights)),
                      .first = first << level,
                      .step = 1 << level,
                      .leaf_cells = lattice.block_cells,
                      .leaves = list_leaves(selection, known.windows, level, runner)});
    if (window.size == lattice.nodes(level)) break;
  }
  return levels;
}

WindowResults window_results(const HeightGrid& grid, glm::dvec2 place, int side,
                             const MeshBound& bound, int block_cells, const PassRunner& runner) {
  Known known(grid, block_cells);
  known.show_windows_round(place, side);
  const Selection selection = select_nodes(known.lattice, known.windows, bound, runner);
  WindowResults out;
  const std::vector<Level> levels = levels_of(grid, known, selection, runner);
  for (const Level& level : levels) out.leaves.push_back(level.leaves);
  out.meshes = build_level_meshes(selection, levels, runner);
  return out;
}

std::vector<WindowResults> clipmap_results(const HeightGrid& grid, double tolerance_m,
                                           double angle_rad, std::span<const glm::dvec3> places,
                                           const PassRunner& runner) {
  const auto tiles = certified_tiles(grid);
  const ClipmapSettings settings{.tolerance_m = tolerance_m,
                                 .angle_rad = angle_rad,
                                 .memory_bytes = memory_of_small_windows(tiles->lattice())};
  std::vector<WindowResults> all;
  Clipmap clipmap(tiles, grid.frame(), settings, sensor_at(places.front()), runner);
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (i > 0) clipmap = clipmap.moved_to(sensor_at(places[i]), runner);
    WindowResults& out = all.emplace_back();
    for (const Level& level : clipmap.levels()) out.leaves.push_back(level.leaves);
    out.meshes = build_level_meshes(clipmap, runner);
  }
  return all;
}

std::vector<glm::dvec3> places_on(const HeightGrid& grid) {
  const glm::dvec2 last(grid.columns() - 1, grid.rows() - 1);
  std::vector<glm::dvec3> places;
  for (const glm::dvec2 sample : {0.2 * last, 0.2 * last + glm::dvec2(21, 18), 0.97 * last})
    places.emplace_back(grid.frame().to_D(glm::min(sample, last)), 10);
  return places;
}

std::string difference(const PassResults& found, const PassResults& expected) {
  std::string all;
  const auto compare = [&](const auto& a, const auto& b, std::string_view what) {
    if (all.empty()) all = difference(a, b, what);
  };
  if (found.levels.size() != expected.levels.size()) return "number of levels";
  for (std::size_t i = 0; i < found.levels.size(); ++i) {
    const NodeLevel &a = found.levels[i], &b = expected.levels[i];
    const auto of_level = [&](const char* what) { return fmt::format("{} of level {}", what, i); };
    compare(a.key_m, b.key_m, of_level("key_m"));
    compare(a.deviation_m, b.deviation_m, of_level("deviation_m"));
    compare(a.full_m, b.full_m, of_level("full_m"));
    compare(a.low_m, b.low_m, of_level("low_m"));
    compare(a.high_m, b.high_m, of_level("high_m"));
    compare(found.states[i], expected.states[i], of_level("states"));
  }
  if (all.empty() && found.leaves != expected.leaves) all = "leaves";  // they have padding
  return all.empty() ? difference(found.mesh, expected.mesh) : all;
}

std::string difference(const WindowResults& found, const WindowResults& expected) {
  if (found.leaves.size() != expected.leaves.size()) return "number of levels";
  for (std::size_t i = 0; i < found.leaves.size(); ++i) {
    if (found.leaves[i] != expected.leaves[i]) return fmt::format("leaves of window {}", i);
    const std::string of_mesh = difference(found.meshes[i], expected.meshes[i]);
    if (!of_mesh.empty()) return fmt::format("{} of window {}", of_mesh, i);
  }
  return "";
}

std::string difference(const std::vector<WindowResults>& found,
                       const std::vector<WindowResults>& expected) {
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const std::string at_place = difference(found.at(i), expected[i]);
    if (!at_place.empty()) return fmt::format("{} at place {}", at_place, i);
  }
  return "";
}

}  // namespace groundray::testing
