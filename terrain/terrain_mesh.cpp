#include "terrain/terrain_mesh.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <limits>
#include <memory>

#include "core/error.h"
#include "terrain/lod/deviation.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/emission.h"
#include "terrain/lod/prefix_sum.h"

namespace groundray {
namespace {

using passes::LeafTree;
using passes::VertexNumbers;

// Returns an uninitialised array; each element is written before it is read.
template <typename T>
std::unique_ptr<T[]> uncleared(std::size_t count) {
  return std::make_unique_for_overwrite<T[]>(count);
}

// Replaces counts by the sums of those before; returns the total.
std::uint32_t first_indices(std::uint32_t* counts, std::size_t size, const char* what,
                            const PassRunner& runner) {
  const std::uint64_t total = sum_up(counts, size, runner);
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(
        "terrain mesh: {} {} exceed the range of 32-bit indices; raise the tolerance, or mesh the "
        "DEM in parts",
        total, what);
  }
  return static_cast<std::uint32_t>(total);
}

// Leaves that satisfy a bound, and their selection; the certificate itself is not kept.
struct LeafList {
  Selection selection;
  std::vector<Leaf> leaves;
};

LeafList find_leaves(const HeightGrid& grid, MeshBound bound, int block_cells,
                     const PassRunner& runner) {
  const Lattice lattice{{grid.columns(), grid.rows()}, block_cells};
  bound.cell_m = {std::abs(grid.step_m().x), std::abs(grid.step_m().y)};
  const std::vector<NodeLevel> levels = certify(
      grid, block_cells, bound.angle_rad == 0 ? NodeDetail::KeysOnly : NodeDetail::Full, runner);
  std::vector<NodeWindow> windows;
  for (const NodeLevel& level : levels) windows.push_back(whole_window(level));
  LeafList list{select_nodes(lattice, windows, bound, runner), {}};
  list.leaves = list_leaves(list.selection, windows, 0, runner);
  return list;
}

// Part of the DEM that has a mesh of its own: a window, except for that of the next finer level.
struct MeshWindow {
  HeightWindow heights;  // points of `level`
  int level = 0;
  Rectangle cells, finer;  // of the DEM
  bool has_holes = false;
  std::span<const Leaf> leaves;
};

// Builds meshes of leaves of a selection.
class MeshBuilder {
 public:
  MeshBuilder(const Selection& selection, const glm::dvec2& step_m, const PassRunner& runner)
      : runner_(runner), is_mirrored_(step_m.x * step_m.y > 0) {
    tree_.samples = selection.lattice.samples;
    tree_.block_cells = selection.lattice.block_cells;
    for (std::size_t level = 0; level < selection.levels.size(); ++level) {
      const Selection::Level& from = selection.levels[level];
      leaf_of_node_.push_back(uncleared<std::uint32_t>(from.state.size()));
      tree_.levels[level] = {from.state.data(), leaf_of_node_.back().get(), from.first,
                             from.size.x};
    }
  }

  TerrainMesh build(const MeshWindow& window) const {
    const std::size_t count = window.leaves.size();
    LeafTree tree = tree_;
    tree.heights = window.heights;
    tree.heights_level = window.level;
    tree.window = window.cells;
    tree.finer = window.finer;
    tree.leaves = window.leaves.data();
    run_pass(runner_, count, passes::NumberLeavesPass{tree});
    VertexNumbers numbers{tree};
    const bool is_whole =
        window.finer == Rectangle() && window.cells == Rectangle{{0, 0}, tree.last_sample()};
    const Marks marks = is_whole && !window.has_holes ? Marks() : mark_vertices(tree, count);
    numbers.marks = marks.bits.data();
    numbers.mark_of = marks.of_leaf.get();
    return emit(numbers, count);
  }

 private:
  // Vertices of the leaves that need marks.
  struct Marks {
    std::unique_ptr<std::uint32_t[]> of_leaf;
    std::vector<std::uint64_t> bits;
  };

  Marks mark_vertices(const LeafTree& tree, std::size_t count) const {
    Marks marks{uncleared<std::uint32_t>(count), {}};
    run_pass(runner_, count, passes::CountMarkedPass{tree, marks.of_leaf.get()});
    const std::uint32_t marked_count = first_indices(marks.of_leaf.get(), count, "leaves", runner_);
    const auto marked = uncleared<std::uint32_t>(marked_count);
    run_pass(runner_, count, passes::ListMarkedPass{tree, marks.of_leaf.get(), marked.get()});
    marks.bits.resize(marked_count * tree.mark_words());
    run_pass(runner_, marked_count,
             passes::MarkVerticesPass{tree, marked.get(), marks.bits.data()});
    return marks;
  }

  TerrainMesh emit(VertexNumbers& numbers, std::size_t count) const {
    const auto first_vertex = uncleared<std::uint32_t>(count);
    const auto first_triangle = uncleared<std::uint32_t>(count);
    run_pass(runner_, count,
             passes::CountMeshPass{numbers, first_vertex.get(), first_triangle.get()});
    TerrainMesh mesh;
    const std::uint32_t vertices = first_indices(first_vertex.get(), count, "vertices", runner_);
    const std::uint32_t triangles =
        first_indices(first_triangle.get(), count, "triangles", runner_);
    numbers.first = first_vertex.get();
    mesh.vertices.resize(vertices);
    run_pass(runner_, count, passes::EmitVerticesPass{numbers, mesh.vertices.data()});
    mesh.triangles.resize(triangles);
    mesh.levels.resize(triangles);
    run_pass(runner_, count,
             passes::EmitTrianglesPass{numbers, first_triangle.get(), is_mirrored_,
                                       mesh.triangles.data(), mesh.levels.data()});
    return mesh;
  }

  const PassRunner& runner_;
  bool is_mirrored_;
  LeafTree tree_;
  std::vector<std::unique_ptr<std::uint32_t[]>> leaf_of_node_;  // by level
};

}  // namespace

TerrainMesh build_terrain_mesh(const HeightGrid& grid, const MeshBound& bound, int block_cells,
                               const PassRunner& runner) {
  const LeafList list = find_leaves(grid, bound, block_cells, runner);
  const glm::ivec2 samples = list.selection.lattice.samples;
  const HeightWindow heights{{0, 0}, samples, grid.heights_m().data(), grid.columns()};
  return MeshBuilder(list.selection, grid.step_m(), runner)
      .build({heights, 0, {{0, 0}, samples - 1}, {}, grid.hole_count() > 0, list.leaves});
}

std::vector<TerrainMesh> build_level_meshes(const Selection& selection,
                                            std::span<const Level> levels,
                                            const PassRunner& runner) {
  std::vector<TerrainMesh> meshes;
  if (levels.empty()) return meshes;
  const MeshBuilder builder(selection, levels.front().frame.step_m, runner);
  Rectangle finer;
  for (const Level& level : levels) {
    const int number = std::countr_zero(static_cast<std::uint32_t>(level.step));
    const glm::ivec2 size = level.heights.size();
    const Rectangle cells{level.first, glm::min(level.first + (size - 1) * level.step,
                                                selection.lattice.samples - 1)};
    const HeightWindow heights{level.first >> number, size, level.heights.heights_m().data(),
                               size.x};
    meshes.push_back(builder.build(
        {heights, number, cells, finer, level.heights.hole_count() > 0, level.leaves}));
    finer = cells;
  }
  return meshes;
}

}  // namespace groundray
