#include "terrain/terrain_mesh.h"

#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <utility>

#include "core/error.h"
#include "terrain/lod/deviation.h"
#include "terrain/lod/lattice.h"
#include "terrain/lod/passes/emission.h"

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
std::uint32_t sum_up(std::uint32_t* counts, std::size_t size, const char* what) {
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < size; ++i) {
    total += std::exchange(counts[i], static_cast<std::uint32_t>(total));
  }
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
  list.leaves = list_leaves(list.selection, windows, 0, lattice.top_level(), runner);
  return list;
}

class MeshBuilder {
 public:
  MeshBuilder(const HeightGrid& grid, const LeafList& list, const PassRunner& runner)
      : runner_(runner), count_(list.leaves.size()) {
    const Lattice& lattice = list.selection.lattice;
    LeafTree& tree = numbers_.tree;
    tree.samples = {{0, 0}, lattice.samples, grid.heights_m().data(), grid.columns()};
    tree.block_cells = lattice.block_cells;
    tree.level_count = static_cast<int>(list.selection.levels.size());
    tree.leaves = list.leaves.data();
    for (std::size_t level = 0; level < list.selection.levels.size(); ++level) {
      const Selection::Level& from = list.selection.levels[level];
      leaf_of_node_.push_back(uncleared<std::uint32_t>(from.state.size()));
      tree.levels[level] = {from.state.data(), leaf_of_node_.back().get(), from.size};
    }
    run_pass(runner_, count_, passes::NumberLeavesPass{tree});
    if (grid.hole_count() > 0) mark_vertices();
    is_mirrored_ = grid.step_m().x * grid.step_m().y > 0;
  }

  TerrainMesh build() {
    std::vector<std::uint32_t> first_vertex(count_);
    std::vector<std::uint32_t> first_triangle(count_);
    run_pass(runner_, count_,
             passes::CountMeshPass{numbers_.tree, numbers_.marks, numbers_.mark_of,
                                   first_vertex.data(), first_triangle.data()});
    TerrainMesh mesh;
    const std::uint32_t vertices = sum_up(first_vertex.data(), count_, "vertices");
    const std::uint32_t triangles = sum_up(first_triangle.data(), count_, "triangles");
    numbers_.first = first_vertex.data();
    mesh.vertices.resize(vertices);
    run_pass(runner_, count_, passes::EmitVerticesPass{numbers_, mesh.vertices.data()});
    mesh.triangles.resize(triangles);
    mesh.levels.resize(triangles);
    run_pass(runner_, count_,
             passes::EmitTrianglesPass{numbers_, first_triangle.data(), is_mirrored_,
                                       mesh.triangles.data(), mesh.levels.data()});
    return mesh;
  }

 private:
  void mark_vertices() {
    const LeafTree& tree = numbers_.tree;
    mark_of_.resize(count_);
    std::vector<std::uint32_t> holed;
    for (std::size_t leaf = 0; leaf < count_; ++leaf) {
      if (!tree.leaves[leaf].has_holes) continue;
      mark_of_[leaf] = static_cast<std::uint32_t>(holed.size());
      holed.push_back(static_cast<std::uint32_t>(leaf));
    }
    marks_.resize(holed.size() * tree.mark_words());
    run_pass(runner_, holed.size(), passes::MarkVerticesPass{tree, holed.data(), marks_.data()});
    numbers_.marks = marks_.data();
    numbers_.mark_of = mark_of_.data();
  }

  const PassRunner& runner_;
  std::size_t count_;  // number of leaves
  VertexNumbers numbers_;
  std::vector<std::unique_ptr<std::uint32_t[]>> leaf_of_node_;
  std::vector<std::uint32_t> mark_of_;
  std::vector<std::uint64_t> marks_;
  bool is_mirrored_ = false;
};

}  // namespace

TerrainMesh build_terrain_mesh(const HeightGrid& grid, const MeshBound& bound, int block_cells,
                               const PassRunner& runner) {
  const LeafList list = find_leaves(grid, bound, block_cells, runner);
  return MeshBuilder(grid, list, runner).build();
}

}  // namespace groundray
