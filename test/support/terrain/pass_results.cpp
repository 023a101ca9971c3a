#include "test/support/terrain/pass_results.h"

#include <fmt/format.h>

#include <cstring>
#include <string_view>

#include "terrain/lod/deviation.h"

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

}  // namespace

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
  compare(found.mesh.vertices, expected.mesh.vertices, "vertices");
  compare(found.mesh.triangles, expected.mesh.triangles, "triangles");
  compare(found.mesh.levels, expected.mesh.levels, "levels of triangles");
  return all;
}

}  // namespace groundray::testing
