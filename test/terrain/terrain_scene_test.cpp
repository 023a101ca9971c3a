#include "terrain/terrain_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>

#include "test/support/margin.h"
#include "test/support/terrain/leaf_triangles.h"
#include "test/support/terrain/sample_clipmap.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::terrain_scene_test {
namespace {

using testing::certified_tiles;
using testing::fractal;
using testing::proof_size;
using testing::random_rays;
using testing::sensor_at;
using testing::with_holes;
using testing::with_missing_samples;

constexpr Tracing modes[] = {Tracing::Fast, Tracing::Exact};

ClipmapSettings capped(double tolerance_m, double angle_rad, int cells, int levels) {
  return {.tolerance_m = tolerance_m,
          .angle_rad = angle_rad,
          .memory_bytes = 40 * static_cast<std::size_t>((cells + 32) * (cells + 32) * levels)};
}

std::vector<Hit> trace(const RayTracer& tracer, const std::vector<Ray>& rays) {
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits);
  return hits;
}

RayTracer whole(const HeightGrid& grid, Tracing tracing) {
  return {{full_resolution_level(grid)}, {0, 0, 0}, tracing};
}

// Position of a sensor 10 m above the ground.
glm::dvec3 above(const HeightGrid& grid, glm::dvec2 p) {
  return {p, grid.height_m_at(p).value_or(grid.max_height_m()) + 10};
}

std::vector<Ray> rays_from(const glm::dvec3& p, std::size_t count, Seed seed) {
  std::vector<Ray> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto turn = random_uniform({seed, 0, 0, static_cast<std::uint32_t>(i)});
    const auto more = random_uniform({seed, 1, 0, static_cast<std::uint32_t>(i)});
    // Neighbouring rays are similar, as in a sensor; half of them point close to the horizon.
    const std::size_t fan = i / 16;
    const double azimuth =
        6.2831853 * (16 * static_cast<double>(fan) / static_cast<double>(count) + 0.001 * turn.x);
    const double steepness = i % 32 < 16 ? 0.3 * turn.y * turn.y - 0.03 : 2 * turn.y;
    rays[i].origin = p + glm::dvec3(more - 0.5, 0.3 * turn.x);
    rays[i].direction =
        glm::normalize(glm::dvec3(std::cos(azimuth), std::sin(azimuth), -steepness));
  }
  return rays;
}

// Landscape that contains planes: parts that are flat, and parts of constant slope.
HeightGrid partly_plane(int samples) {
  const HeightGrid rough = fractal(samples, 5, 400, Seed{51});
  std::vector<float> heights(rough.heights_m().begin(), rough.heights_m().end());
  for (int row = 0; row < samples; ++row) {
    for (int column = 0; column < samples; ++column) {
      float& height = heights[static_cast<std::size_t>(row) * static_cast<std::size_t>(samples) +
                              static_cast<std::size_t>(column)];
      if (column < samples / 3) height = 64;
      if (row < samples / 3) height = 64.0f + 0.5f * static_cast<float>(column);
    }
  }
  return {{samples, samples}, rough.origin_m(), rough.step_m(), heights};
}

TEST(TerrainSceneProof, WithoutToleranceRangesEqualTheFullResolutionBitForBit) {
  const HeightGrid grid = with_holes(partly_plane(513), 60, 5, Seed{52});
  const Clipmap clipmap(certified_tiles(grid), grid.frame(), {}, sensor_at({0, 0, 300}));
  bool merged = false;
  for (const Leaf& leaf : clipmap.levels()[0].leaves) merged |= leaf.step > 1;
  EXPECT_TRUE(merged) << "planes should be made of larger cells";
  const auto rays = random_rays(grid, proof_size(200'000, 10'000'000), Seed{53});
  for (const Tracing tracing : modes) {
    const auto expected = trace(whole(grid, tracing), rays);
    const auto hits = trace(build_tracer(clipmap, {0, 0, 0}, tracing), rays);
    std::size_t different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i)
      different += hits[i].range_m != expected[i].range_m ? 1 : 0;
    // In fast tracing Embree selects the hit: different bounding boxes round the same facets may
    // change its selection at silhouettes.
    const double allowed = tracing == Tracing::Exact ? 0 : 5e-6 * static_cast<double>(rays.size());
    EXPECT_LE(static_cast<double>(different), allowed);
    testing::record_margin(
        tracing == Tracing::Exact ? "different in `exact`" : "different in `fast`",
        static_cast<double>(different), allowed, "rays");
    std::cout << fmt::format("{}: {} of {} ranges differ\n",
                             tracing == Tracing::Fast ? "fast" : "exact", different, rays.size());
  }
}

struct Case {
  HeightGrid grid;
  ClipmapSettings settings;
};

std::vector<Case> small_cases() {
  const HeightGrid round = fractal(129, 5, 120, Seed{54});
  std::vector<float> part;
  for (int row = 0; row < 101; ++row) {
    for (int column = 0; column < 122; ++column) part.push_back(round.height_m(column, row));
  }
  const HeightGrid odd({122, 101}, {-300, 250}, {5, -5}, part);
  return {{round, capped(0.5, 5e-3, 64, 3)},
          {odd, capped(0.2, 2e-2, 64, 2)},
          {with_holes(odd, 10, 3, Seed{55}), capped(1, 3e-2, 64, 2)},
          {odd, {.tolerance_m = 3}}};
}

// Tests every ray against every triangle; the triangles follow from the definition of the leaves
// alone.
TEST(TerrainSceneProof, RaysHitTheSurfaceDefinedByTheLeavesAcrossSeams) {
  for (const auto& [grid, settings] : small_cases()) {
    const glm::dvec3 sensor = above(grid, {20, 30});
    const Clipmap clipmap(certified_tiles(grid), grid.frame(), settings, sensor_at(sensor));
    std::vector<testing::SampleTriangle> triangles;
    for (const Level& level : clipmap.levels()) {
      const auto some = testing::leaf_triangles(grid, level.leaves, 8);
      triangles.insert(triangles.end(), some.begin(), some.end());
    }
    auto rays = rays_from(sensor, proof_size(1'000, 50'000), Seed{56});
    const auto others = random_rays(grid, proof_size(1'000, 50'000), Seed{57});
    rays.insert(rays.end(), others.begin(), others.end());  // also from outside the finest window
    for (const Tracing tracing : modes) {
      const auto hits = trace(build_tracer(clipmap, {0, 0, 0}, tracing), rays);
      std::size_t different = 0, met = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const auto expected = testing::trace_triangles(grid, triangles, rays[i]);
        met += expected ? 1 : 0;
        const bool same =
            expected.has_value() == static_cast<bool>(hits[i]) &&
            (!expected || std::abs(*expected - hits[i].range_m) <= 1e-9 * *expected + 1e-9);
        different += same ? 0 : 1;
        if (tracing == Tracing::Exact) {
          ASSERT_TRUE(same) << "ray " << i
                            << fmt::format(": {:.12g} against {:.12g}", expected.value_or(-1),
                                           hits[i].range_m);
        }
      }
      EXPECT_LE(different, rays.size() / 100'000 + 1);
      EXPECT_GT(met, rays.size() / 3);
    }
  }
}

// The oracle is Batch::Alike, which the test above compares with the leaves.
TEST(TerrainScene, RaysFromTheSurfaceHitTheSameInEveryKindOfBatch) {
  for (const auto& [grid, settings] : small_cases()) {
    const glm::dvec3 sensor = above(grid, {20, 30});
    const Clipmap clipmap(certified_tiles(grid), grid.frame(), settings, sensor_at(sensor));
    auto rays = rays_from(sensor, 2'000, Seed{58});
    const auto others = random_rays(grid, 2'000, Seed{59});
    rays.insert(rays.end(), others.begin(), others.end());
    for (const Tracing tracing : modes) {
      const RayTracer surface = build_tracer(clipmap, {0, 0, 0}, tracing);
      const auto hits = trace(surface, rays);
      std::vector<Ray> leaving;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!hits[i]) continue;
        const glm::dvec3 normal(hits[i].normal);
        const glm::dvec3 mirrored = glm::reflect(rays[(i * 7) % rays.size()].direction, normal);
        const double side = glm::dot(mirrored, normal) < 0 ? -1 : 1;
        leaving.push_back({rays[i].origin + hits[i].range_m * rays[i].direction + 1e-6 * normal,
                           side * mirrored});
      }
      const auto expected = trace(surface, leaving);
      for (const Batch batch : {Batch::ShadowRays, Batch::Scattered}) {
        std::vector<Hit> met(leaving.size());
        surface.trace(leaving, met, batch);
        std::size_t different = 0;
        for (std::size_t i = 0; i < leaving.size(); ++i)
          different += met[i].range_m != expected[i].range_m || met[i].part != expected[i].part;
        EXPECT_LE(different, tracing == Tracing::Exact ? 0u : leaving.size() / 100'000 + 1);
      }
    }
  }
}

// Points at samples, on edges and within triangles of the mesh; many on seams between levels.
std::vector<glm::dvec3> targets_on(const HeightGrid& grid,
                                   const std::vector<testing::SampleTriangle>& triangles,
                                   std::size_t count, Seed seed) {
  std::vector<glm::dvec3> targets(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto bits = random_bits({seed, 0, 0, static_cast<std::uint32_t>(i)});
    const auto& triangle = triangles[bits[0] % triangles.size()];
    const auto corner = [&](std::size_t k) {
      const glm::ivec2 p = triangle[k % 3];
      return glm::dvec3(grid.frame().to_D(p), grid.height_m(p.x, p.y));
    };
    const double share = i % 2 == 0 ? 0 : bits[1] * 0x1p-32;
    targets[i] = glm::mix(corner(bits[2] % 3), corner(bits[2] % 3 + 1), share);
  }
  return targets;
}

TEST(TerrainSceneProof, RaysFromAboveDoNotLeakAtVerticesAndEdgesOfAnyLevel) {
  const HeightGrid grid = fractal(513, 5, 400, Seed{58});
  const glm::dvec3 sensor = above(grid, {15, -25});
  const Clipmap clipmap(certified_tiles(grid), grid.frame(), capped(0.05, 2e-3, 96, 4),
                        sensor_at(sensor));
  ASSERT_GE(clipmap.levels().size(), 3u);
  std::vector<testing::SampleTriangle> triangles;
  for (const Level& level : clipmap.levels()) {
    const auto some = testing::leaf_triangles(grid, level.leaves, 8);
    triangles.insert(triangles.end(), some.begin(), some.end());
  }
  const auto targets = targets_on(grid, triangles, proof_size(200'000, 10'000'000), Seed{59});
  // From high above every line of sight is free: each ray must end at its target.
  std::vector<Ray> rays(targets.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto turn = random_uniform({Seed{60}, 0, 0, static_cast<std::uint32_t>(i)});
    rays[i].origin = {sensor.x + 30 * turn.x, sensor.y + 30 * turn.y, grid.max_height_m() + 20'000};
    rays[i].direction = glm::normalize(targets[i] - rays[i].origin);
  }
  for (const Tracing tracing : modes) {
    const auto hits = trace(build_tracer(clipmap, {0, 0, 0}, tracing), rays);
    std::size_t on_coarse = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      // At the boundary, rounding decides whether a ray passes the side of the DEM.
      const glm::dvec2 at = grid.frame().to_grid(glm::dvec2(targets[i]));
      if (at.x < 1e-6 || at.y < 1e-6 || at.x > 512 - 1e-6 || at.y > 512 - 1e-6) continue;
      ASSERT_NEAR(hits[i].range_m, glm::length(targets[i] - rays[i].origin), 1e-6)
          << "ray " << i << (tracing == Tracing::Fast ? " fast" : " exact");
      on_coarse += hits[i].part > 0 ? 1 : 0;
    }
    EXPECT_GT(on_coarse, rays.size() / 10);
  }
  // Rays from below hit nothing.
  std::vector<Ray> up(rays.size() / 10);
  for (std::size_t i = 0; i < up.size(); ++i) {
    up[i].origin = {glm::dvec2(targets[i]), grid.min_height_m() - 50};
    up[i].direction = {0, 0, 1};
  }
  for (const Tracing tracing : modes) {
    for (const Hit& hit : trace(build_tracer(clipmap, {0, 0, 0}, tracing), up)) ASSERT_FALSE(hit);
  }
}

// Vertical rays from above at leaves with thinned boundaries and holes: omitting points at the
// border of a window can also move the boundary of a hole.
std::vector<Ray> rays_at_thinned_borders(const HeightGrid& grid, const Clipmap& clipmap,
                                         Seed seed) {
  std::vector<Ray> rays;
  for (const Level& level : clipmap.levels()) {
    for (const Leaf& leaf : level.leaves) {
      if (leaf.coarser == 0 || !leaf.has_holes) continue;
      for (int i = 0; i < 64; ++i) {
        const auto share = random_uniform({seed, 0, 0, static_cast<std::uint32_t>(rays.size())});
        const glm::dvec2 sample = glm::dvec2(leaf.column, leaf.row) +
                                  static_cast<double>(level.leaf_cells * leaf.step) * share;
        const glm::dvec2 p = grid.origin_m() + grid.step_m() * sample;
        rays.push_back({glm::dvec3(p, grid.max_height_m() + 10), {0, 0, -1}});
      }
    }
  }
  return rays;
}

TEST(TerrainSceneProof, ErrorBoundHoldsForEveryRay) {
  const HeightGrid plain = fractal(513, 5, 400, Seed{61});
  const HeightGrid holed = with_holes(plain, 80, 5, Seed{62});
  const HeightGrid salted = with_missing_samples(plain, 0.1, Seed{68});
  for (const HeightGrid* const ground : {&plain, &holed, &salted}) {
    const HeightGrid& grid = *ground;
    const std::size_t holes = grid.hole_count();
    for (const ClipmapSettings& settings :
         {capped(0.05, 3e-3, 96, 4), ClipmapSettings{.tolerance_m = 3}, capped(0, 0, 96, 4)}) {
      const glm::dvec3 sensor = above(grid, {100, 50});
      const Clipmap clipmap(certified_tiles(grid), grid.frame(), settings, sensor_at(sensor));
      auto rays = rays_from(sensor, proof_size(100'000, 2'000'000), Seed{63});
      const auto others = random_rays(grid, proof_size(20'000, 400'000), Seed{64});
      rays.insert(rays.end(), others.begin(), others.end());
      const auto aimed = rays_at_thinned_borders(grid, clipmap, Seed{69});
      rays.insert(rays.end(), aimed.begin(), aimed.end());
      const auto truth = trace(whole(grid, Tracing::Exact), rays);
      for (const Tracing tracing : modes) {
        const RayTracer tracer = build_tracer(clipmap, {0, 0, 0}, tracing);
        const auto hits = trace(tracer, rays);
        std::vector<double> bounds_m(rays.size());
        tracer.bound_errors(rays, hits, bounds_m);
        std::size_t finite = 0, moved = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
          if (!hits[i] && !truth[i]) continue;
          const double error_m = hits[i] && truth[i] ? std::abs(hits[i].range_m - truth[i].range_m)
                                                     : std::numeric_limits<double>::infinity();
          ASSERT_LE(error_m, bounds_m[i]) << fmt::format(
              "ray {}: {} against {} with {} samples missing, {}", i, hits[i].range_m,
              truth[i].range_m, holes, tracing == Tracing::Fast ? "fast" : "exact");
          finite += std::isfinite(bounds_m[i]) ? 1 : 0;
          moved += error_m > 1e-6 ? 1 : 0;
        }
        EXPECT_GT(moved, rays.size() / 50) << "the surfaces should differ";
        std::cout << fmt::format(
            "{} samples missing, tolerance {} m, {} rad: {:.1f} % of bounds finite\n", holes,
            settings.tolerance_m, settings.angle_rad,
            100. * static_cast<double>(finite) / static_cast<double>(rays.size()));
        // With a tolerance, leaves bridge the samples that are missing everywhere in `salted`; no
        // finite bound holds there.
        if (ground != &salted || settings.angle_rad + settings.tolerance_m == 0) {
          EXPECT_GT(finite, rays.size() / 2);
          testing::record_margin("rays without a finite bound",
                                 1 - static_cast<double>(finite) / static_cast<double>(rays.size()),
                                 0.5);
        }
      }
    }
  }
}

TEST(TerrainScene, ErrorBoundIsTheRangesAccuracyAtFullResolution) {
  const HeightGrid grid = fractal(129, 5, 100, Seed{65});
  const RayTracer tracer = whole(grid, Tracing::Fast);
  const auto rays = random_rays(grid, 1000, Seed{66});
  const auto hits = trace(tracer, rays);
  std::vector<double> bounds_m(rays.size(), -1);
  tracer.bound_errors(rays, hits, bounds_m);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(bounds_m[i], hits[i] ? 1e-9 * hits[i].range_m + 1e-9 : 0);
    EXPECT_EQ(hits[i].deviation_m, 0);
  }
}

TEST(TerrainScene, UnchangedLevelsAreNotRebuilt) {
  const HeightGrid grid = fractal(1025, 5, 400, Seed{67});
  const Clipmap here(certified_tiles(grid), grid.frame(), capped(0.05, 3e-3, 128, 4),
                     sensor_at({30, 40, 500}));
  const RayTracer first = build_tracer(here, {0, 0, 0}, Tracing::Fast);
  const Clipmap there = here.moved_to(sensor_at({70, 40, 500}));
  const RayTracer second = build_tracer(there, {0, 0, 0}, Tracing::Fast, &first);
  std::size_t taken_over = 0;
  for (std::size_t i = 0; i < second.levels().size(); ++i)
    taken_over += &second.levels()[i].level() == &first.levels()[i].level() ? 1 : 0;
  EXPECT_GE(taken_over, 1u);
  EXPECT_LT(taken_over, second.levels().size());
  const auto rays = rays_from({70, 40, 500}, 20'000, Seed{68});
  const auto expected = trace(build_tracer(there, {0, 0, 0}, Tracing::Fast), rays);
  const auto hits = trace(second, rays);
  for (std::size_t i = 0; i < rays.size(); ++i)
    ASSERT_EQ(hits[i].range_m, expected[i].range_m) << i;
}

}  // namespace
}  // namespace groundray::terrain_scene_test
