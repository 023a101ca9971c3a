#include "terrain/lod/deviation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "core/tracing/leaf.h"
#include "terrain/lod/passes/half_cell.h"
#include "test/support/terrain/node_oracle.h"
#include "test/support/terrain/shuffled_runner.h"

namespace groundray::deviation_test {
namespace {

using groundray::testing::certify_slowly;
using groundray::testing::NodeDeviations;
using groundray::testing::Real;
using groundray::testing::SampleTriangle;
using groundray::testing::template_triangles;
using ::testing::HasSubstr;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

double uniform(Seed seed, std::size_t index) {
  return random_uniform({seed, 0, 0, static_cast<std::uint32_t>(index)}).x;
}

// Heights are multiples of 1/8 m, so that sums in the product code are exact in double.
HeightGrid noise(glm::ivec2 size, Seed seed, double hole_share = 0) {
  std::vector<float> heights(static_cast<std::size_t>(size.x * size.y));
  for (std::size_t i = 0; i < heights.size(); ++i) {
    heights[i] = static_cast<float>(std::floor(uniform(seed, i) * 800) / 8);
    if (uniform(Seed{seed.value + 1000}, i) < hole_share) heights[i] = nan;
  }
  return {size, {3, 4}, {2, -2}, heights};
}

TEST(DeviationOracle, TrianglesOfEachTemplateFillTheBlock) {
  for (const glm::ivec2 cells : {glm::ivec2{2, 2}, {4, 4}, {8, 8}}) {
    for (unsigned thinned = 0; thinned < 16; ++thinned) {
      int twice_area = 0;
      for (const SampleTriangle& t : template_triangles(cells, thinned)) {
        const glm::ivec2 p = t[1] - t[0];
        const glm::ivec2 q = t[2] - t[0];
        twice_area += std::abs(p.x * q.y - p.y * q.x);
      }
      EXPECT_EQ(twice_area, 2 * cells.x * cells.y) << cells.x << " " << thinned;
    }
  }
}

// In cells whose sides are not powers of two the product code rounds two or three times, by at most
// 2^-53 of 100 m; elsewhere it is exact. The oracle's long doubles round by a thousandth of that.
constexpr Real tolerance = 4e-14L;

// The certified value is the exact one rounded up to the next float.
void expect_rounded_up(float certified, Real exact) {
  EXPECT_GE(certified, exact - tolerance);
  EXPECT_LE(std::nextafter(certified, -1.F), exact + tolerance);
}

struct Samples {
  glm::ivec2 first, last;
};

Samples samples_of(const Lattice& lattice, int level, glm::ivec2 node) {
  return {lattice.sample(level, node * lattice.block_cells),
          lattice.sample(level, (node + 1) * lattice.block_cells)};
}

template <typename Act>
void for_each_sample(const Samples& samples, const Act& act) {
  for (int r = samples.first.y; r <= samples.last.y; ++r) {
    for (int c = samples.first.x; c <= samples.last.x; ++c) act(c, r);
  }
}

// Returns true if a node has samples, or edges between samples, that belong to none of its facets.
bool has_strays(const HeightGrid& grid, const Samples& node) {
  const auto facet = [&](glm::ivec2 cell, bool is_far) {
    if (cell.x < node.first.x || cell.y < node.first.y || cell.x >= node.last.x ||
        cell.y >= node.last.y) {
      return false;
    }
    const int apex = is_far ? 1 : 0;
    return groundray::testing::exists(
        grid, {{cell + apex, cell + glm::ivec2(0, 1), cell + glm::ivec2(1, 0)}});
  };
  bool found = false;
  for_each_sample(node, [&](int c, int r) {
    const auto has = [&](int column, int row) {
      return column <= node.last.x && row <= node.last.y && column >= node.first.x &&
             !std::isnan(grid.height_m(column, row));
    };
    if (!has(c, r)) return;
    const bool any = facet({c, r}, false) || facet({c - 1, r - 1}, true) ||
                     facet({c - 1, r}, false) || facet({c - 1, r}, true) ||
                     facet({c, r - 1}, false) || facet({c, r - 1}, true);
    found |= !any;
    found |= has(c + 1, r) && !facet({c, r}, false) && !facet({c, r - 1}, true);
    found |= has(c, r + 1) && !facet({c, r}, false) && !facet({c - 1, r}, true);
    found |= has(c - 1, r + 1) && !facet({c - 1, r}, false) && !facet({c - 1, r}, true);
  });
  return found;
}

template <typename Act>
void for_each_node(const Lattice& lattice, const Act& act) {
  for (int level = 0; level <= lattice.top_level(); ++level) {
    const glm::ivec2 nodes = lattice.nodes(level);
    for (int j = 0; j < nodes.y; ++j) {
      for (int i = 0; i < nodes.x; ++i)
        act(level, glm::ivec2{i, j}, std::size_t(j) * std::size_t(nodes.x) + std::size_t(i));
    }
  }
}

void expect_certified(const HeightGrid& grid, int block_cells) {
  const Lattice lattice{{grid.columns(), grid.rows()}, block_cells};
  const auto levels = certify(grid, block_cells, NodeDetail::Full);
  ASSERT_EQ(levels.size(), std::size_t(lattice.top_level() + 1));
  for_each_node(lattice, [&](int level, glm::ivec2 node, std::size_t index) {
    SCOPED_TRACE(fmt::format("B = {}, level {}, node {}, {}", block_cells, level, node.x, node.y));
    const NodeLevel& found = levels[std::size_t(level)];
    const NodeDeviations expected = certify_slowly(grid, lattice, level, node);
    expect_rounded_up(found.deviation_m[index], expected.all);
    expect_rounded_up(found.full_m[index], expected.full);
  });
}

class DeviationOfNodes : public ::testing::TestWithParam<glm::ivec2> {};

TEST_P(DeviationOfNodes, IsTheLargestDistanceToTheReferenceOverAllTemplates) {
  for (const int block_cells : {2, 4, 8}) expect_certified(noise(GetParam(), Seed{1}), block_cells);
}

INSTANTIATE_TEST_SUITE_P(Sizes, DeviationOfNodes,
                         ::testing::Values(glm::ivec2{2, 2}, glm::ivec2{2, 9}, glm::ivec2{9, 2},
                                           glm::ivec2{7, 5}, glm::ivec2{13, 17}, glm::ivec2{20, 14},
                                           glm::ivec2{33, 33}, glm::ivec2{50, 37}));

// Heights half way between the two ways of splitting a cell of level `level`, plus a small offset:
// samples deviate little, so that the largest deviation is where edges cross.
HeightGrid between_diagonals(glm::ivec2 size, int level, Seed seed) {
  const Lattice lattice{size, 2};
  const HeightGrid corners = noise(size, seed);
  std::vector<float> heights;
  for (int r = 0; r < size.y; ++r) {
    for (int c = 0; c < size.x; ++c) {
      const glm::ivec2 cell = glm::min(glm::ivec2(c, r) >> level, lattice.cells(level) - 1);
      const glm::ivec2 first = lattice.sample(level, cell);
      const glm::ivec2 last = lattice.sample(level, cell + 1);
      const double x = double(c - first.x) / (last.x - first.x);
      const double y = double(r - first.y) / (last.y - first.y);
      const double nw = corners.height_m(first.x, first.y);
      const double ne = corners.height_m(last.x, first.y);
      const double sw = corners.height_m(first.x, last.y);
      const double se = corners.height_m(last.x, last.y);
      const double anti = x + y < 1 ? nw + x * (ne - nw) + y * (sw - nw)
                                    : se + (1 - x) * (sw - se) + (1 - y) * (ne - se);
      const double main =
          x > y ? nw + x * (ne - nw) + y * (se - ne) : nw + x * (se - sw) + y * (sw - nw);
      const double off = uniform(Seed{seed.value + 50}, heights.size()) - 0.5;
      const bool is_corner = (x == 0 || x == 1) && (y == 0 || y == 1);
      const double height = is_corner ? anti : (anti + main) / 2 + 4 * off;
      heights.push_back(static_cast<float>(std::round(height * 64) / 64));
    }
  }
  return {size, {0, 0}, {1, 1}, heights};
}

TEST(Deviation, IncludesEdgeCrossingsBetweenSamples) {
  expect_certified(between_diagonals({21, 22}, 1, Seed{2}), 2);
  expect_certified(between_diagonals({33, 35}, 2, Seed{3}), 2);
  expect_certified(between_diagonals({55, 52}, 3, Seed{4}), 2);
  expect_certified(between_diagonals({14, 12}, 3, Seed{5}), 2);
}

TEST(Deviation, ComparesOnlyWhereBothSurfacesExist) {
  int compared = 0;
  int with_strays = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const HeightGrid grid = noise({23, 18}, Seed{seed}, 0.01);
    for (const int block_cells : {2, 4}) {
      const Lattice lattice{{23, 18}, block_cells};
      const auto levels = certify(grid, block_cells, NodeDetail::Full);
      for_each_node(lattice, [&](int level, glm::ivec2 node, std::size_t index) {
        SCOPED_TRACE(fmt::format("seed {}, level {}, node {}, {}", seed, level, node.x, node.y));
        const NodeLevel& found = levels[std::size_t(level)];
        const NodeDeviations expected = certify_slowly(grid, lattice, level, node);
        EXPECT_GE(found.deviation_m[index], expected.all - tolerance);
        EXPECT_GE(found.full_m[index], expected.full - tolerance);
        if (has_strays(grid, samples_of(lattice, level, node))) {
          ++with_strays;
        } else {
          ++compared;
          expect_rounded_up(found.deviation_m[index], expected.all);
          expect_rounded_up(found.full_m[index], expected.full);
        }
      });
    }
  }
  EXPECT_GT(compared, 4 * with_strays);
}

TEST(Deviation, KeysAreSaturatedAndMarkHolesAndBoundsMatchTheSamples) {
  for (const double hole_share : {0.0, 0.1, 0.8, 1.0}) {
    const HeightGrid grid = noise({45, 30}, Seed{4}, hole_share);
    const Lattice lattice{{45, 30}, 2};
    const auto levels = certify(grid, 2, NodeDetail::Full);
    for_each_node(lattice, [&](int level, glm::ivec2 node, std::size_t index) {
      const NodeLevel& found = levels[std::size_t(level)];
      constexpr float infinity = std::numeric_limits<float>::infinity();
      float low = infinity;
      float high = -infinity;
      int missing = 0;
      for_each_sample(samples_of(lattice, level, node), [&](int c, int r) {
        const float height = grid.height_m(c, r);
        low = std::fmin(low, height);
        high = std::fmax(high, height);
        missing += std::isnan(height) ? 1 : 0;
      });
      EXPECT_EQ(found.low_m[index], low);
      EXPECT_EQ(found.high_m[index], high);
      if (low > high) {
        EXPECT_LT(found.key_m[index], 0);
      } else if (missing > 0) {
        EXPECT_EQ(found.key_m[index], infinity);
      } else {
        float key = found.deviation_m[index];
        const glm::ivec2 below = level > 0 ? lattice.nodes(level - 1) : glm::ivec2(0);
        for (int r = 2 * node.y; r < std::min(2 * node.y + 2, below.y); ++r) {
          for (int c = 2 * node.x; c < std::min(2 * node.x + 2, below.x); ++c) {
            key = std::max(key, levels[std::size_t(level - 1)]
                                    .key_m[std::size_t(r) * std::size_t(below.x) + std::size_t(c)]);
          }
        }
        EXPECT_EQ(found.key_m[index], key);
      }
    });
  }
}

bool same_bytes(const std::vector<float>& a, const std::vector<float>& b) {
  return std::ranges::equal(
      a, b, {}, [](float x) { return std::bit_cast<std::uint32_t>(x); },
      [](float x) { return std::bit_cast<std::uint32_t>(x); });
}

void expect_same(const std::vector<NodeLevel>& a, const std::vector<NodeLevel>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t level = 0; level < a.size(); ++level) {
    SCOPED_TRACE(level);
    EXPECT_EQ(a[level].size, b[level].size);
    EXPECT_TRUE(same_bytes(a[level].key_m, b[level].key_m));
    EXPECT_TRUE(same_bytes(a[level].deviation_m, b[level].deviation_m));
    EXPECT_TRUE(same_bytes(a[level].full_m, b[level].full_m));
    EXPECT_TRUE(same_bytes(a[level].low_m, b[level].low_m));
    EXPECT_TRUE(same_bytes(a[level].high_m, b[level].high_m));
  }
}

TEST(Deviation, KeysOnlyEqualTheKeysOfAFullCertificate) {
  const HeightGrid grid = noise({90, 61}, Seed{5}, 0.01);
  auto levels = certify(grid, 2, NodeDetail::Full);
  for (NodeLevel& level : levels) {
    level = {level.size, level.key_m, {}, {}, {}, {}};
  }
  expect_same(levels, certify(grid, 2, NodeDetail::KeysOnly));
}

// Window of the DEM, copied to separate memory.
struct Copy {
  std::vector<float> heights_m;
  HeightWindow window;
  Copy(glm::ivec2 first, glm::ivec2 size, auto height_at) {
    for (int r = 0; r < size.y; ++r) {
      for (int c = 0; c < size.x; ++c) heights_m.push_back(height_at(first + glm::ivec2(c, r)));
    }
    window = {first, size, heights_m.data(), size.x};
  }
};

// Certifies a DEM in pieces: its columns and rows of cells are cut at the given positions.
std::vector<NodeLevel> certify_in_pieces(const HeightGrid& grid, int block_cells,
                                         const std::vector<int>& column_cuts,
                                         const std::vector<int>& row_cuts) {
  const Lattice lattice{{grid.columns(), grid.rows()}, block_cells};
  std::vector<NodeLevel> levels;
  for (int level = 0; level <= lattice.top_level(); ++level) {
    levels.push_back(unknown_nodes(lattice.nodes(level), NodeDetail::Full));
    for (std::size_t j = row_cuts.size() - 1; j > 0; --j) {
      for (std::size_t i = 1; i < column_cuts.size(); ++i) {
        const glm::ivec2 first{column_cuts[i - 1], row_cuts[j - 1]};
        const glm::ivec2 last{column_cuts[i], row_cuts[j]};
        const Copy samples(first, last - first + 1,
                           [&](glm::ivec2 p) { return grid.height_m(p.x, p.y); });
        const int side = block_cells << level;
        const glm::ivec2 first_point = first / side * block_cells;
        const glm::ivec2 last_point = ((last - 1) / side + 1) * block_cells;
        const glm::ivec2 end{std::min(last_point.x, lattice.cells(level).x) + 1,
                             std::min(last_point.y, lattice.cells(level).y) + 1};
        const Copy points(first_point, end - first_point, [&](glm::ivec2 p) {
          const glm::ivec2 at = lattice.sample(level, p);
          return grid.height_m(at.x, at.y);
        });
        accumulate_deviations(lattice, level, samples.window, points.window, {0, 0}, levels.back());
      }
    }
    if (level > 0) {
      saturate_keys(levels.back(), {0, 0}, levels[std::size_t(level - 1)], {0, 0});
    }
  }
  return levels;
}

TEST(Deviation, CertificateDoesNotDependOnTheTiling) {
  for (const double hole_share : {0.0, 0.001}) {
    const HeightGrid grid = noise({603, 517}, Seed{6}, hole_share);
    for (const int block_cells : {2, 8}) {
      const auto whole = certify(grid, block_cells, NodeDetail::Full);
      expect_same(whole, certify_in_pieces(grid, block_cells, {0, 602}, {0, 516}));
      expect_same(whole, certify_in_pieces(grid, block_cells, {0, 1, 37, 256, 411, 602},
                                           {0, 13, 14, 300, 516}));
    }
  }
}

// A node of 2 x 2 cells with sides of 256 samples. The corners of its south-eastern cell are at 0 m
// along the main diagonal and at -128 m along the other. Heights are half way between the two ways
// of splitting the cell, at most 64 m from either, except that the two samples on both sides of the
// main diagonal just before its middle are 1/16 m lower. The diagonal is a ridge at 0 m that
// crosses the edge between these two samples.
TEST(Deviation, IncludesACrossingInTheMiddleOfALargeNode) {
  const auto height_m = [](int c, int r) -> double {
    const double x = (c - 256) / 256.0;
    const double y = (r - 256) / 256.0;
    const double anti = -128 * (x + y < 1 ? x + y : 2 - x - y);
    if (c < 256 && r < 256) return 0;
    if (c < 256 || r < 256) return -256 * std::max(x, y) * (1 - (r < 256 ? r : c) / 512.0);
    const double main = -128 * std::abs(x - y);
    const bool is_lower = (c == 384 && r == 383) || (c == 383 && r == 384);
    return c > 512 || r > 512 ? 0 : (anti + main) / 2 - (is_lower ? 0.0625 : 0);
  };
  std::vector<float> heights;
  for (int r = 0; r < 530; ++r) {
    for (int c = 0; c < 530; ++c) heights.push_back(static_cast<float>(height_m(c, r)));
  }
  const HeightGrid grid({530, 530}, {0, 0}, {1, 1}, heights);
  const NodeLevel level = certify(grid, 2, NodeDetail::Full)[8];
  EXPECT_EQ(level.full_m[0], 64);
  EXPECT_EQ(level.deviation_m[0], 64.0625F);
}

// Compares only the crossings of a diagonal with rows, columns and diagonals of samples.
TEST(Deviation, CrossingsOfADiagonalDoNotDependOnTheTiling) {
  for (std::uint32_t trial = 0; trial < 400; ++trial) {
    const glm::ivec2 size = 1 + glm::ivec2(random_uniform({Seed{11}, trial}) * 70.0);
    const int w = size.x;
    const int h = size.y;
    const HeightGrid grid = noise(size + 2, Seed{trial});
    const passes::CellShape shape{w,
                                  h,
                                  false,
                                  1.0 / w,
                                  1.0 / h,
                                  1.0 / (double(w) * h),
                                  1.0 / (w + h),
                                  w == h ? 0 : 1.0 / std::abs(w - h)};
    const auto crossings = [&](glm::ivec2 first, glm::ivec2 last, const passes::Band& band,
                               bool is_anti) {
      const HeightWindow all{{0, 0}, size + 2, grid.heights_m().data(), size.x + 2};
      const HeightWindow part{first, last - first + 1, all.at(first.x, first.y), size.x + 2};
      return passes::HalfCell{part, shape, {1, 1}, band}.along_diagonal(is_anti, {{3, 50, -20, 7}});
    };
    const int cut = 1 + static_cast<int>(uniform(Seed{12}, trial) * w);
    for (const bool is_anti : {false, true}) {
      const double whole = crossings({0, 0}, size + 1, {1, h + 2, h + 1}, is_anti);
      double in_parts = 0;
      for (int row = 1; row < h + 2; row += 1 + h / 16) {
        const int end = std::min(row + 1 + h / 16, h + 2);
        const passes::Band band{row, end, std::min(end, h + 1)};
        in_parts = std::max({in_parts, crossings({1, 1}, {cut, h + 1}, band, is_anti),
                             crossings({cut, 1}, {w + 1, h + 1}, band, is_anti)});
      }
      EXPECT_EQ(in_parts, whole) << w << " x " << h << " cut at " << cut;
    }
  }
}

TEST(Deviation, TilingAtNodeBoundariesKeepsEveryBit) {
  std::vector<float> heights(std::size_t{300} * 290);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const double u = uniform(Seed{7}, i);
    heights[i] = static_cast<float>(1000 * u * std::exp2(-60 * uniform(Seed{8}, i)));
  }
  const HeightGrid grid({300, 290}, {0, 0}, {1, -1}, heights);
  expect_same(certify(grid, 2, NodeDetail::Full),
              certify_in_pieces(grid, 2, {0, 64, 256, 299}, {0, 128, 192, 289}));
}

TEST(Deviation, DoesNotDependOnExecutionOrderOrThreads) {
  const HeightGrid grid = noise({555, 403}, Seed{9}, 0.0005);
  for (const int block_cells : {2, 8}) {
    const auto expected = certify(grid, block_cells, NodeDetail::Full);
    for (const std::uint64_t seed : {1, 2, 3}) {
      expect_same(expected, certify(grid, block_cells, NodeDetail::Full,
                                    groundray::testing::shuffled_runner(Seed{seed})));
    }
    for (const int threads : {1, 2, 5}) {
      expect_same(expected, certify(grid, block_cells, NodeDetail::Full,
                                    groundray::testing::threaded_runner(threads)));
    }
  }
}

TEST(Deviation, RejectsOddBlocks) {
  const HeightGrid grid = noise({5, 5}, Seed{1});
  for (const int block_cells : {-2, 0, 1, 7}) {
    try {
      certify(grid, block_cells, NodeDetail::Full);
      ADD_FAILURE() << block_cells;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(),
                  HasSubstr(fmt::format("block_cells = {} must be even", block_cells)));
    }
  }
}

}  // namespace
}  // namespace groundray::deviation_test
