// Rays among objects that sway in wind.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <random>

#include "core/tracing/scene.h"
#include "terrain/assets/asset.h"
#include "terrain/terrain_scene.h"
#include "test/support/margin.h"
#include "test/support/scans/solid.h"

namespace groundray::swaying_objects_test {
namespace {

using std::chrono::nanoseconds;

constexpr double infinity = std::numeric_limits<double>::infinity();
double tolerance_m(double range_m) { return 1e-9 * range_m + 1e-9; }

const Wind gale{.speed_m_s = 14, .towards = {0.6, -0.8}, .turbulence = 0.4};
const Flexibility limp{.frequency_hz = 0.8, .lean_rad = 0.4};

double in_seconds(nanoseconds time) { return std::chrono::duration<double>(time).count(); }

std::vector<Hit> trace(const ObjectTracer& tracer, std::span<const Ray> rays) {
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits);
  return hits;
}

std::vector<Ray> random_rays(double reach_m, int count, std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-reach_m, reach_m), high(0.2, reach_m);
  std::uniform_int_distribution<std::int64_t> when(0, 30'000'000'000);
  const auto point = [&] {
    const double x = place(random), y = place(random), z = high(random);
    return glm::dvec3(x, y, z);
  };
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i) {
    const glm::dvec3 origin = point(), target = point() * glm::dvec3(1, 1, 0.3);
    rays.push_back({origin, glm::normalize(target - origin)});
    rays.back().time = nanoseconds(when(random));
  }
  return rays;
}

// Upright and slanted objects, at scales from 0.4 to 2.5.
std::vector<PlacedObject> stand(std::size_t count, std::size_t models, double reach_m,
                                std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-reach_m, reach_m), angle(-3, 3), scale(0.4, 2.5);
  std::vector<PlacedObject> objects;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = place(random), y = place(random), yaw = angle(random), tilt = angle(random);
    const Pose X_DO{rotation_from_yaw_pitch_roll(yaw, 0.1 * tilt, 0.05 * tilt), {x, y, 0.1 * x}};
    objects.push_back(
        {X_DO.translation_m, X_DO.rotation, scale(random), static_cast<std::uint32_t>(i % models)});
  }
  return objects;
}

// The nearest triangle of all objects, whose corners lie at foot + (x, y, 0) + z a, where a is the
// unit vector along (t, 1).
struct Nearest {
  double range_m = infinity;
  std::uint32_t object = 0;
  glm::dvec3 normal{0};
};
Nearest nearest_of(std::span<const ModelScene> models, std::span<const PlacedObject> objects,
                   std::span<const Sway> sways, const Ray& ray) {
  Nearest best;
  for (std::uint32_t n = 0; n < objects.size(); ++n) {
    const PlacedObject& object = objects[n];
    const TriangleMesh& mesh = models[object.model].model().mesh;
    const glm::dvec2 slope = sways[object.model]
                                 .lean(glm::dvec2(object.p_DO), object.scale, in_seconds(ray.time))
                                 .tangent;
    const glm::dvec3 axis = glm::normalize(glm::dvec3(slope, 1));
    const auto at = [&](std::uint32_t vertex) {
      const glm::dvec3 upright = object.R_DO * (object.scale * mesh.vertices_m[vertex]);
      return object.p_DO + glm::dvec3(upright.x, upright.y, 0) + upright.z * axis - ray.origin;
    };
    for (const glm::uvec3& corners : mesh.triangles) {
      const glm::dvec3 a = at(corners.x), b = at(corners.y), c = at(corners.z);
      const glm::dvec3 normal = glm::cross(b - a, c - a);
      const double range_m = glm::dot(normal, a) / glm::dot(normal, ray.direction);
      if (!(range_m >= 0 && range_m < best.range_m)) continue;
      const glm::dvec3 p = range_m * ray.direction;
      const bool inside = glm::dot(glm::cross(b - a, p - a), normal) >= 0 &&
                          glm::dot(glm::cross(c - b, p - b), normal) >= 0 &&
                          glm::dot(glm::cross(a - c, p - c), normal) >= 0;
      if (inside) best = {range_m, n + 1, glm::normalize(normal)};
    }
  }
  return best;
}

class SwayingObjects : public ::testing::TestWithParam<Tracing> {
 protected:
  RayDevice device_;
};
INSTANTIATE_TEST_SUITE_P(Modes, SwayingObjects, ::testing::Values(Tracing::Fast, Tracing::Exact),
                         [](const auto& mode) {
                           return mode.param == Tracing::Fast ? "Fast" : "Exact";
                         });

Model tall_box() {
  Model box = testing::box_model({0.6, 0.4, 5});
  for (glm::dvec3& p : box.mesh.vertices_m) p.z += 2.2;  // the foot lies 0.3 m below the ground
  return box;
}

TEST_P(SwayingObjects, AreHitWhereTheyLeanAtTheRaysTime) {
  std::mt19937_64 random(1);
  const std::vector<ModelScene> models{
      {device_, tall_box(), GetParam()},
      {device_, testing::icosphere(0.7, 1), GetParam()},
      {device_, make_asset({.kind = AssetKind::GrassTuft, .size_m = 2}), GetParam()}};
  // The spheres stand still.
  const std::vector<Sway> sways{{gale, limp}, {}, {gale, {2.5, 0.6}}};
  const auto objects = stand(60, 3, 15, random);
  const ObjectTracer tracer(device_, models, objects, {}, sways);
  const auto rays = random_rays(15, 3000, random);
  const auto hits = trace(tracer, rays);
  std::array<int, 3> met{};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Nearest expected = nearest_of(models, objects, sways, rays[i]);
    ASSERT_EQ(hits[i].object, expected.object) << i;
    if (!hits[i]) continue;
    ++met[objects[expected.object - 1].model];
    ASSERT_NEAR(hits[i].range_m, expected.range_m, tolerance_m(expected.range_m));
    testing::record_margin("range",
                           (hits[i].range_m - expected.range_m) / tolerance_m(expected.range_m), 1);
    const double sign = glm::dot(expected.normal, rays[i].direction) > 0 ? -1 : 1;
    ASSERT_LT(glm::distance(glm::dvec3(hits[i].normal), sign * expected.normal), 1e-6);
  }
  for (const int count : met) EXPECT_GT(count, 50);
}

TEST_P(SwayingObjects, HitsDoNotDependOnTheOtherRays) {
  std::mt19937_64 random(2);
  const std::vector<ModelScene> models{{device_, tall_box(), GetParam()}};
  const ObjectTracer tracer(device_, models, stand(80, 1, 15, random), {}, {Sway(gale, limp)});
  const auto rays = random_rays(15, 2000, random);
  const auto hits = trace(tracer, rays);
  std::vector<std::size_t> order(rays.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::shuffle(order, random);
  std::vector<Ray> shuffled;
  for (const std::size_t i : order) shuffled.push_back(rays[i]);
  const auto again = trace(tracer, shuffled);
  for (std::size_t k = 0; k < order.size(); ++k) {
    EXPECT_EQ(again[k].range_m, hits[order[k]].range_m);
    EXPECT_EQ(again[k].object, hits[order[k]].object);
    EXPECT_EQ(again[k].normal, hits[order[k]].normal);
    EXPECT_EQ(trace(tracer, {&rays[k], 1})[0].range_m, hits[k].range_m);
  }
}

TEST_P(SwayingObjects, HaveTheSameBitsWithoutWind) {
  std::mt19937_64 random(3);
  const std::vector<ModelScene> models{{device_, tall_box(), GetParam()}};
  const auto objects = stand(80, 1, 15, random);
  const ObjectTracer none(device_, models, objects, {});
  const ObjectTracer calm(device_, models, objects, {}, {Sway({}, limp)});
  const auto rays = random_rays(15, 2000, random);
  const auto hits = trace(none, rays), others = trace(calm, rays);
  EXPECT_FALSE(calm.any_moves());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(hits[i].range_m, others[i].range_m);
    EXPECT_EQ(hits[i].normal, others[i].normal);
    EXPECT_EQ(hits[i].object, others[i].object);
  }
}

// Every ray that starts inside a closed surface hits it, at any inclination.
TEST_P(SwayingObjects, AreWatertight) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  const Model sphere = testing::icosphere(1, 2);
  const Sway sway(gale, limp);
  const glm::dvec3 foot(3000, -200, 5);
  const ObjectTracer tracer(device_, {{device_, sphere, GetParam()}}, {{foot}}, {}, {sway});
  std::vector<Ray> rays;
  for (const glm::uvec3& corners : sphere.mesh.triangles) {
    const glm::dvec3 a = sphere.mesh.vertices_m[corners.x], b = sphere.mesh.vertices_m[corners.y];
    for (const glm::dvec3& at : {a, 0.5 * (a + b), 0.3 * a + 0.7 * b}) {
      const double x = normal(random), y = normal(random), z = normal(random);
      const double time_s = static_cast<double>(rays.size()) * 0.01;
      const Lean lean = sway.lean(glm::dvec2(foot), 1, time_s);
      const glm::dvec3 inside =
          foot + lean.leaning(0.2 * glm::dvec3(x, y, z) / (1 + glm::length(glm::dvec3(x, y, z))));
      rays.push_back({inside, glm::normalize(foot + lean.leaning(at) - inside)});
      rays.back().time = nanoseconds(std::llround(time_s * 1e9));
    }
  }
  for (const Hit& hit : trace(tracer, rays)) ASSERT_TRUE(hit);
}

TEST_P(SwayingObjects, ReportTheirLeanAndVelocity) {
  const PlacedObject place{{4, 5, 6}, {1, 0, 0, 0}, 1.5, 0};
  const PlacedObject still{{9, 5, 6}, {1, 0, 0, 0}, 1.5, 1};
  const Sway sway(gale, limp);
  const ObjectTracer tracer(device_,
                            {{device_, tall_box(), GetParam()}, {device_, tall_box(), GetParam()}},
                            {place, still}, {}, {sway, {}});
  EXPECT_TRUE(tracer.any_moves());
  const nanoseconds time(1'234'567'890);
  EXPECT_EQ(tracer.lean(1, time).tangent, sway.lean({4, 5}, 1.5, in_seconds(time)).tangent);
  EXPECT_FALSE(tracer.lean(2, time));
  const auto at = [&](nanoseconds when) {
    return place.p_DO + tracer.lean(1, when).leaning({0.2, 0.1, 3});
  };
  const nanoseconds step(100'000);
  const glm::dvec3 expected = (at(time + step) - at(time - step)) / (2 * in_seconds(step));
  EXPECT_LT(glm::distance(tracer.velocity_m_s(1, at(time), time), expected), 1e-4);
  EXPECT_GT(glm::length(expected), 0.1);
  EXPECT_EQ(tracer.velocity_m_s(2, {9, 5, 8}, time), glm::dvec3(0));
}

// A board with an image: texels and normals stay with the plant.
TEST_P(SwayingObjects, KeepTheirAppearance) {
  Model board;
  board.mesh.vertices_m = {{0, -1, 0}, {0, 1, 0}, {0, 1, 2}, {0, -1, 2}};
  board.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  board.uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  board.normals = {{0.8, 0, 0.6}, {0.8, 0, 0.6}, {0.8, 0.6, 0}, {0.8, -0.6, 0}};
  board.surface_of = {0, 0};
  board.surfaces.resize(1);
  Image8 image(4, 4, 1);
  std::uint8_t grey = 10;
  for (std::uint8_t& value : image.values()) value = grey = static_cast<std::uint8_t>(grey + 13);
  board.surfaces[0].albedo.pixels = std::move(image);
  const Sway sway(gale, limp);
  const PlacedObject place{{40, -20, 3}, rotation_from_yaw_pitch_roll(0.4, 0.1, 0), 1.3, 0};
  const auto scene_of = [&](std::vector<Sway> sways) {
    std::vector<ModelScene> models{{device_, board, GetParam()}};
    return Scene{
        RayTracer({full_resolution_level(
                      {{2, 2}, {-2000, -2000}, {4000, 4000}, std::vector<float>(4, -1000.0f)})},
                  {0, 0, 0}, GetParam()),
        {},
        {},
        {device_, std::move(models), {place}, {}, std::move(sways)},
        {{7, {1}}}};
  };
  const Scene windy = scene_of({sway}), calm = scene_of({});
  for (int i = 0; i < 200; ++i) {
    const nanoseconds time(std::int64_t{70'000'000} * i);
    const Lean lean = sway.lean(glm::dvec2(place.p_DO), place.scale, in_seconds(time));
    const double y = 0.009 * (i % 100) - 0.45, z = 0.1 + 0.008 * i;
    const glm::dvec3 target = place.R_DO * (place.scale * glm::dvec3(0, y, z));
    const glm::dvec3 origin = place.R_DO * glm::dvec3(6, 1, 2);
    const auto look = [&](const Scene& scene, glm::dvec3 from, glm::dvec3 to) {
      Ray ray{place.p_DO + from, glm::normalize(to - from)};
      ray.time = time;
      Hit hit;
      scene.trace({&ray, 1}, {&hit, 1});
      EXPECT_EQ(hit.object, 1u);
      return std::pair(scene.look_at(ray, hit, 0, Filtering::Exact),
                       scene.appearance_of(ray, hit, 0, Filtering::Exact));
    };
    const auto [seen, appearance] = look(windy, lean.leaning(origin), lean.leaning(target));
    const auto [expected, ignored] = look(calm, origin, target);
    EXPECT_NEAR(seen.appearance.parts[0].tint.brightness,
                expected.appearance.parts[0].tint.brightness, 1e-5);
    EXPECT_EQ(appearance.parts[0].tint.brightness, seen.appearance.parts[0].tint.brightness);
    EXPECT_LT(glm::distance(seen.shading_normal,
                            glm::normalize(lean.leaning_normal(expected.shading_normal))),
              1e-5);
  }
}

}  // namespace
}  // namespace groundray::swaying_objects_test
