#include "terrain/relief/relief.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iostream>
#include <map>
#include <span>

#include "terrain/judge/mesh_deviation.h"
#include "terrain/judge/mesh_topology.h"
#include "terrain/relief/refined_tiles.h"
#include "terrain/terrain.h"
#include "terrain/terrain_scene.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"
#include "test/support/terrain/leaf_triangles.h"
#include "test/support/terrain/reference_tracer.h"
#include "test/support/terrain/sample_clipmap.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::relief_test {
namespace {

using testing::certified_tiles;
using testing::fractal;
using ::testing::HasSubstr;
using testing::proof_size;
using testing::random_rays;
using testing::sensor_at;
using ::testing::ThrowsMessage;
using testing::with_holes;

constexpr std::size_t plenty = std::size_t{1} << 30;

// Rough ground with ruts.
ReliefSpec rough(double cell_m, double period_m, double rms_m) {
  ImageF ruts(7, 5, 1);
  for (int x = 0; x < 7; ++x) {
    for (int y = 0; y < 5; ++y)
      ruts.at(x, y)[0] = x < 2 ? 0.0f : 0.5f + 0.07f * static_cast<float>(y);
  }
  return {.cell_m = cell_m,
          .period_m = period_m,
          .image = ImageRelief{.image = ruts, .amplitude_m = rms_m, .size_m = period_m / 3},
          .fractal = FractalSpec{.rms_m = rms_m,
                                 .hurst = 0.7,
                                 .shortest_m = 2 * cell_m,
                                 .longest_m = period_m / 2,
                                 .seed = Seed{71}}};
}

// Part of a fractal landscape, so that no side is a power of two.
HeightGrid landscape(glm::ivec2 samples, glm::dvec2 step_m, double relief_m) {
  const HeightGrid whole = fractal(129, 5, relief_m, Seed{72});
  std::vector<float> heights_m;
  for (int row = 0; row < samples.y; ++row) {
    for (int column = 0; column < samples.x; ++column)
      heights_m.push_back(whole.height_m(column, row) + 300);
  }
  return {samples, {-37, 41}, step_m, heights_m};
}

struct Refined {
  HeightGrid dem;
  std::shared_ptr<const Relief> relief;
  HeightGrid grid;  // the whole displaced surface
  std::shared_ptr<const TileSource> tiles;
};

Trail::GroundHeight heights_of(const HeightGrid& dem) {
  return [&dem](glm::dvec2 p) { return dem.height_m_at(p); };
}

Refined refine(const HeightGrid& dem, const ReliefSpec& spec) {
  auto relief = Relief(spec, dem.frame(), plenty).with_trails(spec.trails, heights_of(dem), {0, 0});
  const HeightGrid grid = relief->refined(dem);
  return {dem, relief, grid, std::make_shared<RefinedTiles>(certified_tiles(dem), relief)};
}

// The cases: periods shorter and longer than a node below the DEM's cells, cells that are not
// square, holes, no refinement, and more than one tile of the DEM.
std::vector<Refined> examples() {
  const HeightGrid dem = landscape({75, 67}, {4, -4}, 60);
  return {refine(dem, rough(0.6, 30, 0.05)),
          refine(with_holes(landscape({37, 18}, {5, -3}, 60), 4, 3, Seed{73}), rough(0.2, 9, 0.1)),
          refine(with_holes(dem, 20, 3, Seed{74}), rough(1, 200, 0.2)),
          refine(landscape({70, 41}, {2, 2}, 20), rough(2.5, 100, 0.2))};
}

// Adds a trail with everything that it can have, and another one that crosses it.
ReliefSpec with_trails(ReliefSpec spec, double cell_m, const std::vector<glm::dvec2>& waypoints_m) {
  TrailSpec trail{.name = "track",
                  .waypoints_m = waypoints_m,
                  .width_m = 12 * cell_m,
                  .level_over_m = 8,
                  .bank_slope = 1.5,
                  .most_bank_m = 25,
                  .most_grade = 5,
                  .crown_m = 0.1,
                  .relief_share = 0.4,
                  .variation = 0.5};
  trail.ruts = {.track_m = 5 * cell_m, .width_m = 2 * cell_m};
  trail.washboard = {.wavelength_m = 4 * cell_m};
  trail.potholes = {.per_100_m = 20, .diameter_m = {3 * cell_m, 6 * cell_m}};
  trail.ditches = {.width_m = 4 * cell_m, .depth_m = 0.5};
  trail.roots = {.per_100_m = 40, .width_m = 2 * cell_m, .height_m = 0.1};
  TrailSpec creek = trail;
  creek.name = "creek";
  creek.raised_m = -1.5;
  creek.benches = {.height_m = 2 * cell_m, .width_m = 3 * cell_m, .roughness_m = cell_m};
  for (glm::dvec2& p_m : creek.waypoints_m)  // mirrored, so that it crosses the track
    p_m.y = waypoints_m.front().y + waypoints_m.back().y - p_m.y;
  spec.trails = {trail, creek};
  return spec;
}

std::vector<Refined> examples_with_trails() {
  std::vector<Refined> all = examples();
  const std::vector<glm::dvec2> waypoints_m{{-30, 30}, {-10, 5}, {10, 15}, {38, -30}};
  all.push_back(refine(landscape({75, 67}, {4, -4}, 60),
                       with_trails(rough(0.6, 30, 0.05), 0.6, waypoints_m)));
  all.push_back(refine(with_holes(landscape({75, 67}, {4, -4}, 60), 20, 3, Seed{74}),
                       with_trails(rough(0.3, 30, 0.05), 0.3, {{-30, 30}, {-25, 20}, {-15, 18}})));
  all.push_back(refine(landscape({70, 41}, {2, 2}, 20),
                       with_trails({.cell_m = 2.5}, 2, {{-36, 42}, {20, 60}, {60, 110}})));
  return all;
}

TEST(Relief, FineSamplesAreTheDemsSurfacePlusTheDisplacement) {
  for (const Refined& of : examples()) {
    const GridFrame& frame = of.relief->frame();
    EXPECT_LE(std::max(std::abs(frame.step_m.x), std::abs(frame.step_m.y)), 2.5);
    EXPECT_EQ(frame.samples,
              (glm::ivec2(of.dem.columns(), of.dem.rows()) - 1) * (1 << of.relief->exponent()) + 1);
    const glm::ivec2 period = of.relief->period();
    for (int row = 0; row < of.grid.rows(); ++row) {
      for (int column = 0; column < of.grid.columns(); ++column) {
        const glm::dvec2 p = frame.to_D({column, row});
        const double dem_m = testing::reference_height_m(of.dem, p.x, p.y);
        if (std::isnan(dem_m)) continue;  // on the boundary of a hole, either is valid
        const double d_m = of.relief->displacement()(column % period.x, row % period.y);
        // One rounding to float, and that of the position to double, on slopes below 10^3.
        ASSERT_NEAR(of.grid.height_m(column, row), dem_m + d_m, 0x1p-24 * (dem_m + 1) + 1e-10);
      }
    }
  }
}

// Each triangle is identified by its centroid, which lies inside one facet of the DEM.
TEST(Relief, FineTriangleExistsIffTheDemsFacetAroundItExists) {
  std::size_t missing = 0;
  for (const Refined& of : examples()) {
    const int side = 1 << of.relief->exponent();
    for (int row = 0; row + 1 < of.grid.rows(); ++row) {
      for (int column = 0; column + 1 < of.grid.columns(); ++column) {
        const Cell fine = of.grid.cell(column, row);
        const Cell dem = of.dem.cell(column / side, row / side);
        for (const double share : {1.0 / 3, 2.0 / 3}) {
          const double u = column + share, v = row + share;
          const bool expected = !std::isnan(dem.plane(dem.half_at(u / side, v / side)).height_m);
          ASSERT_EQ(!std::isnan(fine.plane(fine.half_at(u, v)).height_m), expected);
          missing += expected ? 0 : 1;
        }
      }
    }
  }
  EXPECT_GT(missing, 1000u);
}

// Checks that a node's upper bounds are not below those of `exact`.
void expect_bound(const Tile& bound, const Tile& exact, std::size_t node, float max_key_m) {
  EXPECT_EQ(bound.key_m[node] < 0, exact.key_m[node] < 0);
  EXPECT_EQ(std::isinf(bound.key_m[node]), std::isinf(exact.key_m[node]));
  if (exact.key_m[node] < 0) return;
  EXPECT_GE(bound.key_m[node], exact.key_m[node]);
  if (!std::isinf(bound.key_m[node])) {
    EXPECT_LE(bound.key_m[node], max_key_m);
  }
  EXPECT_GE(bound.deviation_m[node], exact.deviation_m[node]);
  EXPECT_GE(bound.full_m[node], exact.full_m[node]);
  EXPECT_LE(bound.low_m[node], exact.low_m[node]);
  EXPECT_GE(bound.high_m[node], exact.high_m[node]);
}

// Returns true if the displacement's deviation is known exactly for the node and the node needs all
// of its templates: it has neighbours on every side.
bool is_as_displacement(const Refined& of, int level, glm::ivec2 node) {
  const glm::ivec2 period = of.relief->period(), count = of.tiles->lattice().nodes(level);
  return level < of.relief->exponent() && (8 << level) <= std::min(period.x, period.y) &&
         node.x > 0 && node.y > 0 && node.x + 1 < count.x && node.y + 1 < count.y;
}

// The oracle is the certificate of the whole displaced surface.
TEST(RefinedTiles, MatchTheDisplacedSurfaceWithUpperBoundsOfDeviations) {
  for (const Refined& of : examples_with_trails()) {
    const auto exact = certified_tiles(of.grid);
    ASSERT_EQ(of.tiles->lattice(), exact->lattice());
    double most_rounding = 0;
    for (int level = 0; level <= exact->lattice().top_level(); ++level) {
      EXPECT_GE(of.tiles->max_key_m(level), exact->max_key_m(level));
      const glm::ivec2 count = tile_count(exact->lattice(), level);
      for (int i = 0; i < count.x * count.y; ++i) {
        const TileName name{level, {i % count.x, i / count.x}};
        const auto a = of.tiles->tile(name), b = exact->tile(name);
        // Bitwise comparison, since holes are NaN.
        ASSERT_TRUE(std::ranges::equal(std::as_bytes(std::span(a->heights_m)),
                                       std::as_bytes(std::span(b->heights_m))));
        for (int n = 0; n < Tile::nodes * Tile::nodes; ++n) {
          const auto at = static_cast<std::size_t>(n);
          expect_bound(*a, *b, at, of.tiles->max_key_m(level));
          const glm::ivec2 node = name.which * Tile::nodes + glm::ivec2(n % 8, n / 8);
          if (b->key_m[at] < 0 || std::isinf(b->key_m[at]) || !is_as_displacement(of, level, node))
            continue;
          // The exact value differs from the displacement's own by one rounding, and so does the
          // bound.
          const double allowed_m = 2 * Relief::rounding_m(a->low_m[at], a->high_m[at]);
          const double over_m = a->deviation_m[at] - b->deviation_m[at];
          ASSERT_LE(over_m, allowed_m);
          most_rounding = std::max(most_rounding, over_m / allowed_m);
        }
        ASSERT_FALSE(::testing::Test::HasFailure()) << "level " << level << ", tile " << i;
        if (level > 0) continue;
        for (const float full_m : a->full_m) ASSERT_EQ(full_m, 0);
      }
    }
    std::cout << fmt::format("{} x {} cells, {} halvings: {:.2f} of the rounding allowed\n",
                             of.grid.columns() - 1, of.grid.rows() - 1, of.relief->exponent(),
                             most_rounding);
  }
}

TEST(RefinedTiles, ReportsATileOutsideItsLevel) {
  const Refined of = refine(landscape({33, 29}, {5, -5}, 60), rough(0.5, 20, 0.1));
  EXPECT_THAT(
      [&] {
        of.tiles->tile({0, {8, 0}});
      },
      ThrowsMessage<Error>(HasSubstr("tile (8, 0) of level 0")));
  EXPECT_THAT(
      [&] {
        of.tiles->tile({12, {0, 0}});
      },
      ThrowsMessage<Error>(HasSubstr("of level 12")));
}

struct Mesh {
  std::vector<glm::ivec2> vertices;
  std::vector<glm::uvec3> triangles;
};

Mesh mesh_of(const HeightGrid& grid, const Clipmap& clipmap) {
  std::vector<Leaf> leaves;
  for (const Level& level : clipmap.levels())
    leaves.insert(leaves.end(), level.leaves.begin(), level.leaves.end());
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

TEST(ReliefProof, LeavesOfAllLevelsFormOneSurfaceWithinTheirBound) {
  const HeightGrid dem = landscape({75, 67}, {6, -6}, 8);
  const ReliefSpec plain = rough(0.8, 24, 0.03);
  const Refined both[] = {
      refine(dem, plain),
      refine(dem, with_trails(plain, 0.75, {{0, 0}, {90, -70}, {200, -90}, {390, -330}}))};
  for (std::uint32_t i = 0; i < proof_size(4, 60); ++i) {
    const Refined& of = both[i / 2 % 2];
    ASSERT_EQ(of.relief->exponent(), 3);
    const glm::dvec2 share = random_uniform({Seed{75}, 0, 0, i});
    const glm::dvec2 at = of.dem.frame().to_D({0, 0}) + share * glm::dvec2(440, -390);
    const glm::dvec3 p(at, of.dem.height_m_at(at).value_or(300) + 3);
    const ClipmapSettings settings{.tolerance_m = 0.01, .angle_rad = i % 2 == 0 ? 1e-2 : 5e-2};
    const Clipmap clipmap(of.tiles, of.relief->frame(), settings, sensor_at(p));
    EXPECT_EQ(clipmap.levels().front().step, 1);
    int largest_step = 0;
    for (const Level& level : clipmap.levels()) {
      for (const Leaf& leaf : level.leaves) largest_step = std::max(largest_step, leaf.step);
    }
    EXPECT_GT(largest_step, 1 << of.relief->exponent());
    const Mesh mesh = mesh_of(of.grid, clipmap);
    EXPECT_THAT(judge::topology_faults(of.grid, mesh.vertices, mesh.triangles),
                ::testing::IsEmpty());
    const auto found = judge::largest_deviation(
        of.grid, mesh.vertices, mesh.triangles, [&](const glm::dvec3& point) {
          const glm::dvec3 q(of.grid.origin_m() + glm::dvec2(point) * of.grid.step_m(), point.z);
          // A leaf's bound applies at its nearest point; this point is at least as far away.
          return std::max(settings.tolerance_m, settings.angle_rad * glm::length(q - p));
        });
    EXPECT_LE(found.largest_excess_m, 0);
    EXPECT_GT(found.largest_m, settings.tolerance_m);
    std::cout << fmt::format("{} triangles of {}, up to {:.3f} m off, {:.4f} m within the bound\n",
                             mesh.triangles.size(), 2 * 592 * 528, found.largest_m,
                             -found.largest_excess_m);
  }
}

std::vector<Hit> trace(const RayTracer& tracer, const std::vector<Ray>& rays) {
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits);
  return hits;
}

TEST(ReliefProof, RangesMatchTheReferenceOnTheDisplacedSurface) {
  for (const Refined& of : examples_with_trails()) {
    const glm::dvec2 middle = of.grid.frame().to_D({of.grid.columns() / 2, of.grid.rows() / 2});
    const glm::dvec3 sensor(middle, of.grid.max_height_m() + 2);
    const Clipmap clipmap(of.tiles, of.relief->frame(), {}, sensor_at(sensor));
    const auto rays = random_rays(of.grid, proof_size(1'500, 300'000), Seed{76});
    const auto hits = trace(build_tracer(clipmap, {0, 0, 0}, Tracing::Exact), rays);
    const auto whole = trace({{full_resolution_level(of.grid)}, {0, 0, 0}, Tracing::Exact}, rays);
    const auto fast = trace(build_tracer(clipmap, {0, 0, 0}, Tracing::Fast), rays);
    std::size_t met = 0, otherwise = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(hits[i].range_m, whole[i].range_m) << i;
      const auto expected = testing::trace_reference(of.grid, rays[i]);
      ASSERT_EQ(expected.has_value(), static_cast<bool>(hits[i])) << i;
      otherwise += fast[i].range_m == hits[i].range_m ? 0 : 1;
      if (!expected) continue;
      ASSERT_NEAR(hits[i].range_m, expected->range_m, 1e-9 * expected->range_m + 1e-9);
      ++met;
    }
    EXPECT_GT(met, rays.size() / 6);
    EXPECT_LE(otherwise, rays.size() / 1000);
    std::cout << fmt::format("{} of {} rays met, {} otherwise in fast tracing\n", met, rays.size(),
                             otherwise);
  }
}

// With a tolerance, each reported bound holds, for rays that hit cells of all sizes.
TEST(ReliefProof, ErrorBoundsHoldOnTheDisplacedSurface) {
  const Refined of =
      refine(landscape({75, 67}, {4, -4}, 60),
             with_trails(rough(0.25, 10, 0.02), 0.25, {{80, -60}, {120, -90}, {130, -150}}));
  const glm::dvec2 at = of.grid.frame().to_D({600, 500});
  const glm::dvec3 sensor(at, of.grid.height_m_at(at).value_or(0) + 3);
  // Windows of about 200 x 200 cells, smaller than the tolerance requires.
  const Clipmap clipmap(of.tiles, of.relief->frame(),
                        {.tolerance_m = 0.01, .angle_rad = 4e-3, .memory_bytes = 10'000'000},
                        sensor_at(sensor));
  ASSERT_GE(clipmap.levels().size(), 3u);
  std::vector<Ray> rays(proof_size(4'000, 400'000), {sensor});
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const glm::dvec2 share = random_uniform({Seed{77}, 0, 0, static_cast<std::uint32_t>(i)});
    const double azimuth_rad = 6.2831853 * share.x;
    rays[i].direction = glm::normalize(
        glm::dvec3(std::cos(azimuth_rad), std::sin(azimuth_rad), 0.1 - share.y * share.y));
  }
  const RayTracer tracer = build_tracer(clipmap, {0, 0, 0}, Tracing::Exact);
  const auto hits = trace(tracer, rays);
  std::vector<double> bounds_m(rays.size());
  tracer.bound_errors(rays, hits, bounds_m);
  std::size_t finite = 0, coarse = 0;
  double worst_share = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i] || std::isinf(bounds_m[i])) continue;
    const auto expected = testing::trace_reference(of.grid, rays[i]);
    ASSERT_TRUE(expected);
    const double error_m = std::abs(hits[i].range_m - expected->range_m);
    // The bound is 0 where no leaf deviates; the ranges themselves have a tolerance.
    ASSERT_LE(error_m, bounds_m[i] + 1e-9 * hits[i].range_m + 1e-9) << i;
    ++finite;
    coarse += hits[i].deviation_m > 0 ? 1 : 0;
    if (hits[i].deviation_m > 0) worst_share = std::max(worst_share, error_m / bounds_m[i]);
  }
  EXPECT_GT(finite, rays.size() / 4);
  EXPECT_GT(coarse, finite / 10);
  std::cout << fmt::format("{} finite bounds, {} on deviating leaves, {:.2f} of the bound\n",
                           finite, coarse, worst_share);
}

TEST(Relief, ZeroDisplacementIsTheDem) {
  // Multiples of 1/4 m: interpolated heights are exact in float.
  std::vector<float> heights_m;
  for (std::uint32_t i = 0; i < 33 * 25; ++i)
    heights_m.push_back(static_cast<float>(random_bits({Seed{78}, 0, i})[0] % 200) / 4);
  const HeightGrid dem({33, 25}, {0, 0}, {4, -4}, heights_m);
  ImageF grey(1, 1, 1);
  grey.at(0, 0)[0] = 0.25f;
  const Refined of = refine(dem, {.cell_m = 0.5, .image = ImageRelief{grey, 3, 0.25, 5}});
  EXPECT_EQ(of.relief->displacement().min_m(), 0);
  EXPECT_EQ(of.relief->displacement().max_m(), 0);
  const auto rays = random_rays(dem, 4'000, Seed{79});
  const auto expected = trace({{full_resolution_level(dem)}, {0, 0, 0}, Tracing::Exact}, rays);
  const Clipmap clipmap(of.tiles, of.relief->frame(), {}, sensor_at({60, -50, 60}));
  const auto hits = trace(build_tracer(clipmap, {0, 0, 0}, Tracing::Exact), rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(static_cast<bool>(hits[i]), static_cast<bool>(expected[i]));
    // Each of the two ranges is accurate to 1e-9.
    if (!hits[i]) continue;
    ASSERT_NEAR(hits[i].range_m, expected[i].range_m, 2e-9 * (hits[i].range_m + 1));
  }
}

TEST(Relief, ErrorListsEveryFault) {
  const GridFrame dem = landscape({33, 29}, {5, -5}, 60).frame();
  ReliefSpec spec = rough(0.5, 20, 0.1);
  spec.image->image.at(3, 2)[0] = NAN;
  spec.fractal->hurst = 1.5;
  spec.fractal->shortest_m = 0.7;
  spec.fractal->longest_m = 30;
  EXPECT_THAT([&] { Relief(spec, dem, plenty); },
              ThrowsMessage<Error>(
                  AllOf(HasSubstr("pixel (3, 2) is not a finite number"), HasSubstr("hurst = 1.5"),
                        HasSubstr("shortest_m = 0.7 must be at least two cells, 1"),
                        HasSubstr("longest_m = 30 must not exceed period_m = 20"))));
  EXPECT_THAT([&] { Relief({}, dem, plenty); },
              ThrowsMessage<Error>(HasSubstr("an image, a fractal or trails")));
  EXPECT_THAT([&] { Relief(rough(1e-8, 1e-6, 0.1), dem, plenty); },
              ThrowsMessage<Error>(HasSubstr("make cell_m larger")));
  EXPECT_THAT([&] { Relief(rough(0.01, 50, 0.01), dem, std::size_t{64} << 20); },
              ThrowsMessage<Error>(AllOf(HasSubstr("takes 2048 MiB, more than the limit of 64"),
                                         HasSubstr("period_m (now 50)"))));
  EXPECT_THAT(
      [&] { Relief(rough(0.5, 1e300, 0.1), dem, plenty); },
      ThrowsMessage<Error>(HasSubstr("period_m = 1e+300 must be positive and at most 1e6")));
  spec = rough(0.5, 20, 0.1);
  spec.fractal->shortest_m = spec.fractal->longest_m = 9.99;
  EXPECT_THAT([&] { Relief(spec, dem, plenty); }, ThrowsMessage<Error>(HasSubstr("no wave")));
}

TEST(Relief, CopiesOfAnImageFitThePeriodWithAtMostTenPercentStretch) {
  const GridFrame dem = landscape({33, 29}, {5, -5}, 60).frame();
  ImageF comb(8, 4, 2);  // the first of 8 columns is high; the second channel is ignored
  for (int y = 0; y < 4; ++y) comb.at(0, y)[0] = 1;
  for (int x = 0; x < 8; ++x) comb.at(x, 0)[1] = NAN;
  for (const double size_m : {1.7, 3.0, 4.4, 5.3, 6.3, 7.9}) {
    const Relief relief({.cell_m = 0.08, .period_m = 8, .image = ImageRelief{comb, 1, 0, size_m}},
                        dem, plenty);
    const auto height_m = [&](int x) { return relief.displacement()(x % relief.period().x, 3); };
    int ridges = 0;
    for (int x = 0; x < relief.period().x; ++x)
      ridges += height_m(x) < 0.5f && height_m(x + 1) >= 0.5f ? 1 : 0;
    const double copy_m = relief.period().x * relief.frame().step_m.x / ridges;
    EXPECT_NEAR(copy_m / size_m, 1, 0.1) << size_m;
  }
}

TEST(Terrain, WithReliefIsTheSameSurfaceInMemoryAndByTiles) {
  const testing::TemporaryFolder folder;
  const HeightGrid dem = with_holes(landscape({97, 67}, {4, -4}, 60), 8, 3, Seed{80});
  testing::save_geotiff(dem, folder / "dem.tif");
  const auto load = [&](const TerrainDetail& detail, const std::optional<ReliefSpec>& relief) {
    return Terrain(folder / "dem.tif", {}, detail, {}, relief);
  };
  const ReliefSpec spec = rough(0.3, 20, 0.1);
  const Terrain whole = load({}, spec), bare = load({}, {});
  const Terrain tiled = load({.tolerance_m = 1e-3}, spec);
  ASSERT_NE(whole.whole(), nullptr);
  ASSERT_EQ(tiled.whole(), nullptr);
  ASSERT_EQ(bare.relief(), nullptr);
  EXPECT_EQ(whole.fingerprint(), tiled.fingerprint());
  EXPECT_NE(whole.fingerprint(), bare.fingerprint());
  ReliefSpec other = spec;
  other.fractal->seed = Seed{81};
  EXPECT_NE(whole.fingerprint(), load({}, other).fingerprint());
  std::size_t missing = 0;
  for (std::uint32_t i = 0; i < 5'000; ++i) {
    const glm::dvec2 share = random_uniform({Seed{82}, 0, 0, i});
    const glm::dvec2 p = whole.frame().to_D({0, 0}) + share * glm::dvec2(96 * 4, -66 * 4);
    const auto expected_m = whole.whole()->height_m_at(p);
    EXPECT_EQ(whole.ground().height_m_at(p), expected_m);
    EXPECT_EQ(tiled.ground().height_m_at(p), expected_m);
    EXPECT_EQ(bare.ground().height_m_at(p).has_value(), expected_m.has_value());
    missing += expected_m ? 0 : 1;
  }
  EXPECT_GT(missing, 10u);
}

TEST(Terrain, WithReliefIsTheSameSurfaceFromAFileLargerThanMemory) {
  const testing::TemporaryFolder folder;
  testing::save_geotiff(with_holes(fractal(257, 2, 60, Seed{83}), 20, 3, Seed{84}),
                        folder / "dem.tif");
  const ReliefSpec spec = rough(1, 40, 0.1);
  const Terrain large(folder / "dem.tif", {}, {}, {}, spec);
  const Terrain small(folder / "dem.tif", {}, {.memory_mib = 1}, {}, spec);
  ASSERT_NE(large.whole(), nullptr);
  ASSERT_TRUE(std::filesystem::exists(folder / "dem.tif.groundray"));
  for (std::uint32_t i = 0; i < 3'000; ++i) {
    const glm::dvec2 share = random_uniform({Seed{85}, 0, 0, i});
    const glm::dvec2 p = large.frame().to_D({0, 0}) + share * glm::dvec2(512, -512);
    ASSERT_EQ(small.ground().height_m_at(p), large.ground().height_m_at(p));
  }
  const glm::dvec3 sensor(large.frame().to_D({256, 256}), 200);
  const Clipmap clipmap = small.clipmap(sensor_at(sensor), 0);
  for (const Level& level : clipmap.levels()) {
    const glm::ivec2 last = large.frame().samples - 1;
    for (int row = 0; row < level.heights.size().y; ++row) {
      for (int column = 0; column < level.heights.size().x; ++column) {
        const glm::ivec2 at = glm::min(level.first + glm::ivec2(column, row) * level.step, last);
        const float height_m = level.heights(column, row);
        const float expected_m = large.whole()->height_m(at.x, at.y);
        ASSERT_EQ(std::isnan(height_m), std::isnan(expected_m));
        if (std::isnan(height_m)) continue;
        ASSERT_EQ(height_m, expected_m);
      }
    }
  }
}

}  // namespace
}  // namespace groundray::relief_test
