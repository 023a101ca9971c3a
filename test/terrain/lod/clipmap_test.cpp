#include "terrain/lod/clipmap.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iostream>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "terrain/judge/mesh_deviation.h"
#include "terrain/judge/mesh_topology.h"
#include "test/support/terrain/leaf_triangles.h"
#include "test/support/terrain/sample_clipmap.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::clipmap_test {
namespace {

using testing::certified_tiles;
using testing::fractal;
using ::testing::HasSubstr;
using testing::proof_size;
using testing::sensor_at;
using ::testing::ThrowsMessage;
using testing::with_holes;
using testing::with_missing_samples;

// Settings whose memory holds windows of about `cells` x `cells` in each of `levels` levels.
ClipmapSettings capped(double angle_rad, int cells, int levels) {
  return {.tolerance_m = 0.01,
          .angle_rad = angle_rad,
          .memory_bytes = 40 * static_cast<std::size_t>((cells + 32) * (cells + 32) * levels)};
}

void expect_same(const Clipmap& a, const Clipmap& b) {
  ASSERT_EQ(a.levels().size(), b.levels().size());
  for (std::size_t i = 0; i < a.levels().size(); ++i) {
    const Level& p = a.levels()[i];
    const Level& q = b.levels()[i];
    ASSERT_EQ(p.first, q.first);
    ASSERT_EQ(p.step, q.step);
    ASSERT_EQ(p.heights.size(), q.heights.size());
    ASSERT_EQ(0, std::memcmp(p.heights.heights_m().data(), q.heights.heights_m().data(),
                             p.heights.heights_m().size_bytes()));
    ASSERT_EQ(p.leaves, q.leaves);
  }
}

std::vector<Leaf> all_leaves(const Clipmap& clipmap) {
  std::vector<Leaf> leaves;
  for (const Level& level : clipmap.levels())
    leaves.insert(leaves.end(), level.leaves.begin(), level.leaves.end());
  return leaves;
}

struct Mesh {
  std::vector<glm::ivec2> vertices;
  std::vector<glm::uvec3> triangles;
};

Mesh mesh_of(const HeightGrid& grid, const std::vector<Leaf>& leaves) {
  Mesh mesh;
  std::map<std::pair<int, int>, unsigned> known;
  for (const auto& triangle : testing::leaf_triangles(grid, leaves, 8)) {
    glm::uvec3 indices;
    for (int k = 0; k < 3; ++k) {
      const glm::ivec2 p = triangle[static_cast<std::size_t>(k)];
      const auto [entry, is_new] =
          known.try_emplace({p.x, p.y}, static_cast<unsigned>(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back(p);
      indices[k] = entry->second;
    }
    mesh.triangles.push_back(indices);
  }
  return mesh;
}

glm::dvec3 random_place(const HeightGrid& grid, Seed seed, std::uint32_t i) {
  const glm::dvec2 share = random_uniform({seed, 0, 0, i});
  const glm::dvec2 p =
      grid.origin_m() + share * glm::dvec2(grid.columns() - 1, grid.rows() - 1) * grid.step_m();
  return {p, grid.max_height_m() * 0.5 + 20};
}

// Random walk with uneven steps and occasional jumps.
std::vector<glm::dvec3> random_walk(const HeightGrid& grid, std::size_t steps, double stride_m,
                                    Seed seed) {
  std::vector<glm::dvec3> places{random_place(grid, seed, 0)};
  for (std::uint32_t i = 1; i < steps; ++i) {
    const glm::dvec2 share = random_uniform({seed, 1, 0, i});
    const double angle = 6.2831853 * share.x;
    const bool jumps = share.y < 0.03;
    places.push_back(jumps ? random_place(grid, seed, i)
                           : places.back() + glm::dvec3(std::cos(angle), std::sin(angle), 0) *
                                                 (stride_m * share.y));
  }
  return places;
}

TEST(ClipmapProof, MovedClipmapEqualsANewOneBitForBit) {
  const bool full = proof_size(0, 1) == 1;
  const HeightGrid grid =
      with_holes(fractal(full ? 4097 : 1025, 5, 900, Seed{31}), full ? 400 : 60, 6, Seed{32});
  const auto tiles = certified_tiles(grid);
  const auto settings = capped(1e-3, full ? 512 : 64, 5);
  const auto places = random_walk(grid, proof_size(600, 10'000), full ? 400 : 100, Seed{33});
  Clipmap clipmap(tiles, grid.frame(), settings, sensor_at(places.front()));
  ASSERT_GE(clipmap.levels().size(), 3u);
  // A construction from scratch costs much more than a step. The short walk compares every step,
  // the long one every twentieth; each state depends on all before it.
  const std::size_t every = full ? 20 : 1;
  std::size_t moves = 0;
  for (std::size_t i = 1; i < places.size(); ++i) {
    clipmap = clipmap.moved_to(sensor_at(places[i]));
    ++moves;
    if (i % every != 0) continue;
    expect_same(clipmap, Clipmap(tiles, grid.frame(), settings, sensor_at(places[i])));
    if (::testing::Test::HasFatalFailure()) FAIL() << "after " << i << " steps";
  }
  std::cout << fmt::format("{} steps, {} levels\n", moves, clipmap.levels().size());
}

// Bridged holes leave no boundaries to compare, but no two triangles of the surface may overlap
// along an edge.
bool uses_no_edge_twice_the_same_way(const Mesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      if (!edges.emplace(t[k], t[(k + 1) % 3]).second) return false;
    }
  }
  return true;
}

TEST(ClipmapProof, LeavesOfAllWindowsFormOneConformingSurface) {
  for (const int holes : {0, 1, 40}) {
    const HeightGrid plain = fractal(513, 5, 500, Seed{34});
    const HeightGrid whole = holes == 1 ? with_missing_samples(plain, 0.05, Seed{35})
                                        : with_holes(plain, holes, 5, Seed{35});
    // Grids whose sizes are not powers of two have narrower cells on two sides.
    std::vector<float> part;
    for (int row = 0; row < 401; ++row) {
      for (int column = 0; column < 470; ++column) part.push_back(whole.height_m(column, row));
    }
    const HeightGrid grid({470, 401}, {-900, 1000}, {5, -5}, part);
    const auto tiles = certified_tiles(grid);
    for (std::uint32_t i = 0; i < proof_size(12, 200); ++i) {
      const auto settings = capped(i % 3 == 0 ? 0.0 : 3e-3, i % 2 == 0 ? 64 : 160, 4);
      const Clipmap clipmap(tiles, grid.frame(), settings,
                            sensor_at(random_place(grid, Seed{36}, i)));
      const Mesh mesh = mesh_of(grid, all_leaves(clipmap));
      if (holes == 0) {
        ASSERT_THAT(judge::topology_faults(grid, mesh.vertices, mesh.triangles),
                    ::testing::IsEmpty());
      } else {
        EXPECT_TRUE(uses_no_edge_twice_the_same_way(mesh));
      }
      // Each level's reported deviation is a bound, whether or not memory limits its window.
      for (const Level& level : clipmap.levels()) {
        float most_m = 0;
        for (const Leaf& leaf : level.leaves) most_m = std::max(most_m, leaf.deviation_m);
        const Mesh own = mesh_of(grid, level.leaves);
        const auto found = judge::largest_deviation(grid, own.vertices, own.triangles);
        ASSERT_LE(found.largest_m, most_m) << "cells of " << level.step << " at " << i;
      }
    }
  }
}

TEST(Clipmap, AngularToleranceHoldsEverywhere) {
  const HeightGrid grid = fractal(513, 5, 500, Seed{37});
  const auto tiles = certified_tiles(grid);
  for (std::uint32_t i = 0; i < 8; ++i) {
    const glm::dvec3 p = random_place(grid, Seed{38}, i);
    const ClipmapSettings settings{.tolerance_m = 0.2, .angle_rad = i % 2 == 0 ? 2e-3 : 1e-2};
    const Clipmap clipmap(tiles, grid.frame(), settings, sensor_at(p));
    const Mesh mesh = mesh_of(grid, all_leaves(clipmap));
    const auto found =
        judge::largest_deviation(grid, mesh.vertices, mesh.triangles, [&](const glm::dvec3& at) {
          const glm::dvec3 q(grid.origin_m() + glm::dvec2(at) * grid.step_m(), at.z);
          // A leaf's bound applies at its nearest point; this point is at least as far away.
          return std::max(settings.tolerance_m, settings.angle_rad * glm::length(q - p));
        });
    EXPECT_LE(found.largest_excess_m, 1e-12) << i;
    EXPECT_THAT(judge::topology_faults(grid, mesh.vertices, mesh.triangles), ::testing::IsEmpty());
    EXPECT_LT(mesh.triangles.size(), 2u * 512 * 512);
  }
}

TEST(Clipmap, WithoutToleranceOrMemoryLimitIsTheFullResolutionDem) {
  const HeightGrid grid = fractal(129, 5, 200, Seed{39});
  const Clipmap clipmap(certified_tiles(grid), grid.frame(), {}, sensor_at({0, 0, 300}));
  ASSERT_EQ(clipmap.levels().size(), 1u);
  EXPECT_EQ(clipmap.levels()[0].leaves.size(), 256u);
  for (const Leaf& leaf : clipmap.levels()[0].leaves) EXPECT_EQ(leaf.step, 1);
}

TEST(Clipmap, FailedTileReadLeavesTheClipmapUnchanged) {
  const HeightGrid grid = fractal(1025, 5, 500, Seed{40});
  const auto tiles = std::make_shared<testing::FailingTiles>(certified_tiles(grid));
  const auto settings = capped(1e-3, 128, 4);
  const auto places = random_walk(grid, 60, 300, Seed{41});
  Clipmap clipmap(tiles, grid.frame(), settings, sensor_at(places.front()));
  std::size_t failures = 0;
  for (std::size_t i = 1; i < places.size(); ++i) {
    tiles->asked = 0;
    tiles->fails_at = 1;
    try {
      clipmap = clipmap.moved_to(sensor_at(places[i]));
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("cannot be read"));
      ++failures;
    }
    tiles->fails_at.reset();
    clipmap = clipmap.moved_to(sensor_at(places[i]));
    expect_same(clipmap, Clipmap(tiles, grid.frame(), settings, sensor_at(places[i])));
    if (::testing::Test::HasFatalFailure()) FAIL() << "at step " << i;
  }
  EXPECT_GT(failures, 5u);
}

TEST(Clipmap, ReadsOnlyTilesThatEnterAWindow) {
  const HeightGrid grid = fractal(1025, 5, 500, Seed{42});
  const auto tiles = std::make_shared<testing::FailingTiles>(certified_tiles(grid));
  const auto settings = capped(1e-3, 256, 3);
  const Clipmap clipmap(tiles, grid.frame(), settings, sensor_at({0, 0, 300}));
  const std::size_t whole = tiles->asked;
  tiles->asked = 0;
  const Clipmap same = clipmap.moved_to(sensor_at({1, 1, 300}));
  EXPECT_EQ(tiles->asked, 0u);
  const Clipmap moved = clipmap.moved_to(sensor_at({5 * 64, 0, 300}));
  EXPECT_GT(tiles->asked, 0u);
  EXPECT_LT(tiles->asked, whole / 2);
  EXPECT_EQ(same.levels()[0].heights.heights_m().data(),
            clipmap.levels()[0].heights.heights_m().data());
}

TEST(Clipmap, RejectsInvalidSettings) {
  const HeightGrid grid = fractal(1025, 5, 500, Seed{43});
  const auto tiles = certified_tiles(grid);
  const auto make = [&](const ClipmapSettings& settings) {
    Clipmap(tiles, grid.frame(), settings, sensor_at({0, 0, 0}));
  };
  EXPECT_THAT([&] { make({.tolerance_m = -1}); },
              ThrowsMessage<Error>(HasSubstr("tolerance = -1 m must be finite")));
  EXPECT_THAT([&] { make({.angle_rad = std::nan("")}); },
              ThrowsMessage<Error>(HasSubstr("angular tolerance = nan rad")));
  EXPECT_THAT([&] { make({.memory_bytes = 1000}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("too few"), HasSubstr("allow more memory"))));
}

}  // namespace
}  // namespace groundray::clipmap_test
