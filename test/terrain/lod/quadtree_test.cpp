#include "terrain/lod/quadtree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include "core/error.h"
#include "core/geometry/height_grid.h"
#include "core/random.h"
#include "terrain/lod/deviation.h"
#include "test/support/terrain/shuffled_runner.h"
#include "test/support/terrain/slow_quadtree.h"

namespace groundray::quadtree_test {
namespace {

using groundray::testing::bound_of;
using groundray::testing::Known;
using groundray::testing::Node;
using groundray::testing::SlowQuadtree;
using ::testing::HasSubstr;

constexpr float infinity = std::numeric_limits<float>::infinity();

double uniform(Seed seed, std::size_t index) {
  return random_uniform({seed, 0, 0, static_cast<std::uint32_t>(index)}).x;
}

// Gentle hills, a rough patch, a few spikes and, if requested, holes.
HeightGrid hills(glm::ivec2 size, Seed seed, int holes = 0) {
  std::vector<float> heights;
  for (int r = 0; r < size.y; ++r) {
    for (int c = 0; c < size.x; ++c) {
      const double u = uniform(seed, heights.size());
      const bool rough = c > size.x / 2 && c < 3 * size.x / 4 && r < size.y / 3;
      const double spike = u > 0.999 ? 40 : 0;
      heights.push_back(static_cast<float>(20 * std::sin(c / 19.0) * std::cos(r / 17.0) + spike +
                                           (rough ? 6 : 0.2) * u));
    }
  }
  for (int i = 0; i < holes; ++i) {
    const double at = uniform(Seed{seed.value + 1}, std::size_t(i)) * double(heights.size());
    heights[std::size_t(at)] = std::numeric_limits<float>::quiet_NaN();
  }
  return {size, {0, 0}, {2, -3}, heights};
}

template <typename Act>
void for_each_state(const Selection& selection, const Act& act) {
  for (std::size_t level = 0; level < selection.levels.size(); ++level) {
    const Selection::Level& all = selection.levels[level];
    for (int r = 0; r < all.size.y; ++r) {
      for (int c = 0; c < all.size.x; ++c) {
        const glm::ivec2 node = all.first + glm::ivec2(c, r);
        act(Node{int(level), node.x, node.y}, all.at(node));
      }
    }
  }
}

std::set<Node> leaves_of(const Selection& selection) {
  std::set<Node> leaves;
  for_each_state(selection, [&](const Node& node, unsigned state) {
    if ((state & NodeState::IsLeaf) != 0) leaves.insert(node);
  });
  return leaves;
}

// Returns the sides of a leaf that face coarser leaves; fails if these are coarser by more than one
// level.
unsigned coarser_sides(const SlowQuadtree& tree, const Lattice& lattice, const Node& node) {
  const glm::ivec2 block = glm::ivec2(node.column, node.row) * lattice.block_cells;
  const glm::ivec2 first = lattice.sample(node.level, block);
  const glm::ivec2 last = lattice.sample(node.level, block + lattice.block_cells);
  unsigned sides = 0;
  const auto look = [&](int c, int r, unsigned side) {
    if (c < 0 || r < 0 || c >= lattice.samples.x - 1 || r >= lattice.samples.y - 1) return;
    const int level = tree.level_at({c, r});
    EXPECT_LE(level, node.level + 1);
    if (level > node.level) sides |= side;
  };
  for (int r = first.y; r < last.y; ++r) {
    look(first.x - 1, r, Leaf::West);
    look(last.x, r, Leaf::East);
  }
  for (int c = first.x; c < last.x; ++c) {
    look(c, first.y - 1, Leaf::North);
    look(c, last.y, Leaf::South);
  }
  return sides;
}

std::vector<MeshBound> some_bounds() {
  std::vector<MeshBound> bounds;
  for (const double tolerance_m : {0.0, 0.1, 0.5, 2.0, 10.0, 1e9, double(infinity)}) {
    bounds.push_back({.tolerance_m = tolerance_m});
  }
  for (const double angle_rad : {0.003, 0.03}) {
    bounds.push_back({0.05, angle_rad, {20, 30, 5}, {60, 33, 9}, {2, 3}});
    bounds.push_back({0, angle_rad, {-500, 230, 4}, {-500, 240, 40}, {2, 3}});
    bounds.push_back({0, 5 * angle_rad, {380, -30, 0}, {390, -9, 0}, {2, 3}});
    bounds.push_back({0.05, angle_rad, {20, 30, 5}, {60, 33, 9}, {2, 3}, 2});
  }
  return bounds;
}

void expect_as_slow(const Known& known, const MeshBound& bound) {
  const SlowQuadtree expected(known, bound);
  const Selection selection = select_nodes(known.lattice, known.windows, bound);
  EXPECT_EQ(leaves_of(selection), expected.leaves());
  for_each_state(selection, [&](const Node& node, unsigned state) {
    if ((state & NodeState::IsLeaf) == 0) return;
    EXPECT_EQ(state & NodeState::AllSides, coarser_sides(expected, known.lattice, node));
    const float key = known.of(node).key_m[known.index(node)];
    EXPECT_EQ((state & NodeState::Holed) != 0, key == infinity || key < 0);
  });
}

TEST(Quadtree, LeavesMatchSequentialSplitting) {
  for (const int holes : {0, 12}) {
    for (const int block_cells : {2, 4, 6}) {
      const Known known(hills({93, 70}, Seed{1}, holes), block_cells);
      for (const MeshBound& bound : some_bounds()) {
        SCOPED_TRACE(fmt::format("B = {}, tolerance {}, angle {}", block_cells, bound.tolerance_m,
                                 bound.angle_rad));
        expect_as_slow(known, bound);
      }
    }
  }
}

TEST(Quadtree, LeavesMatchSequentialSplittingWithinWindows) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const int block_cells = seed % 2 == 0 ? 2 : 4;
    Known known(hills({150, 131}, Seed{seed}, seed > 2 ? 10 : 0), block_cells);
    const glm::dvec2 place = random_uniform({Seed{seed}, 9}) * glm::dvec2(150, 131);
    known.show_windows_round(place, 12);
    for (const MeshBound& bound : some_bounds()) {
      SCOPED_TRACE(
          fmt::format("seed {}, tolerance {}, angle {}", seed, bound.tolerance_m, bound.angle_rad));
      expect_as_slow(known, bound);
    }
  }
}

TEST(Quadtree, LevelsWithoutAWindowAreNotUsed) {
  Known known(hills({93, 70}, Seed{1}), 2);
  for (const int level : {0, 1}) known.show(level, {0, 0}, {0, 0});
  for (const MeshBound& bound : some_bounds()) expect_as_slow(known, bound);
  const Selection selection = select_nodes(known.lattice, known.windows, {});
  EXPECT_EQ(leaves_of(selection).begin()->level, 2);
}

TEST(Quadtree, WithCompleteWindowsEveryLeafKeepsItsBound) {
  for (const int block_cells : {2, 8}) {
    const Known known(hills({211, 170}, Seed{7}), block_cells);
    for (const MeshBound& bound : some_bounds()) {
      const Selection selection = select_nodes(known.lattice, known.windows, bound);
      for_each_state(selection, [&](const Node& node, unsigned state) {
        if ((state & NodeState::IsLeaf) == 0) return;
        const bool is_thinned = (state & NodeState::AllSides) != 0;
        if ((state & NodeState::Tight) != 0) {
          EXPECT_EQ(node.level, 0);
          EXPECT_FALSE(is_thinned);
        }
        const auto& deviations = is_thinned ? known.of(node).deviation_m : known.of(node).full_m;
        // Squares and products in double: a few roundings of 2^-53.
        EXPECT_LE(deviations[known.index(node)], bound_of(known, bound, node) * (1 + 1e-15L));
      });
    }
  }
}

TEST(Quadtree, SmallerBoundSplitsEveryNodeThatALargerOneSplits) {
  const Known known(hills({301, 250}, Seed{8}, 5), 2);
  const auto expect_nested = [&](const MeshBound& smaller, const MeshBound& larger) {
    const Selection fine = select_nodes(known.lattice, known.windows, smaller);
    const Selection coarse = select_nodes(known.lattice, known.windows, larger);
    int more = 0;
    for_each_state(coarse, [&](const Node& node, unsigned state) {
      const unsigned other = fine.levels[std::size_t(node.level)].at({node.column, node.row});
      EXPECT_LE(state & NodeState::Split, other & NodeState::Split);
      more += (other & NodeState::Split) != (state & NodeState::Split) ? 1 : 0;
    });
    EXPECT_GT(more, 0);
  };
  expect_nested({.tolerance_m = 0.3}, {.tolerance_m = 0.4});
  expect_nested({.tolerance_m = 2}, {.tolerance_m = 5});
  expect_nested({0.05, 0.002, {20, 30, 5}, {60, 33, 9}, {2, 3}},
                {0.05, 0.003, {20, 30, 5}, {60, 33, 9}, {2, 3}});
}

TEST(Quadtree, LeavesAreListedFineToCoarseRowByRowWithTheirDeviations) {
  const Known known(hills({93, 70}, Seed{1}, 40), 2);
  const MeshBound bound{.tolerance_m = 0.5};
  const Selection selection = select_nodes(known.lattice, known.windows, bound);
  std::vector<Leaf> expected;
  for_each_state(selection, [&](const Node& node, unsigned state) {
    const std::size_t at = known.index(node);
    if ((state & NodeState::IsLeaf) == 0 || known.of(node).low_m[at] == infinity) return;
    const int side = 2 << node.level;
    const auto sides = static_cast<std::uint8_t>(state & NodeState::AllSides);
    expected.push_back({node.column * side, node.row * side, 1 << node.level, sides,
                        known.of(node).key_m[at] == infinity,
                        sides == 0 ? known.of(node).full_m[at] : known.of(node).deviation_m[at],
                        known.of(node).high_m[at]});
  });
  EXPECT_TRUE(list_leaves(selection, known.windows, 0) == expected);
}

TEST(Quadtree, LeavesAreListedInTheFinestWindowThatContainsThem) {
  for (const int block_cells : {2, 4}) {
    Known known(hills({300, 231}, Seed{5}, 10), block_cells);
    known.show_windows_round({90, 170}, 12);
    for (const MeshBound& bound : some_bounds()) {
      const Selection selection = select_nodes(known.lattice, known.windows, bound);
      std::map<int, std::vector<std::array<int, 3>>> expected;
      for_each_state(selection, [&](const Node& node, unsigned state) {
        if ((state & NodeState::IsLeaf) == 0) return;
        const int side = block_cells << node.level;
        int window = 0;
        while (true) {
          const NodeWindow& at = known.windows[std::size_t(window)];
          const int width = block_cells << window;
          if (Rectangle{at.first * width, (at.first + at.size) * width}.holds(
                  {node.column * side, node.row * side}))
            break;
          ++window;
        }
        expected[window].push_back({node.column * side, node.row * side, 1 << node.level});
      });
      std::map<int, std::vector<std::array<int, 3>>> found;
      for (int window = 0; window <= known.lattice.top_level(); ++window) {
        for (const Leaf& leaf : list_leaves(selection, known.windows, window))
          found[window].push_back({leaf.column, leaf.row, leaf.step});
      }
      EXPECT_EQ(found, expected);
      EXPECT_GE(found.size(), 1u);
    }
  }
}

TEST(Quadtree, NodesWithoutHeightsAreNeitherSplitNorListed) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const HeightGrid nothing({40, 30}, {0, 0}, {1, 1}, std::vector<float>(1200, nan));
  const Known known(nothing, 2);
  const Selection selection = select_nodes(known.lattice, known.windows, {});
  EXPECT_EQ(leaves_of(selection), (std::set<Node>{{known.lattice.top_level(), 0, 0}}));
  EXPECT_TRUE(list_leaves(selection, known.windows, 0).empty());
}

TEST(Quadtree, DoesNotDependOnExecutionOrderOrThreads) {
  Known known(hills({700, 600}, Seed{9}, 20), 2);
  known.show_windows_round({400, 222}, 100);
  const MeshBound bound{0.05, 0.01, {20, 30, 5}, {60, 33, 9}, {2, 3}};
  const Selection expected = select_nodes(known.lattice, known.windows, bound);
  const auto lists = [&](const Selection& selection, const PassRunner& runner) {
    std::vector<std::vector<Leaf>> all;
    for (int window = 0; window <= known.lattice.top_level(); ++window)
      all.push_back(list_leaves(selection, known.windows, window, runner));
    return all;
  };
  const auto leaves = lists(expected, {});
  EXPECT_GT(leaves.front().size(), 1000u);
  const auto expect_same = [&](const PassRunner& runner) {
    const Selection found = select_nodes(known.lattice, known.windows, bound, runner);
    for (std::size_t level = 0; level < expected.levels.size(); ++level) {
      EXPECT_EQ(found.levels[level].state, expected.levels[level].state);
    }
    EXPECT_TRUE(lists(found, runner) == leaves);
  };
  for (const std::uint64_t seed : {1, 2, 3}) {
    expect_same(groundray::testing::shuffled_runner(Seed{seed}));
  }
  for (const int threads : {1, 2, 5}) expect_same(groundray::testing::threaded_runner(threads));
}

TEST(Quadtree, RejectsInvalidBounds) {
  const Known known(hills({9, 9}, Seed{1}), 2);
  const auto message = [&](const MeshBound& bound) -> std::string {
    try {
      select_nodes(known.lattice, known.windows, bound);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message({.tolerance_m = -1, .angle_rad = nan}),
              AllOf(HasSubstr("mesh bound"), HasSubstr("tolerance_m = -1 must be 0 or more"),
                    HasSubstr("angle_rad = nan must be 0 or more, and finite")));
  EXPECT_THAT(message({.tolerance_m = nan}), HasSubstr("tolerance_m = nan"));
}

}  // namespace
}  // namespace groundray::quadtree_test
