#include "core/tracing/ray_tracer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iostream>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/random.h"
#include "terrain/dem/dem_io.h"
#include "terrain/terrain_scene.h"
#include "test/support/margin.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/hard_rays.h"
#include "test/support/terrain/reference_tracer.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::ray_tracer_test {
namespace {

using testing::aimed_rays;
using testing::fractal;
using testing::proof_size;
using testing::random_rays;
using testing::ReferenceHit;
using testing::seam_points;
using testing::trace_reference;
using testing::with_holes;

struct Terrain {
  const char* name;
  Dem dem;
};

// The grid as a file in the middle of a UTM zone (an ESRI ASCII grid), loaded like any other DEM.
Dem at_utm(const HeightGrid& grid) {
  const testing::TemporaryFolder folder;
  std::string text = fmt::format(
      "ncols {}\nnrows {}\nxllcorner 498765.4321\nyllcorner 5123456.789\ndx {:.17g}\ndy {:.17g}\n"
      "NODATA_value -9999\n",
      grid.columns(), grid.rows(), std::abs(grid.step_m().x), std::abs(grid.step_m().y));
  for (const float height_m : grid.heights_m()) {
    text += std::isnan(height_m) ? "-9999 " : fmt::format("{:#.9g} ", height_m);
  }
  write_text(folder / "utm.asc", text + "\n");
  return load_dem(folder / "utm.asc");
}

std::vector<Terrain> terrains() {
  const auto data = testing::data_folder() / "terrain";
  return {
      {"jacksboro", at_utm(load_dem(data / "jacksboro.tif").grid)},
      {"prairie_1m", load_dem(data / "prairie_1m.tif")},
      {"fractal with holes", at_utm(with_holes(fractal(513, 5, 400, Seed{3}), 400, 6, Seed{4}))}};
}

// Random rays as a user specifies them: in W, then transformed to D.
std::vector<Ray> random_rays_in_world(const Dem& dem, std::size_t count, Seed seed) {
  std::vector<Ray> rays = random_rays(dem.grid, count, seed);
  for (Ray& ray : rays) {
    const glm::dvec3 p_W = ray.origin + dem.origin_w_m;
    ray.origin = p_W - dem.origin_w_m;
  }
  return rays;
}

// How fast tracing holds cells in Embree.
enum class Cells { Quads, Grids };

RayTracer tracer(const HeightGrid& grid, Tracing tracing, const std::string& device = "",
                 Cells cells = Cells::Quads) {
  Level level = full_resolution_level(grid);
  level.has_quads = cells == Cells::Quads;
  return {{level}, float_frame_origin({0, 0, grid.max_height_m()}), tracing, device};
}

std::vector<Hit> trace(const RayTracer& tracer, const std::vector<Ray>& rays) {
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits);
  return hits;
}

// The guaranteed accuracy: 1e-9 relative and absolute. For a ray that hits its facet at less than a
// millionth of a radian, the rounding of a height (an ulp of 4096 m) is multiplied by the inverse
// of that angle.
bool agrees(const std::optional<ReferenceHit>& expected, const Hit& hit) {
  if (expected.has_value() != static_cast<bool>(hit)) return false;
  return !expected || std::abs(expected->range_m - hit.range_m) <= 1e-9 * expected->range_m + 1e-9;
}

// Error bound of the single-precision frame (see docs/theory/surface.md): 16 * 2^-24 * max|p_L|.
double float_slack_m(const HeightGrid& grid) {
  const glm::dvec2 a = grid.origin_m();
  const glm::dvec2 b = a + glm::dvec2(grid.columns() - 1, grid.rows() - 1) * grid.step_m();
  const glm::dvec3 p_DL = float_frame_origin({0, 0, grid.max_height_m()});
  const double z_m =
      std::max(std::abs(grid.min_height_m() - p_DL.z), std::abs(grid.max_height_m() - p_DL.z));
  return 16 * 0x1p-24 * glm::length(glm::dvec3(glm::max(glm::abs(a), glm::abs(b)), z_m));
}

// True if the oracle decides as `hit` does for some ray moved by at most `slack_m`: the ray then
// passes a silhouette within that distance.
bool passes_silhouette(const HeightGrid& grid, const Ray& ray, const Hit& hit, double slack_m) {
  const glm::dvec3 side = glm::normalize(glm::cross(ray.direction, glm::dvec3(0.1234, 0.5, 0.77)));
  const glm::dvec3 up = glm::cross(side, ray.direction);
  for (const double distance_m : {slack_m, slack_m / 2, slack_m / 8, slack_m / 32}) {
    for (int i = 0; i < 16; ++i) {
      Ray moved = ray;
      moved.origin += (side * std::cos(i * 0.3927) + up * std::sin(i * 0.3927)) * distance_m;
      const auto expected = trace_reference(grid, moved);
      if (expected.has_value() != static_cast<bool>(hit)) continue;
      if (!expected || std::abs(expected->range_m - hit.range_m) <= 0.01 + 1e-4 * hit.range_m)
        return true;
    }
  }
  return false;
}

TEST(RayTracerProof, ExactTracingMatchesTheReferenceOnEveryRandomRay) {
  for (const auto& [name, dem] : terrains()) {
    const HeightGrid& grid = dem.grid;
    ASSERT_GT(dem.origin_w_m.y, 5e6) << "not at UTM coordinates";
    const auto rays = random_rays_in_world(dem, proof_size(20'000, 100'000), Seed{11});
    const auto hits = trace(tracer(grid, Tracing::Exact), rays);
    std::size_t met = 0;
    double worst = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const auto expected = trace_reference(grid, rays[i]);
      ASSERT_TRUE(agrees(expected, hits[i]))
          << name << " ray " << i << fmt::format(": {:.12g}", expected ? expected->range_m : -1.)
          << fmt::format(" against {:.12g}", hits[i].range_m);
      if (!expected) continue;
      ++met;
      worst = std::max(
          worst, std::abs(expected->range_m - hits[i].range_m) / (1e-9 * expected->range_m + 1e-9));
    }
    EXPECT_GT(met, rays.size() / 3) << name;
    testing::record_margin("range error", worst, 1);
    std::cout << fmt::format("{}: {} rays, {} hits, largest error {:.1e} of what is allowed\n",
                             name, rays.size(), met, worst);
  }
}

// Rays that start a millionth of a metre above hits of other rays, with directions over the
// hemisphere.
std::vector<Ray> rays_from_surface(const HeightGrid& grid, std::size_t count, Seed seed) {
  const RayTracer surface = tracer(grid, Tracing::Exact);
  std::vector<Ray> rays;
  for (const Ray& ray : random_rays(grid, count, seed)) {
    Hit hit;
    surface.trace({&ray, 1}, {&hit, 1});
    if (!hit) continue;
    const auto number = static_cast<std::uint32_t>(rays.size());
    const glm::dvec2 u = random_uniform({.seed = seed, .pulse = number});
    const double z = 2 * u.x - 1, radius = std::sqrt(1 - z * z);
    const glm::dvec3 normal = glm::normalize(glm::dvec3(hit.normal));
    glm::dvec3 direction(radius * std::cos(6.2831853 * u.y), radius * std::sin(6.2831853 * u.y), z);
    if (glm::dot(direction, normal) < 0) direction = -direction;
    rays.push_back({ray.origin + hit.range_m * ray.direction + 1e-6 * normal, direction});
  }
  return rays;
}

TEST(RayTracerProof, RaysFromTheSurfaceMatchTheReferenceInEveryKindOfBatch) {
  for (const auto& [name, dem] : terrains()) {
    const HeightGrid& grid = dem.grid;
    const auto rays = rays_from_surface(grid, proof_size(2'000, 100'000), Seed{12});
    for (const Tracing tracing : {Tracing::Exact, Tracing::Fast}) {
      const RayTracer surface = tracer(grid, tracing);
      for (const Batch batch : {Batch::Alike, Batch::ShadowRays, Batch::Scattered}) {
        std::vector<Hit> hits(rays.size());
        surface.trace(rays, hits, batch);
        std::size_t met = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
          const auto expected = trace_reference(grid, rays[i]);
          met += expected.has_value();
          ASSERT_TRUE(agrees(expected, hits[i]) ||
                      (tracing == Tracing::Fast &&
                       passes_silhouette(grid, rays[i], hits[i], float_slack_m(grid))))
              << name << " ray " << i
              << fmt::format(": {:.12g}", expected ? expected->range_m : -1.)
              << fmt::format(" against {:.12g}", hits[i].range_m);
        }
        EXPECT_GT(met, rays.size() / 100) << name;
      }
    }
  }
}

TEST(RayTracerProof, FastTracingDiffersOnlyAtSilhouettes) {
  for (const auto& [name, dem] : terrains()) {
    const HeightGrid& grid = dem.grid;
    const auto rays = random_rays_in_world(dem, proof_size(100'000, 10'000'000), Seed{12});
    const auto exact =
        trace(tracer(grid, Tracing::Exact), rays);  // equals the reference, as tested above
    for (const Cells cells : {Cells::Quads, Cells::Grids}) {
      const auto fast = trace(tracer(grid, Tracing::Fast, "", cells), rays);
      std::size_t different = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        if (fast[i].range_m == exact[i].range_m) continue;
        ++different;
        EXPECT_TRUE(passes_silhouette(grid, rays[i], fast[i], float_slack_m(grid)))
            << name << " ray " << i
            << fmt::format(": {} against {}", fast[i].range_m, exact[i].range_m);
      }
      EXPECT_LE(static_cast<double>(different), 5e-6 * static_cast<double>(rays.size())) << name;
      testing::record_margin("different", static_cast<double>(different),
                             5e-6 * static_cast<double>(rays.size()), "rays");
      std::cout << fmt::format("{}, {}: {} of {} rays decided otherwise\n", name,
                               cells == Cells::Quads ? "quads" : "grids", different, rays.size());
    }
  }
}

TEST(RayTracerProof, RaysAimedAtVerticesEdgesAndDiagonalsDoNotLeak) {
  const HeightGrid grid = fractal(513, 5, 400, Seed{3});
  const auto targets = seam_points(grid, proof_size(100'000, 1'000'000), Seed{21});
  std::vector<Ray> rays(targets.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const glm::dvec2 turn = random_uniform({Seed{22}, 0, 0, static_cast<std::uint32_t>(i)});
    const double steepness = 0.02 + turn.y * turn.y;
    const glm::dvec3 back(std::cos(6.2832 * turn.x), std::sin(6.2832 * turn.x), steepness);
    rays[i].origin = targets[i] + back * (40 / steepness);
    rays[i].direction = glm::normalize(targets[i] - rays[i].origin);
  }
  for (const auto& [tracing, cells] :
       {std::pair(Tracing::Exact, Cells::Quads), std::pair(Tracing::Fast, Cells::Quads),
        std::pair(Tracing::Fast, Cells::Grids)}) {
    const double slack_m = tracing == Tracing::Exact ? 1e-9 : float_slack_m(grid);
    const auto hits = trace(tracer(grid, tracing, "", cells), rays);
    std::size_t early = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const double target_m = glm::length(targets[i] - rays[i].origin);
      if (hits[i].range_m <= target_m * (1 + 1e-9) + 1e-6) continue;
      // The ray continued beyond its target point: correct only if it grazed a silhouette there.
      ++early;
      ASSERT_TRUE(passes_silhouette(grid, rays[i], hits[i], slack_m)) << "ray " << i << " leaks";
    }
    EXPECT_LT(early, rays.size() / 20) << "nearly every ray should stop where it was aimed at";
  }
}

TEST(RayTracer, VerticalRaysHitEverySampleAndEveryEdge) {
  const HeightGrid grid = fractal(65, 2, 30, Seed{5});
  const auto targets = seam_points(grid, 20'000, Seed{6});
  std::vector<Ray> rays;
  for (const glm::dvec3& target : targets) rays.push_back({{glm::dvec2(target), 500}, {0, 0, -1}});
  for (const Tracing tracing : {Tracing::Exact, Tracing::Fast}) {
    const auto hits = trace(tracer(grid, tracing), rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      // An ulp of 64 m horizontally, times a slope of at most 10.
      ASSERT_NEAR(hits[i].range_m, 500 - targets[i].z, 1e-12 * 500) << i;
    }
  }
}

// Sample positions that doubles represent exactly, so that a ray can run along a line of the grid,
// including its boundary.
TEST(RayTracer, RaysAlongGridLinesMatchTheReferenceEvenBesideHoles) {
  for (const int holes : {0, 60}) {
    const HeightGrid rough = with_holes(fractal(33, 2, 40, Seed{41}), holes, 2, Seed{42});
    const HeightGrid grid({33, 33}, {-32, 32}, {2, -2},
                          std::vector<float>(rough.heights_m().begin(), rough.heights_m().end()));
    constexpr glm::dvec2 ways[] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, -1}};
    std::vector<Ray> rays(30'000);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const auto bits = random_bits({Seed{43}, 0, 0, static_cast<std::uint32_t>(i)});
      const glm::dvec2 p(-32. + 2 * (bits[0] % 33), -32. + 2 * (bits[1] % 33));
      // Rounding puts a ray on a diagonal to either side of it, which changes the result near a
      // hole.
      const glm::dvec2 way = ways[bits[2] % (holes > 0 ? 4 : 6)];
      rays[i].origin = {p, grid.height_m_at(p).value_or(grid.max_height_m()) + 1};
      rays[i].direction = glm::normalize(glm::dvec3(way, -2 * (bits[3] * 0x1p-32)));
    }
    const auto hits = trace(tracer(grid, Tracing::Exact), rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const auto expected = trace_reference(grid, rays[i]);
      ASSERT_TRUE(agrees(expected, hits[i])) << i << " with " << holes << " holes";
    }
  }
}

// The sub-rays of a beam along an axis: cos 90 degrees is 6e-17, times slopes of a thousandth.
TEST(RayTracer, DirectionsAlmostAlongAnAxisMatchTheReference) {
  const HeightGrid grid = fractal(129, 2, 40, Seed{61});
  std::vector<Ray> rays(4096);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto bits = random_bits({Seed{62}, 0, 0, static_cast<std::uint32_t>(i)});
    const auto tiny = [&](std::uint32_t some) {
      return ((some & 1) != 0 ? 1 : -1) * std::pow(10.0, -17 - static_cast<double>(some % 30));
    };
    const glm::dvec2 p = glm::dvec2(bits[0], bits[1]) * 0x1p-32 * 200.0 - 100.0;
    const bool down = i % 64 < 32;
    const double above_m = down ? 50 : 0.3;
    rays[i].origin = {p, grid.height_m_at(p).value_or(0) + above_m};
    rays[i].direction = down ? glm::dvec3(tiny(bits[2]), tiny(bits[3]), -1)
                             : glm::dvec3(-1, tiny(bits[2]), tiny(bits[3]));
  }
  for (const Tracing tracing : {Tracing::Exact, Tracing::Fast}) {
    const auto hits = trace(tracer(grid, tracing), rays);
    for (std::size_t i = 0; i < rays.size(); ++i)
      ASSERT_TRUE(agrees(trace_reference(grid, rays[i]), hits[i])) << i;
  }
}

TEST(RayTracer, RaysFromBelowTheSurfaceMatchTheReference) {
  const HeightGrid grid = with_holes(fractal(257, 5, 300, Seed{7}), 200, 5, Seed{8});
  auto rays = random_rays(grid, 20'000, Seed{9});
  for (Ray& ray : rays) {
    ray.origin.z = grid.height_m_at(glm::dvec2(ray.origin)).value_or(0) - 5;
    ray.direction.z = std::abs(ray.direction.z);
  }
  for (const Tracing tracing : {Tracing::Exact, Tracing::Fast}) {
    const auto hits = trace(tracer(grid, tracing), rays);
    std::size_t met = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const auto expected = trace_reference(grid, rays[i]);
      met += expected ? 1 : 0;
      ASSERT_TRUE(agrees(expected, hits[i]) ||
                  (tracing == Tracing::Fast &&
                   passes_silhouette(grid, rays[i], hits[i], float_slack_m(grid))))
          << i;
    }
    EXPECT_GT(met, 500u) << "some come up into the open and meet the next slope";
  }
}

// Rays that leave the ground at a sample, an edge or a diagonal do not hit the back of a facet.
TEST(RayTracerProof, RaysHitFacetsOnlyFromAbove) {
  for (const int holes : {0, 100}) {
    const HeightGrid grid = with_holes(fractal(257, 5, 300, Seed{7}), holes, 5, Seed{8});
    const auto rays = aimed_rays(grid, proof_size(200'000, 2'000'000), Seed{31});
    for (const Tracing tracing : {Tracing::Exact, Tracing::Fast}) {
      const auto hits = trace(tracer(grid, tracing), rays);
      std::size_t met = 0, left = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const double height_m =
            grid.height_m_at(glm::dvec2(rays[i].origin)).value_or(rays[i].origin.z);
        left += rays[i].origin.z < height_m && !hits[i] ? 1 : 0;
        if (!hits[i]) continue;
        ++met;
        ASSERT_LT(glm::dot(glm::dvec3(hits[i].normal), rays[i].direction), 0) << i;
        // Not only the facet, but the ray is above it, as far as rounding tells.
        ASSERT_TRUE(tracing == Tracing::Fast || i % 8 != 0 ||
                    agrees(trace_reference(grid, rays[i]), hits[i]) ||
                    passes_silhouette(grid, rays[i], hits[i], 1e-9))
            << i;
      }
      EXPECT_GT(met, rays.size() / 4);
      EXPECT_GT(left, rays.size() / 20);
    }
  }
}

// Samples that are no heights, such as a fill value that is not declared, change only the facets
// that they belong to.
TEST(RayTracer, HitsDependOnNoOtherFacets) {
  const HeightGrid grid = fractal(65, 5, 100, Seed{33});
  for (const float fill_m : {-32768.0F, -1e12F, -1e20F}) {
    std::vector<float> heights(grid.heights_m().begin(), grid.heights_m().end());
    heights.front() = fill_m;
    const HeightGrid other({65, 65}, grid.origin_m(), grid.step_m(), heights);
    std::vector<Ray> rays = testing::hard_rays(grid, 20'000, Seed{34});
    // Away from the sample's cells.
    std::erase_if(rays, [&](const Ray& ray) {
      return glm::length(glm::dvec2(ray.origin) - grid.origin_m()) < 200 || ray.direction.z > -0.5;
    });
    const glm::dvec3 p_DL = float_frame_origin({0, 0, grid.max_height_m()});
    const auto trace_on = [&](const HeightGrid& on) {
      const RayTracer with({full_resolution_level(on)}, p_DL, Tracing::Exact);
      return trace(with, rays);
    };
    const auto expected = trace_on(grid), found = trace_on(other);
    EXPECT_GT(rays.size(), 3000u);
    for (std::size_t i = 0; i < rays.size(); ++i)
      ASSERT_EQ(found[i].range_m, expected[i].range_m) << i << " beside " << fill_m;
  }
}

TEST(RayTracer, RayThatLeavesTheGroundAtASampleHitsNothing) {
  const float a = 8 / 3.0F, b = 2 / 3.0F, c = 11 / 3.0F, d = 4 / 3.0F, e = 5 / 3.0F;
  const HeightGrid grid({3, 3}, {-1, 1}, {1, -1}, {0, a, b, 0, c, d, 1, 0, e});
  for (const Tracing tracing : {Tracing::Exact, Tracing::Fast}) {
    std::vector<Ray> rays;
    for (int i = 0; i < 4000; ++i) {
      const glm::dvec2 turn = random_uniform({Seed{32}, 0, 0, static_cast<std::uint32_t>(i)});
      // Steeper than any facet.
      const glm::dvec3 way(std::cos(6.2832 * turn.x), std::sin(6.2832 * turn.x), 6 + 4 * turn.y);
      rays.push_back({glm::dvec3(0, 0, c) - 0.5 * way, glm::normalize(way)});
    }
    const auto hits = trace(tracer(grid, tracing), rays);
    for (std::size_t i = 0; i < hits.size(); ++i) ASSERT_FALSE(hits[i]) << i;
  }
}

TEST(RayTracer, SurfaceIsOneSided) {
  const HeightGrid flat({3, 3}, {0, 0}, {10, 10}, std::vector<float>(9, 5));
  const std::vector<Ray> rays = {
      {{4, 4, 0}, {0, 0, 1}}, {{4, 4, 9}, {0, 0, -1}}, {{4, 4, 0}, {0, 0, -1}}};
  for (const Tracing tracing : {Tracing::Exact, Tracing::Fast}) {
    const auto hits = trace(tracer(flat, tracing), rays);
    EXPECT_FALSE(hits[0]);
    EXPECT_EQ(hits[1].range_m, 4);
    EXPECT_EQ(hits[1].normal, glm::vec3(0, 0, 1));
    EXPECT_FALSE(hits[2]);
  }
}

TEST(RayTracer, IgnoresHitsBeyondTheFarEndOfARay) {
  const HeightGrid flat({3, 3}, {0, 0}, {10, 10}, std::vector<float>(9, 5));
  for (const Tracing tracing : {Tracing::Exact, Tracing::Fast}) {
    const auto hits = trace(tracer(flat, tracing),
                            {{{4, 4, 9}, {0, 0, -1}, 3.999999}, {{4, 4, 9}, {0, 0, -1}, 4.000001}});
    EXPECT_FALSE(hits[0]);
    EXPECT_TRUE(hits[1]);
  }
}

TEST(RayTracerProof, InstructionSetsAgree) {
  const HeightGrid grid = with_holes(fractal(513, 5, 400, Seed{3}), 100, 6, Seed{4});
  const auto rays = random_rays(grid, proof_size(200'000, 1'000'000), Seed{31});
  std::vector<std::string> sets = {"max_isa=sse4.2", "max_isa=avx2"};
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")) {
    sets.emplace_back("max_isa=avx512");
  } else {
    std::cout << "NOTE: this processor has no AVX-512; SSE4.2 and AVX2 are compared alone\n";
  }
  for (const Tracing tracing : {Tracing::Exact, Tracing::Fast}) {
    const auto expected = trace(tracer(grid, tracing, sets.front()), rays);
    for (const std::string& set : sets) {
      const auto hits = trace(tracer(grid, tracing, set), rays);
      std::size_t different = 0;
      for (std::size_t i = 0; i < rays.size(); ++i)
        different += hits[i].range_m != expected[i].range_m ? 1 : 0;
      const double allowed =
          tracing == Tracing::Exact ? 0 : 5e-6 * static_cast<double>(rays.size());
      EXPECT_LE(static_cast<double>(different), allowed) << set;
      testing::record_margin(
          tracing == Tracing::Exact ? "different in `exact`" : "different in `fast`",
          static_cast<double>(different), allowed, "rays");
    }
  }
}

TEST(RayTracer, RaysMissASurfaceWithoutHeights) {
  const float hole = std::numeric_limits<float>::quiet_NaN();
  const HeightGrid empty({2, 2}, {0, 0}, {1, 1}, {hole, hole, hole, hole});
  const std::vector<Ray> down(3, {{0.5, 0.4, 10}, {0, 0, -1}});
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    std::vector<Hit> hits(down.size());
    tracer(empty, tracing).trace(down, hits);
    EXPECT_EQ(std::ranges::count_if(hits, [](const Hit& hit) { return bool(hit); }), 0);
  }
}

TEST(FloatFrame, OriginIsOnALatticeOf2048MetresNearTheViewpoint) {
  EXPECT_EQ(float_frame_origin({1000, -1030, 1023}), glm::dvec3(0, -2048, 0));
}

}  // namespace
}  // namespace groundray::ray_tracer_test
