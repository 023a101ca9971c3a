#include "terrain/terrain_mesh.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "terrain/judge/mesh_topology.h"
#include "terrain/lod/deviation.h"
#include "test/support/terrain/leaf_triangles.h"
#include "test/support/terrain/pass_results.h"
#include "test/support/terrain/sample_clipmap.h"
#include "test/support/terrain/sample_terrain.h"
#include "test/support/terrain/shuffled_runner.h"
#include "test/support/terrain/slow_quadtree.h"

namespace groundray::terrain_mesh_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double infinity = std::numeric_limits<double>::infinity();

// Part of a fractal landscape, of any size up to 129 x 129.
HeightGrid landscape(glm::ivec2 size, Seed seed, glm::dvec2 step_m = {4, -4}) {
  const HeightGrid square = groundray::testing::fractal(129, 4, 120, seed);
  std::vector<float> heights;
  for (int r = 0; r < size.y; ++r) {
    for (int c = 0; c < size.x; ++c) heights.push_back(square.height_m(c, r));
  }
  return {size, {10, 20}, step_m, heights};
}

HeightGrid with_holes(const HeightGrid& grid) {
  return groundray::testing::with_holes(grid, 9, 3, Seed{5});
}

std::vector<MeshBound> some_bounds() {
  return {{.tolerance_m = 0},
          {.tolerance_m = 0.5},
          {.tolerance_m = 4},
          {.tolerance_m = infinity},
          {.tolerance_m = 0.2, .angle_rad = 0.02, .low_m = {90, 70, 10}, .high_m = {120, 70, 30}}};
}

// A triangle as its sorted samples, independent of the first vertex, and its level.
using Place = std::array<std::pair<int, int>, 3>;
using Piece = std::pair<Place, int>;

Piece piece(glm::ivec2 a, glm::ivec2 b, glm::ivec2 c, int level) {
  Place place{{{a.x, a.y}, {b.x, b.y}, {c.x, c.y}}};
  std::ranges::sort(place);
  return {place, level};
}

std::vector<Piece> pieces_of(const TerrainMesh& mesh) {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3 t = mesh.triangles[i];
    pieces.push_back(
        piece(mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z], mesh.levels[i]));
  }
  std::ranges::sort(pieces);
  return pieces;
}

// The triangles that leaves represent, made by test/support.
std::vector<Piece> pieces_of(const HeightGrid& grid, std::span<const Leaf> leaves,
                             int block_cells) {
  std::vector<Piece> pieces;
  for (const Leaf& leaf : leaves) {
    const int level = std::countr_zero(static_cast<unsigned>(leaf.step));
    for (const auto& [a, b, c] : groundray::testing::leaf_triangles(grid, {&leaf, 1}, block_cells))
      pieces.push_back(piece(a, b, c, level));
  }
  std::ranges::sort(pieces);
  return pieces;
}

// The triangles that the leaves of the certificate represent.
std::vector<Piece> pieces_of_leaves(const HeightGrid& grid, MeshBound bound, int block_cells) {
  bound.cell_m = {std::abs(grid.step_m().x), std::abs(grid.step_m().y)};
  const Lattice lattice{{grid.columns(), grid.rows()}, block_cells};
  const auto levels = certify(grid, block_cells, NodeDetail::Full);
  std::vector<NodeWindow> windows;
  for (const NodeLevel& level : levels) windows.push_back(whole_window(level));
  const Selection selection = select_nodes(lattice, windows, bound);
  return pieces_of(grid, list_leaves(selection, windows, 0), block_cells);
}

// Joins meshes at vertices in the same place, and expects each mesh to have no more vertices than
// its triangles use, each once.
TerrainMesh joined(std::span<const TerrainMesh> meshes) {
  TerrainMesh all;
  std::map<std::pair<int, int>, unsigned> known;
  for (const TerrainMesh& mesh : meshes) {
    std::set<std::pair<int, int>> own;
    std::vector<unsigned> number;
    for (const glm::ivec2 p : mesh.vertices) {
      EXPECT_TRUE(own.emplace(p.x, p.y).second);
      const auto [at, is_new] =
          known.try_emplace({p.x, p.y}, static_cast<unsigned>(all.vertices.size()));
      if (is_new) all.vertices.push_back(p);
      number.push_back(at->second);
    }
    std::set<unsigned> used;
    for (const glm::uvec3 t : mesh.triangles) {
      used.insert({t.x, t.y, t.z});
      all.triangles.emplace_back(number.at(t.x), number.at(t.y), number.at(t.z));
    }
    EXPECT_EQ(used.size(), mesh.vertices.size());
    all.levels.insert(all.levels.end(), mesh.levels.begin(), mesh.levels.end());
  }
  return all;
}

// Returns the number of edges that two triangles have in the same direction.
std::size_t repeated_edges(const TerrainMesh& mesh) {
  std::set<std::pair<unsigned, unsigned>> edges;
  std::size_t repeated = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) repeated += edges.emplace(t[k], t[(k + 1) % 3]).second ? 0 : 1;
  }
  return repeated;
}

TEST(TerrainMesh, TrianglesMatchTheLeaves) {
  for (const glm::ivec2 size :
       {glm::ivec2{2, 2}, {5, 4}, {33, 33}, {70, 41}, {100, 3}, {90, 129}}) {
    const HeightGrid whole = landscape(size, Seed{1});
    for (const HeightGrid& grid : {whole, with_holes(whole)}) {
      for (const int block_cells : {2, 4, 6, 8}) {
        for (const MeshBound& bound : some_bounds()) {
          SCOPED_TRACE(fmt::format("{} x {}, {} holes, B = {}, {} m, {} rad", size.x, size.y,
                                   grid.hole_count(), block_cells, bound.tolerance_m,
                                   bound.angle_rad));
          const TerrainMesh mesh = build_terrain_mesh(grid, bound, block_cells);
          EXPECT_TRUE(pieces_of(mesh) == pieces_of_leaves(grid, bound, block_cells));
          EXPECT_THAT(judge::topology_faults(grid, mesh.vertices, mesh.triangles), IsEmpty());
        }
      }
    }
  }
}

TEST(TerrainMesh, MeshesOfWindowsMatchTheirLeavesAndMeetWithoutCracks) {
  std::size_t most_levels = 0;
  for (const glm::ivec2 size : {glm::ivec2{129, 129}, {101, 74}, {118, 93}, {30, 129}}) {
    const HeightGrid whole = landscape(size, Seed{8});
    for (const HeightGrid& grid : {whole, with_holes(whole)}) {
      for (const int block_cells : {2, 4, 6, 8}) {
        for (MeshBound bound : some_bounds()) {
          bound.cell_m = glm::abs(grid.step_m());
          for (const glm::dvec2 share : {glm::dvec2{0.5, 0.4}, {0.02, 0.9}, {1, 1}}) {
            SCOPED_TRACE(fmt::format("{} x {}, {} holes, B = {}, {} m, {} rad, at {} {}", size.x,
                                     size.y, grid.hole_count(), block_cells, bound.tolerance_m,
                                     bound.angle_rad, share.x, share.y));
            groundray::testing::Known known(grid, block_cells);
            known.show_windows_round(share * glm::dvec2(size - 1), 8);
            const Selection selection = select_nodes(known.lattice, known.windows, bound);
            const auto levels = groundray::testing::levels_of(grid, known, selection);
            const auto meshes = build_level_meshes(selection, levels);
            ASSERT_EQ(meshes.size(), levels.size());
            for (std::size_t i = 0; i < levels.size(); ++i)
              EXPECT_TRUE(pieces_of(meshes[i]) == pieces_of(grid, levels[i].leaves, block_cells));
            const TerrainMesh mesh = joined(meshes);
            EXPECT_EQ(repeated_edges(mesh), 0u);
            // Leaves that bridge holes have triangles where the DEM has none.
            if (grid.hole_count() == 0) {
              EXPECT_THAT(groundray::judge::topology_faults(grid, mesh.vertices, mesh.triangles),
                          IsEmpty());
            }
            most_levels = std::max(most_levels, levels.size());
          }
        }
      }
    }
  }
  EXPECT_GE(most_levels, 4u);
}

// Returns the mesh of all leaves of a clipmap as those of one window, the whole DEM.
TerrainMesh mesh_as_a_whole(const HeightGrid& grid, const Clipmap& clipmap) {
  Selection whole{clipmap.selection().lattice, {}};
  for (std::size_t level = 0; level < clipmap.selection().levels.size(); ++level) {
    const Selection::Level& from = clipmap.selection().levels[level];
    const glm::ivec2 size = whole.lattice.nodes(static_cast<int>(level));
    auto& to = whole.levels.emplace_back(Selection::Level{{0, 0}, size, {}});
    for (int row = 0; row < size.y; ++row) {
      for (int column = 0; column < size.x; ++column) {
        const glm::ivec2 node{column, row};
        const bool is_in = Rectangle{from.first, from.first + from.size}.holds(node);
        to.state.push_back(is_in ? from.at(node) : std::uint8_t{0});
      }
    }
  }
  Level all{.frame = grid.frame(), .heights = grid.samples()};
  for (const Level& level : clipmap.levels())
    all.leaves.insert(all.leaves.end(), level.leaves.begin(), level.leaves.end());
  return build_level_meshes(whole, {&all, 1}).front();
}

TEST(TerrainMesh, MeshesOfAMovedClipmapAreTogetherThatOfTheWholeDem) {
  const HeightGrid ground = groundray::testing::fractal(513, 5, 500, Seed{34});
  for (const HeightGrid& grid : {ground, with_holes(ground)}) {
    const auto places = groundray::testing::places_on(grid);
    Clipmap clipmap(groundray::testing::certified_tiles(grid), grid.frame(),
                    {.tolerance_m = 0.2, .angle_rad = 0.5, .memory_bytes = 4'000'000},
                    groundray::testing::sensor_at(places[0]));
    EXPECT_GE(clipmap.levels().size(), 3u);
    for (const glm::dvec3& place : places) {
      clipmap = clipmap.moved_to(groundray::testing::sensor_at(place));
      const auto meshes = build_level_meshes(clipmap);
      for (std::size_t i = 0; i < meshes.size(); ++i) {
        EXPECT_TRUE(pieces_of(meshes[i]) ==
                    pieces_of(grid, clipmap.levels()[i].leaves, Certificate::block_cells));
      }
      const TerrainMesh mesh = joined(meshes);
      EXPECT_EQ(repeated_edges(mesh), 0u);
      const TerrainMesh expected = mesh_as_a_whole(grid, clipmap);
      EXPECT_TRUE(pieces_of(mesh) == pieces_of(expected));
      EXPECT_EQ(mesh.vertices.size(), expected.vertices.size());
    }
  }
}

TEST(TerrainMesh, TrianglesAreCounterClockwiseFromAboveForAnyGridDirection) {
  for (const glm::dvec2 step_m : {glm::dvec2{2, -2}, {2, 3}, {-2, 3}, {-1, -3}}) {
    const HeightGrid grid = with_holes(landscape({60, 50}, Seed{2}, step_m));
    const TerrainMesh mesh = build_terrain_mesh(grid, {.tolerance_m = 1}, 4);
    ASSERT_GT(mesh.triangles.size(), 100u);
    for (const glm::uvec3& t : mesh.triangles) {
      const glm::dvec2 a = glm::dvec2(mesh.vertices[t.y] - mesh.vertices[t.x]) * step_m;
      const glm::dvec2 b = glm::dvec2(mesh.vertices[t.z] - mesh.vertices[t.x]) * step_m;
      EXPECT_GT(a.x * b.y - a.y * b.x, 0);
    }
  }
}

TEST(TerrainMesh, InfiniteToleranceYieldsTwoTriangles) {
  for (const glm::ivec2 size : {glm::ivec2{2, 2}, {129, 129}, {100, 7}, {3, 90}}) {
    const TerrainMesh mesh =
        build_terrain_mesh(landscape(size, Seed{3}), {.tolerance_m = infinity});
    EXPECT_EQ(mesh.triangles.size(), 2u);
    EXPECT_EQ(mesh.vertices.size(), 4u);
  }
}

TEST(TerrainMesh, PlaneIsTwoTrianglesAtZeroTolerance) {
  for (const glm::ivec2 size : {glm::ivec2{2, 2}, {129, 65}, {100, 7}, {3, 90}, {50, 77}}) {
    std::vector<float> heights;
    for (int r = 0; r < size.y; ++r) {
      for (int c = 0; c < size.x; ++c) heights.push_back(static_cast<float>(3 * c - 2 * r + 7));
    }
    const HeightGrid plane(size, {0, 0}, {1, 1}, heights);
    for (const int block_cells : {2, 8}) {
      EXPECT_EQ(build_terrain_mesh(plane, {.tolerance_m = 0}, block_cells).triangles.size(), 2u);
    }
  }
}

TEST(TerrainMesh, SamplesWithoutTrianglesAreNotVertices) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  // In 4 x 3 samples, the last column and the north-western corner belong to no triangle.
  const HeightGrid grid({4, 3}, {0, 0}, {1, -1},
                        {1, nan, nan, 1,  //
                         nan, 1, 1, nan,  //
                         1, 1, 1, nan});
  const TerrainMesh mesh = build_terrain_mesh(grid, {.tolerance_m = 100});
  EXPECT_EQ(pieces_of(mesh),
            (std::vector<Piece>{piece({0, 2}, {1, 2}, {1, 1}, 0), piece({1, 1}, {1, 2}, {2, 1}, 0),
                                piece({1, 2}, {2, 2}, {2, 1}, 0)}));
  EXPECT_EQ(mesh.vertices.size(), 5u);
}

TEST(TerrainMesh, UsesTheCellSizeOfTheGrid) {
  const HeightGrid grid = landscape({90, 80}, Seed{4}, {3, -5});
  MeshBound bound{.angle_rad = 0.01, .low_m = {90, 70, 10}, .high_m = {120, 70, 30}};
  const TerrainMesh expected = build_terrain_mesh(grid, bound);
  bound.cell_m = {1e9, 0};
  EXPECT_EQ(build_terrain_mesh(grid, bound).vertices, expected.vertices);
}

TEST(TerrainMesh, DoesNotDependOnExecutionOrderOrThreads) {
  const HeightGrid grid = with_holes(landscape({129, 120}, Seed{6}));
  const auto runners = [] {
    std::vector<PassRunner> all;
    for (const std::uint64_t seed : {1, 2, 3}) {
      all.push_back(groundray::testing::shuffled_runner(Seed{seed}));
    }
    for (const int threads : {1, 2, 5}) {
      all.push_back(groundray::testing::threaded_runner(threads));
    }
    return all;
  }();
  for (const MeshBound& bound : some_bounds()) {
    for (const int block_cells : {2, 8}) {
      const TerrainMesh expected = build_terrain_mesh(grid, bound, block_cells);
      for (const PassRunner& runner : runners) {
        const TerrainMesh found = build_terrain_mesh(grid, bound, block_cells, runner);
        EXPECT_TRUE(std::tie(found.vertices, found.triangles, found.levels) ==
                    std::tie(expected.vertices, expected.triangles, expected.levels));
      }
    }
  }
}

TEST(TerrainMesh, RejectsInvalidBoundsAndBlocks) {
  const HeightGrid grid = landscape({9, 9}, Seed{7});
  const auto message = [&](const MeshBound& bound, int block_cells) -> std::string {
    try {
      build_terrain_mesh(grid, bound, block_cells);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(message({}, 3), HasSubstr("block_cells = 3 must be even"));
  EXPECT_THAT(message({.tolerance_m = -2}, 2), HasSubstr("tolerance_m = -2 must be 0 or more"));
  EXPECT_THAT(message({.angle_rad = -1}, 2), HasSubstr("angle_rad = -1 must be 0 or more"));
}

}  // namespace
}  // namespace groundray::terrain_mesh_test
