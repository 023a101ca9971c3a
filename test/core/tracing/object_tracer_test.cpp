#include "core/tracing/object_tracer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>

#include "core/error.h"
#include "test/support/margin.h"
#include "test/support/scans/solid.h"

namespace groundray::object_tracer_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using ::testing::AllOf;
using testing::box_model;
using ::testing::HasSubstr;
using testing::icosphere;
using ::testing::Not;

constexpr double infinity = std::numeric_limits<double>::infinity();
// The guaranteed accuracy of ranges.
double tolerance_m(double range_m) { return 1e-9 * range_m + 1e-9; }

glm::dvec3 random_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}

Pose random_pose(std::mt19937_64& random, double reach_m) {
  std::uniform_real_distribution<double> place(-reach_m, reach_m);
  std::normal_distribution<double> normal;
  return {
      glm::normalize(glm::dquat(normal(random), normal(random), normal(random), normal(random))),
      {place(random), place(random), place(random)}};
}

std::vector<Hit> trace(const ObjectTracer& tracer, std::span<const Ray> rays) {
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits);
  return hits;
}

// Range of a solid that is the intersection of the half-spaces n . p <= d of O. It is convex, so a
// line is inside between the last entry and the first exit.
struct Slab {
  glm::dvec3 n;
  double d;
};
double convex_range_m(std::span<const Slab> slabs, const glm::dvec3& origin,
                      const glm::dvec3& direction) {
  double enter = 0, leave = infinity;
  for (const Slab& slab : slabs) {
    const double closing = glm::dot(slab.n, direction);
    const double range = (slab.d - glm::dot(slab.n, origin)) / closing;
    if (closing < 0) enter = std::max(enter, range);
    if (closing > 0) leave = std::min(leave, range);
    if (closing == 0 && glm::dot(slab.n, origin) > slab.d) return infinity;
  }
  return enter <= leave ? enter : infinity;
}

std::vector<Ray> rays_at(const glm::dvec3& target, double spread_m, double far_m, int count,
                         std::mt19937_64& random) {
  std::vector<Ray> rays;
  std::uniform_real_distribution<double> off(-spread_m, spread_m);
  std::uniform_real_distribution<double> distance(0.1 * far_m, far_m);
  while (static_cast<int>(rays.size()) < count) {
    const glm::dvec3 origin = target + random_direction(random) * distance(random);
    const glm::dvec3 at = target + glm::dvec3(off(random), off(random), off(random));
    rays.push_back({origin, glm::normalize(at - origin)});
  }
  return rays;
}

class ObjectTracing : public ::testing::TestWithParam<Tracing> {
 protected:
  RayDevice device_;
};
INSTANTIATE_TEST_SUITE_P(Modes, ObjectTracing, ::testing::Values(Tracing::Fast, Tracing::Exact),
                         [](const auto& mode) {
                           return mode.param == Tracing::Fast ? "Fast" : "Exact";
                         });

// D's origin may lie far from the objects: at UTM-sized coordinates a double resolves 1e-9 m, so
// ranges err by a few of these.
TEST_P(ObjectTracing, RotatedAndScaledBoxesAreHitAtTheirPlanes) {
  std::mt19937_64 random(1);
  const ModelScene box(device_, box_model({2, 1, 0.5}), GetParam());
  const std::array<Slab, 6> slabs{{{{1, 0, 0}, 1},
                                   {{-1, 0, 0}, 1},
                                   {{0, 1, 0}, 0.5},
                                   {{0, -1, 0}, 0.5},
                                   {{0, 0, 1}, 0.25},
                                   {{0, 0, -1}, 0.25}}};
  for (const double reach_m : {0.0, 1e4, 5e6}) {
    for (int turn = 0; turn < 10; ++turn) {
      const Pose X_DO = random_pose(random, reach_m);
      const double scale = turn % 2 == 0 ? 1 : 3.7;
      const ObjectTracer tracer(device_, {box}, {{X_DO.translation_m, X_DO.rotation, scale, 0}},
                                {});
      const auto rays = rays_at(X_DO.translation_m, 2 * scale, 300, 500, random);
      const auto hits = trace(tracer, rays);
      const double rounding_m = 4 * 0x1p-53 * reach_m;
      int met = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const Pose X_OD = inverse(X_DO);
        const double expected_m = convex_range_m(slabs, X_OD * rays[i].origin / scale,
                                                 X_OD.rotation * rays[i].direction / scale);
        ASSERT_EQ(hits[i].range_m < infinity, expected_m < infinity);
        if (!hits[i]) continue;
        ++met;
        ASSERT_NEAR(hits[i].range_m, expected_m, tolerance_m(expected_m) + 10 * rounding_m);
        testing::record_margin(
            "range", (hits[i].range_m - expected_m) / (tolerance_m(expected_m) + 10 * rounding_m),
            1);
        EXPECT_LT(glm::dot(glm::dvec3(hits[i].normal), rays[i].direction), 0);
        EXPECT_EQ(hits[i].object, 1u);
      }
      EXPECT_GT(met, 50);
    }
  }
}

// The sub-rays of a beam along an axis: cos 90 degrees is 6e-17, times slopes of a thousandth.
TEST_P(ObjectTracing, DirectionsAlmostAlongAnAxisMissNothing) {
  const ModelScene box(device_, box_model({2, 1, 0.5}), GetParam());
  std::vector<PlacedObject> boxes;
  for (int i = -3; i <= 3; ++i)
    boxes.push_back({glm::dvec3(20 + i, 3 * i, 0), glm::dquat(1, 0, 0, 0), 2, 0});
  const ObjectTracer tracer(device_, {box}, boxes, {});
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> share(-1, 1), exponent(-45, -17);
  std::vector<Ray> rays;
  for (int i = 0; i < 1024; ++i) {
    const auto tiny = [&] {
      return std::copysign(std::pow(10.0, exponent(random)), share(random));
    };
    const double at = 3.0 * (i % 7 - 3);
    rays.push_back({{0, at + 0.9 * share(random), 0.4 * share(random)}, {1, tiny(), tiny()}});
  }
  const auto hits = trace(tracer, rays);
  for (std::size_t i = 0; i < rays.size(); ++i)
    ASSERT_NEAR(hits[i].range_m, 20 + static_cast<double>(i % 7) - 3 - 2, 1e-7) << i;
}

// A tube with many sides: the planes of its sides and lids are its closed form.
TEST_P(ObjectTracing, CylindersAreHitAtTheirPlanes) {
  std::mt19937_64 random(2);
  constexpr int sides = 60;
  const ModelScene tube(device_, testing::cylinder(0.25, 1.75, sides), GetParam());
  std::vector<Slab> slabs{{{0, 0, 1}, 1.75}, {{0, 0, -1}, 0}};
  for (int k = 0; k < sides; ++k) {
    const double angle_rad = 2 * std::numbers::pi * (k + 0.5) / sides;
    slabs.push_back(
        {{std::cos(angle_rad), std::sin(angle_rad), 0}, 0.25 * std::cos(std::numbers::pi / sides)});
  }
  const Pose X_DO = random_pose(random, 2e4);
  const ObjectTracer tracer(device_, {tube}, {{X_DO.translation_m, X_DO.rotation, 1, 0}}, {});
  const auto rays = rays_at(X_DO * glm::dvec3(0, 0, 0.9), 0.8, 120, 20000, random);
  const auto hits = trace(tracer, rays);
  const Pose X_OD = inverse(X_DO);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double expected_m =
        convex_range_m(slabs, X_OD * rays[i].origin, X_OD.rotation * rays[i].direction);
    ASSERT_EQ(hits[i].range_m < infinity, expected_m < infinity) << i;
    if (!hits[i]) continue;
    ASSERT_NEAR(hits[i].range_m, expected_m, tolerance_m(expected_m));
  }
}

// Brute force in double precision: all triangles of all objects, transformed to D.
struct Nearest {
  double range_m = infinity;
  std::uint32_t object = 0;
};
Nearest nearest_of(std::span<const ModelScene> models, std::span<const PlacedObject> objects,
                   const Ray& ray) {
  Nearest best;
  for (std::uint32_t n = 0; n < objects.size(); ++n) {
    const PlacedObject& object = objects[n];
    const TriangleMesh& mesh = models[object.model].model().mesh;
    const auto at = [&](std::uint32_t vertex) {
      return object.p_DO + object.R_DO * (object.scale * mesh.vertices_m[vertex]) - ray.origin;
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
      if (inside) best = {range_m, n + 1};
    }
  }
  return best;
}

std::vector<PlacedObject> crowd(std::size_t count, std::size_t models, std::mt19937_64& random) {
  std::vector<PlacedObject> objects;
  std::uniform_real_distribution<double> scale(0.3, 3);
  for (std::size_t i = 0; i < count; ++i) {
    const Pose X_DO = random_pose(random, 15);
    objects.push_back(
        {X_DO.translation_m, X_DO.rotation, scale(random), static_cast<std::uint32_t>(i % models)});
  }
  return objects;
}

TEST_P(ObjectTracing, TheNearestOfOverlappingObjectsIsHit) {
  std::mt19937_64 random(3);
  const std::vector<ModelScene> models{{device_, box_model({1, 1, 1}), GetParam()},
                                       {device_, icosphere(0.7, 1), GetParam()}};
  const auto objects = crowd(60, 2, random);
  const ObjectTracer tracer(device_, models, objects, {});
  const auto rays = rays_at(glm::dvec3(0), 15, 40, 1500, random);
  const auto hits = trace(tracer, rays);
  int otherwise = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Nearest expected = nearest_of(models, objects, rays[i]);
    const bool same =
        std::abs(hits[i].range_m - expected.range_m) <= tolerance_m(expected.range_m) ||
        (!hits[i] && expected.range_m == infinity);
    otherwise += same ? 0 : 1;
    EXPECT_EQ(hits[i].object, same ? expected.object : 0);
  }
  EXPECT_EQ(otherwise, 0);
}

// A closed surface is watertight: every ray that starts inside hits it.
TEST_P(ObjectTracing, NoRayLeaksThroughVerticesAndEdges) {
  std::mt19937_64 random(4);
  const Model sphere = icosphere(1, 3);
  const ModelScene scene(device_, sphere, GetParam());
  const Pose X_DO = random_pose(random, 3000);
  const ObjectTracer tracer(device_, {scene}, {{X_DO.translation_m, X_DO.rotation, 2, 0}}, {});
  std::vector<Ray> rays;
  for (const glm::uvec3& corners : sphere.mesh.triangles) {
    const glm::dvec3 a = sphere.mesh.vertices_m[corners.x], b = sphere.mesh.vertices_m[corners.y];
    for (const glm::dvec3& at : {a, 0.5 * (a + b), 0.3 * a + 0.7 * b}) {
      const glm::dvec3 target = X_DO * (2.0 * at);
      const glm::dvec3 inside = X_DO * (0.8 * random_direction(random));
      const glm::dvec3 outside = X_DO * (random_direction(random) * 0.2 + at * 60.0);
      rays.push_back({inside, glm::normalize(target - inside)});
      rays.push_back({outside, glm::normalize(target - outside)});
    }
  }
  const auto hits = trace(tracer, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_TRUE(hits[i]) << i;
    const double from_centre_m =
        glm::distance(rays[i].origin + hits[i].range_m * rays[i].direction, X_DO.translation_m);
    // The facets of the mesh lie between the ball through their vertices and 1.2 % inside.
    ASSERT_GT(from_centre_m, 2 * 0.985);
    ASSERT_LT(from_centre_m, 2 * (1 + 1e-9));
  }
}

// Exported models often have each face twice, once with reversed winding: every edge then belongs
// to four triangles.
TEST_P(ObjectTracing, NoRayLeaksThroughEdgesOfAModelWithDuplicateFaces) {
  std::mt19937_64 random(7);
  Model sphere = icosphere(1, 3);
  const std::size_t faces = sphere.mesh.triangles.size();
  for (std::size_t i = 0; i < faces; ++i) {
    const glm::uvec3 t = sphere.mesh.triangles[i];
    sphere.mesh.triangles.emplace_back(t.x, t.z, t.y);
  }
  sphere.surface_of.resize(2 * faces);
  const ObjectTracer tracer(device_, {{device_, sphere, GetParam()}}, {{{300, 20, 5}}}, {});
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < faces; ++i) {
    const glm::uvec3& t = sphere.mesh.triangles[i];
    const glm::dvec3 a = sphere.mesh.vertices_m[t.x], b = sphere.mesh.vertices_m[t.y];
    for (const double share : {0.0, 0.25, 0.5, 0.9}) {
      const glm::dvec3 inside = glm::dvec3(300, 20, 5) + 0.5 * random_direction(random);
      const glm::dvec3 target = glm::dvec3(300, 20, 5) + a + share * (b - a);
      rays.push_back({inside, glm::normalize(target - inside)});
    }
  }
  for (const Hit& hit : trace(tracer, rays)) ASSERT_TRUE(hit);
}

// A ray that starts on a wall, or behind it by a rounding error, continues to the opposite one.
TEST_P(ObjectTracing, RaysFromAWallHitTheOppositeWall) {
  const ObjectTracer tracer(device_, {{device_, box_model({2, 1, 0.5}), GetParam()}}, {{}}, {});
  for (const double off_m : {1e-12, 1e-9, 1e-7, 1e-5}) {
    const Ray ray{{-1 + off_m, 0.1, 0.1}, {1, 0, 0}};
    const std::vector<Hit> hits = trace(tracer, {&ray, 1});
    EXPECT_NEAR(hits[0].range_m, 2 - off_m, 1e-12);
  }
}

TEST(ObjectTracer, CutOutsNeedUv) {
  Model sheet = box_model({1, 1, 1});
  sheet.surfaces[0].name = "leaf";
  sheet.surfaces[0].albedo.pixels = Image8(2, 2, 4);
  try {
    const ModelScene scene(RayDevice(), sheet, Tracing::Fast);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("its surface 'leaf' is cut out by an image, but the model has no uv"));
  }
}

TEST_P(ObjectTracing, MovingObjectsAreHitAtTheirPoseAtTheRaysTime) {
  std::mt19937_64 random(5);
  const ModelScene ball(device_, icosphere(0.5, 2), GetParam());
  std::vector<Trajectory::Sample> samples;
  for (int k = 0; k <= 10; ++k) {
    Pose X_DO = random_pose(random, 2);
    X_DO.translation_m += glm::dvec3(100 + 3 * k, -50 + k, 2);
    samples.push_back({milliseconds(100 * k), X_DO});
  }
  const Trajectory X_DO(samples);
  const ObjectTracer tracer(device_, {ball}, {}, {{X_DO, 1.5, 0}});
  const std::vector<ModelScene> models{ball};
  std::uniform_int_distribution<std::int64_t> when(-50'000'000, 1'050'000'000);
  int met = 0;
  for (int packet = 0; packet < 200; ++packet) {
    std::vector<Ray> rays;
    for (int k = 0; k < 16; ++k) {
      const nanoseconds time(when(random));
      const nanoseconds at = std::clamp(time, X_DO.begin_time(), X_DO.end_time());
      Ray ray = rays_at(X_DO.pose_at(at).translation_m, 0.8, 80, 1, random)[0];
      ray.time = time;
      rays.push_back(ray);
    }
    const auto hits = trace(tracer, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const auto time = std::clamp(rays[i].time, X_DO.begin_time(), X_DO.end_time());
      const Pose X_DB = X_DO.pose_at(time);
      const std::vector<PlacedObject> still{{X_DB.translation_m, X_DB.rotation, 1.5, 0}};
      const Nearest expected = nearest_of(models, still, rays[i]);
      ASSERT_EQ(hits[i].range_m < infinity, expected.range_m < infinity);
      if (!hits[i]) continue;
      ++met;
      ASSERT_NEAR(hits[i].range_m, expected.range_m, tolerance_m(expected.range_m));
    }
  }
  EXPECT_GT(met, 1000);
}

// Embree gets far fewer time steps than a recording has poses.
TEST_P(ObjectTracing, LongTrajectoriesAreHitAtAnyTime) {
  std::mt19937_64 random(15);
  const ModelScene ball(device_, icosphere(0.5, 2), GetParam());
  std::vector<Trajectory::Sample> samples;
  for (int k = 0; k <= 5000; ++k) {  // drives for a while, is parked, drives on
    const double along_m = 0.1 * (k < 1000 ? k : k < 4000 ? 1000 : k - 3000);
    const Pose X_DO{rotation_from_yaw_pitch_roll(0.01 * along_m, 0, 0),
                    {along_m, 5 * std::sin(0.05 * along_m), 0}};
    samples.push_back({milliseconds(10 * k), X_DO});
  }
  const Trajectory X_DO(samples);
  const ObjectTracer tracer(device_, {ball}, {}, {{X_DO, 1, 0}});
  std::uniform_int_distribution<std::int64_t> when(0, 50'000'000'000);
  for (int i = 0; i < 3000; ++i) {
    const nanoseconds time(when(random));
    const glm::dvec3 centre = X_DO.pose_at(time).translation_m;
    Ray ray = rays_at(centre, 0.2, 80, 1, random)[0];
    ray.time = time;
    const auto hits = trace(tracer, std::span(&ray, 1));
    ASSERT_TRUE(hits[0]) << time.count();
    // The facets lie between the sphere through their vertices and the one through their edges'
    // midpoints.
    const double radius_m = glm::distance(ray.origin + ray.direction * hits[0].range_m, centre);
    ASSERT_GT(radius_m, 0.48);
    ASSERT_LT(radius_m, 0.5 + 1e-9);
  }
}

// Bit-identical for every packet width: exact tracing takes all decisions in double precision.
TEST(ObjectTracer, ExactTracingIsIdenticalOnEveryInstructionSet) {
  std::mt19937_64 random(6);
  const auto objects = crowd(40, 2, random);
  const auto rays = rays_at(glm::dvec3(0), 15, 40, 5000, random);
  std::vector<Hit> first;
  for (const char* isa : {"max_isa=sse4.2", "max_isa=avx", "max_isa=avx2"}) {
    const RayDevice device(isa);
    const ObjectTracer tracer(device,
                              {{device, box_model({1, 1, 1}), Tracing::Exact},
                               {device, icosphere(0.7, 1), Tracing::Exact}},
                              objects, {});
    const auto hits = trace(tracer, rays);
    if (first.empty()) first = hits;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(hits[i].range_m, first[i].range_m);
      ASSERT_EQ(hits[i].object, first[i].object);
      ASSERT_EQ(hits[i].part, first[i].part);
      ASSERT_EQ(hits[i].normal, first[i].normal);
    }
  }
}

TEST(ObjectTracer, KeepsNearerHitsAndIgnoresFartherObjects) {
  const RayDevice device;
  const ObjectTracer tracer(device, {{device, box_model({1, 1, 1}), Tracing::Fast}}, {{{10, 0, 0}}},
                            {});
  const std::vector<Ray> rays{{{0, 0, 0}, {1, 0, 0}},
                              {{0, 0, 0}, {1, 0, 0}},
                              {{0, 0, 0}, {1, 0, 0}, 9.4},
                              {{10, 0.1, 0.2}, {1, 0, 0}}};
  std::vector<Hit> hits(4);
  hits[1].range_m = 9;
  tracer.trace(rays, hits);
  EXPECT_EQ(hits[0].range_m, 9.5);
  EXPECT_EQ(hits[0].normal, glm::vec3(-1, 0, 0));
  EXPECT_EQ(hits[1].range_m, 9);
  EXPECT_EQ(hits[1].object, 0u);
  EXPECT_FALSE(hits[2]);
  EXPECT_EQ(hits[3].range_m, 0.5);  // from inside
  EXPECT_EQ(hits[3].normal, glm::vec3(-1, 0, 0));
}

// Alpha in a checkerboard of quarters: a ray passes where the texel is transparent.
TEST_P(ObjectTracing, CutOutsLetRaysPassWhereTransparent) {
  Model sheet;
  sheet.mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  sheet.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  sheet.uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  sheet.surface_of = {0, 0};
  sheet.surfaces.resize(1);
  Image8 pixels(4, 4, 4);
  const auto is_clear = [](int x, int y) { return (x + y) % 2 == 1; };
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) pixels.at(x, y)[3] = is_clear(x, y) ? 0 : 255;
  }
  sheet.surfaces[0].albedo.pixels = pixels;
  const ModelScene scene(device_, sheet, GetParam());
  const ObjectTracer tracer(device_, {scene}, {{{0, 0, 5}}, {{0, 0, 4}}}, {});
  std::vector<Ray> rays;
  for (int y = 0; y < 4; ++y) {
    // Centres of texels, from above; row 0 is the top row of the image, where v is largest.
    for (int x = 0; x < 4; ++x) rays.push_back({{(x + 0.5) / 4, (3.5 - y) / 4, 10}, {0, 0, -1}});
  }
  const auto hits = trace(tracer, rays);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      const Hit& hit = hits[static_cast<std::size_t>(y) * 4 + static_cast<std::size_t>(x)];
      EXPECT_EQ(static_cast<bool>(hit), !is_clear(x, y)) << x << ' ' << y;
      EXPECT_EQ(hit.range_m, is_clear(x, y) ? infinity : 5);
    }
  }
}

// Single precision locates a hit in a triangle to some 1e-7 of its size, which is not enough for
// texels as fine as these: 20 repeats of 512 texels, so 1e-4 of the rays could be decided wrongly.
// The oracle is the closed form.
TEST_P(ObjectTracing, CutOutsAreTransparentExactlyAtTransparentTexels) {
  std::mt19937_64 random(8);
  Image8 pixels(512, 512, 2);
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 512; ++x) pixels.at(x, y)[1] = random() % 2 == 0 ? 0 : 255;
  }
  Model sheet;
  sheet.mesh.vertices_m = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  sheet.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  sheet.uv = {{0, 0}, {20, 0}, {20, 20}, {0, 20}};
  sheet.surface_of = {0, 0};
  sheet.surfaces.resize(1);
  sheet.surfaces[0].albedo.pixels = pixels;
  const ObjectTracer tracer(device_, {{device_, sheet, GetParam()}}, {{}}, {});
  std::uniform_real_distribution<double> within(-0.98, 0.98);
  std::vector<Ray> rays(100'000);
  for (Ray& ray : rays) {
    ray.origin = {20 * within(random), 20 * within(random), 10};
    ray.direction = glm::normalize(glm::dvec3(within(random), within(random), 0) - ray.origin);
  }
  const auto hits = trace(tracer, rays);
  const Texture alpha(pixels, Encoding::Srgb, Wrap::Repeat);
  int otherwise = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    const glm::dvec3 p = ray.origin - ray.origin.z / ray.direction.z * ray.direction;
    otherwise +=
        static_cast<bool>(hits[i]) == alpha.is_opaque(glm::dvec2(p.x + 1, p.y + 1) * 10.0) ? 0 : 1;
  }
  EXPECT_EQ(otherwise, 0);
}

// Random facets in a box, each of them twice; the copies have another surface.
Model doubled(std::size_t facets, std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-5, 5), off(-0.3, 0.3);
  Model model;
  for (std::uint32_t i = 0; i < facets; ++i) {
    const glm::dvec3 centre(place(random), place(random), place(random));
    for (int k = 0; k < 3; ++k)
      model.mesh.vertices_m.push_back(centre + glm::dvec3(off(random), off(random), off(random)));
    model.mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  auto& triangles = model.mesh.triangles;
  for (std::size_t i = 0; i < facets; ++i) triangles.push_back(triangles[i]);
  model.surface_of.assign(facets, 0);
  model.surface_of.resize(2 * facets, 1);
  model.surfaces.resize(2);
  return model;
}

std::vector<Hit> trace_alone(const Model& model, Tracing tracing, std::span<const Ray> rays) {
  const RayDevice device;
  return trace({device, {{device, model, tracing}}, {{}}, {}}, rays);
}

TEST_P(ObjectTracing, TheFirstOfCoincidentTrianglesIsHit) {
  std::mt19937_64 random(9);
  constexpr std::size_t facets = 8000;
  const Model shared = doubled(facets, random);
  Model turned = shared;
  for (std::size_t i = facets; i < 2 * facets; ++i)
    std::swap(turned.mesh.triangles[i].y, turned.mesh.triangles[i].z);
  Model apart = shared;  // with separate vertices
  for (std::size_t i = 0; i < 3 * facets; ++i)
    apart.mesh.vertices_m.push_back(shared.mesh.vertices_m[i]);
  for (std::size_t i = facets; i < 2 * facets; ++i) apart.mesh.triangles[i] += 3 * facets;
  const auto rays = rays_at(glm::dvec3(0), 5, 40, 20'000, random);
  for (const Model& model : {shared, turned, apart}) {
    int met = 0;
    for (const Hit& hit : trace_alone(model, GetParam(), rays)) {
      if (!hit) continue;
      ++met;
      ASSERT_LT(hit.part, facets);
    }
    EXPECT_GT(met, 15'000);
  }
}

// Another first corner rounds ranges differently, so that either of two copies may be nearer.
TEST(ObjectTracer, FastAndExactTracingHitTheSameOfCoincidentTriangles) {
  std::mt19937_64 random(10);
  constexpr std::size_t facets = 8000;
  Model model = doubled(facets, random);
  for (std::size_t i = facets; i < 2 * facets; ++i) {
    const glm::uvec3 t = model.mesh.triangles[i];
    model.mesh.triangles[i] = {t.y, t.z, t.x};
  }
  const auto rays = rays_at(glm::dvec3(0), 5, 40, 20'000, random);
  const auto fast = trace_alone(model, Tracing::Fast, rays);
  const auto exact = trace_alone(model, Tracing::Exact, rays);
  std::array<int, 2> met{};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(fast[i].range_m, exact[i].range_m);
    ASSERT_EQ(fast[i].part, exact[i].part);
    if (exact[i]) ++met[model.surface_of[exact[i].part]];
  }
  EXPECT_GT(met[0] + met[1], 15'000);
  EXPECT_GT(met[1], 1000);
}

// A board of squares whose corners doubles represent exactly: rays that cross it there hit up to
// six triangles.
TEST_P(ObjectTracing, TheFirstTriangleAtAnEdgeOrVertexIsHit) {
  constexpr unsigned side = 16;
  Model board;
  for (unsigned y = 0; y <= side; ++y) {
    for (unsigned x = 0; x <= side; ++x) board.mesh.vertices_m.emplace_back(x, y, 0);
  }
  for (unsigned cell = side * side; cell-- > 0;) {  // from the far end
    const unsigned a = cell / side * (side + 1) + cell % side, b = a + side + 1;
    board.mesh.triangles.emplace_back(a, a + 1, b + 1);
    board.mesh.triangles.emplace_back(a, b + 1, b);
  }
  board.surface_of.resize(board.mesh.triangles.size());
  board.surfaces.resize(1);
  std::vector<Ray> rays;
  for (unsigned y = 1; y < 2 * side; ++y) {
    for (unsigned x = 1; x < 2 * side; ++x) rays.push_back({{x / 2.0, y / 2.0, 3}, {0, 0, -1}});
  }
  const auto hits = trace_alone(board, GetParam(), rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const glm::dvec3 p = rays[i].origin;
    std::uint32_t first = 0;
    for (;; ++first) {
      const glm::uvec3& t = board.mesh.triangles[first];
      const glm::dvec3 a = board.mesh.vertices_m[t.x], b = board.mesh.vertices_m[t.y],
                       c = board.mesh.vertices_m[t.z];
      if (glm::cross(b - a, p - a).z >= 0 && glm::cross(c - b, p - b).z >= 0 &&
          glm::cross(a - c, p - c).z >= 0)
        break;
    }
    ASSERT_EQ(hits[i].part, first) << p.x << ' ' << p.y;
    ASSERT_EQ(hits[i].range_m, 3);
  }
}

TEST(ObjectTracer, VelocityIsTheDerivativeOfPosition) {
  const RayDevice device;
  const Pose begin{{1, 0, 0, 0}, {5, 6, 7}};
  const Pose end{rotation_from_yaw_pitch_roll(0.8, 0.1, -0.2), {6, 5, 7.5}};
  const Trajectory X_DO({{milliseconds(0), begin}, {milliseconds(500), end}});
  const ObjectTracer tracer(device, {{device, box_model({1, 1, 1}), Tracing::Fast}}, {{}},
                            {{X_DO, 1, 0}});
  const glm::dvec3 p_OQ(0.3, -0.4, 0.5);
  const auto at = [&](int ms) { return X_DO.pose_at(milliseconds(ms)) * p_OQ; };
  for (const int ms : {100, 250, 400}) {
    // The error of central differences is h^2 / 6 of the third derivative: radius x rate^3.
    const glm::dvec3 expected = (at(ms + 1) - at(ms - 1)) / 2e-3;
    const glm::dvec3 velocity = tracer.velocity_m_s(2, at(ms), milliseconds(ms));
    EXPECT_LT(glm::distance(velocity, expected), 1e-5);
  }
  EXPECT_EQ(tracer.velocity_m_s(1, at(0), milliseconds(0)), glm::dvec3(0));
  EXPECT_EQ(tracer.velocity_m_s(2, at(500), milliseconds(900)), glm::dvec3(0));
}

TEST(ObjectTracer, ReportsEveryFaultOfTheObjects) {
  const RayDevice device;
  const std::vector<ModelScene> models{{device, box_model({1, 1, 1}), Tracing::Fast}};
  try {
    const ObjectTracer tracer(device, models, {{.scale = 0}, {.model = 3}, {.p_DO = {NAN, 0, 0}}},
                              {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("object 1: its scale = 0 must be positive"),
                                    HasSubstr("object 2: model 3 does not exist; there are 1"),
                                    HasSubstr("object 3: its position must be finite")));
  }
}

// Embree would silently omit all objects if one were beyond 1.8e18 m.
TEST(ObjectTracer, RejectsObjectsBeyondABillionMetres) {
  const RayDevice device;
  const std::vector<ModelScene> models{{device, box_model({2, 2, 2}), Tracing::Fast}};
  const Trajectory away(
      {{milliseconds(0), Pose{}}, {milliseconds(100), {{1, 0, 0, 0}, {0, 2e9, 0}}}});
  try {
    const ObjectTracer tracer(
        device, models,
        {{.p_DO = {0, 0, -1e19}}, {.p_DO = {1e300, 0, 0}}, {.scale = 1e9}, {.p_DO = {5e8, 0, 0}}},
        {{away}});
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(
        error.what(),
        AllOf(HasSubstr("object 1: it reaches 1e+19 m from the origin; it must stay within 1e+09 "
                        "m: are its position and size in metres?"),
              HasSubstr("object 2: it reaches inf m"), HasSubstr("object 3: it reaches 1.73e+09 m"),
              Not(HasSubstr("object 4")), HasSubstr("object 5: it reaches 2e+09 m")));
  }
  const ObjectTracer far_apart(device, models, {{}, {.p_DO = {9.9e8, 0, 0}}}, {});
  const std::vector<Ray> rays{{{0.1, 0.2, 5}, {0, 0, -1}}, {{9.9e8, 0.2, 5}, {0, 0, -1}}};
  for (const Hit& hit : trace(far_apart, rays)) EXPECT_NEAR(hit.range_m, 4, 1e-8);
}

TEST(ObjectTracer, RejectsModelsBeyondABillionMetres) {
  Model box = box_model({2, 2, 2});
  box.mesh.vertices_m[5].y = 1.1e9;
  try {
    const ModelScene scene(RayDevice(), box, Tracing::Fast);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("vertex 5 must have a finite position within 1e+09 m of "
                                        "the origin: is it in metres?"));
  }
}

// Embree is made to fail by requesting structures that it does not have.
TEST(ObjectTracer, FailedBuildsReleaseTheirMemory) {
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    const RayDevice device("tri_accel=none,object_accel=none");
    const std::size_t before = device.memory_bytes();
    EXPECT_THROW(ModelScene(device, icosphere(1, 4), tracing), Error);
    EXPECT_EQ(device.memory_bytes(), before);
  }
  const RayDevice device("object_accel=none");
  const ModelScene ball(device, icosphere(1, 4), Tracing::Fast);
  const std::size_t before = device.memory_bytes();
  EXPECT_THROW(ObjectTracer(device, {ball}, std::vector<PlacedObject>(1000), {}), Error);
  EXPECT_EQ(device.memory_bytes(), before);
}

}  // namespace
}  // namespace groundray::object_tracer_test
