// Radiance along rays, compared with closed forms.
#include "sensors/camera/path_tracer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "terrain/terrain_scene.h"
#include "test/support/margin.h"
#include "test/support/scans/solid.h"

namespace groundray::path_tracer_test {
namespace {

using std::chrono::nanoseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::icosphere;
using ::testing::ThrowsMessage;

constexpr double pi = std::numbers::pi;

// Two-sided quantile of all statistical tests here: 1 % by Sidak over about 100 comparisons. The
// standard errors are those of independent paths; Sobol nets have smaller errors.
constexpr double sigmas = 3.9;

Spectrum flat(double value) { return {{300, value}, {2500, value}}; }
Material grey(double reflectance) { return {"grey", Lambertian{flat(reflectance)}}; }
Material lamp(double radiance, double reflectance = 0) {
  return {"lamp", Lambertian{flat(reflectance)}, glm::dvec3(radiance)};
}

// A rectangle in the x-y plane, given by two opposite corners.
Model rectangle(const glm::dvec2& low, const glm::dvec2& high) {
  Model model;
  model.mesh.vertices_m = {
      {low.x, low.y, 0}, {high.x, low.y, 0}, {high.x, high.y, 0}, {low.x, high.y, 0}};
  model.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  model.uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  model.surface_of = {0, 0};
  model.surfaces.resize(1);
  return model;
}

// Applies a normal map with a single texel, the same for every facet.
Model bumpy(Model model, std::uint8_t x, std::uint8_t y, std::uint8_t z) {
  Image8 image(1, 1, 3);
  std::ranges::copy(std::initializer_list<std::uint8_t>{x, y, z}, image.values().begin());
  model.surfaces[0].normal.pixels = std::move(image);
  return model;
}

// A sphere with smooth shading: its facets have the normals of the sphere that circumscribes them.
Model smooth_sphere(int splits) {
  Model model = icosphere(1, splits);
  for (const glm::dvec3& vertex_m : model.mesh.vertices_m)
    model.normals.emplace_back(glm::normalize(vertex_m));
  return model;
}

struct Thing {
  Model model;
  Material material;
  glm::dvec3 p_DO{0};
  glm::dquat R_DO{1, 0, 0, 0};
  double scale = 1;
};

// Objects labelled 1, 2 and so on, over flat ground labelled 9.
Scene scene_of(std::vector<Thing> things, const Material& ground = grey(0),
               double height_m = -1000) {
  const RayDevice device;
  std::vector<Material> materials{ground};
  std::vector<ModelScene> models;
  std::vector<ModelTruth> truths;
  std::vector<PlacedObject> placed;
  for (Thing& thing : things) {
    const auto number = static_cast<std::uint16_t>(materials.size());
    truths.push_back({number, {number}});
    materials.push_back(thing.material);
    models.emplace_back(device, std::move(thing.model), Tracing::Fast);
    placed.push_back({thing.p_DO, thing.R_DO, thing.scale, number - 1u});
  }
  const HeightGrid heights{
      {2, 2}, {-20'000, -20'000}, {40'000, 40'000}, std::vector<float>(4, float(height_m))};
  return {RayTracer({full_resolution_level(heights)}, {0, 0, 0}, Tracing::Fast),
          {.label = 9},
          Materials(std::move(materials)),
          ObjectTracer(device, std::move(models), std::move(placed), {}),
          std::move(truths)};
}

Sky even_sky(double radiance) { return Sky({.dome = ConstantSky{glm::dvec3(radiance)}}); }
Sky sun_alone(double elevation_deg, SunDisc disc = SunDisc::Uniform) {
  return Sky({.sun = SunSpec{SunAngles{.azimuth_deg = 90, .elevation_deg = elevation_deg}, disc}});
}

Ray ray_to(const glm::dvec3& from, const glm::dvec3& to) {
  return {from, glm::normalize(to - from)};
}

struct Estimate {
  glm::dvec3 mean{0}, standard_error{0}, most{0};
};
Estimate estimate_of(std::span<const glm::vec3> values) {
  Estimate result;
  glm::dvec3 squares(0);
  for (const glm::vec3& value : values) {
    result.mean += glm::dvec3(value);
    result.most = glm::max(result.most, glm::dvec3(value));
  }
  const auto n = static_cast<double>(values.size());
  result.mean /= n;
  for (const glm::vec3& value : values) {
    const glm::dvec3 off = glm::dvec3(value) - result.mean;
    squares += off * off;
  }
  result.standard_error = glm::sqrt(squares / (n * (n - 1)));
  return result;
}

// Camera ray, and the random numbers of its path.
struct Sample {
  Ray ray;
  SobolPairs numbers;
};

std::vector<glm::vec3> traced(const PathTracer& light, const std::vector<Sample>& samples) {
  PathTracer::Workspace work;
  std::vector<glm::vec3> radiance(samples.size());
  constexpr std::size_t at_once = 4096;
  for (std::size_t i = 0; i < samples.size(); i += at_once) {
    const std::size_t count = std::min(at_once, samples.size() - i);
    for (const Sample& sample : std::span(samples).subspan(i, count))
      work.add(sample.ray, sample.numbers);
    light.trace(work, std::span(radiance).subspan(i, count));
  }
  return radiance;
}

// Mean of a net of paths that begin with the same ray.
Estimate light_along(const PathTracer& light, const Ray& ray, std::uint32_t paths,
                     std::uint32_t seed = 1) {
  std::vector<Sample> samples;
  for (std::uint32_t i = 0; i < paths; ++i) samples.push_back({ray, SobolPairs(seed, i)});
  return estimate_of(traced(light, samples));
}

glm::dvec3 any_direction(std::uint32_t stream, std::uint32_t index) {
  const glm::dvec2 u = random_uniform({.seed = {6}, .sensor = stream, .pulse = index});
  const double height = 1 - 2 * u.x, level = std::sqrt(1 - height * height);
  return {level * std::cos(2 * pi * u.y), level * std::sin(2 * pi * u.y), height};
}

// One of each kind of material, none of which absorbs light.
std::vector<Material> white_materials() {
  return {{"matt", Lambertian{flat(1)}},
          {"rough", RoughDiffuse{flat(1), 1}},
          {"wet", Coated{flat(1), 1.33, 0.3}},
          {"gloss paint", Coated{flat(1), 1.5, 0.1}},
          {"metal", Conductor{flat(1e-10), flat(5), 0.2}},
          {"rough metal", Conductor{flat(1e-10), flat(5), 1}},
          {"leaf", PlantLeaf{flat(0.6), flat(0.4)}}};
}

// Facts 5.1, 7. Tabulated albedos are accurate to 5e-4.
TEST(PathTracer, WhiteObjectsPassTheFurnaceTest) {
  constexpr double radiance = 3;
  const Sky sky = even_sky(radiance);
  std::vector<Sample> samples;
  for (std::uint32_t i = 0; i < 1 << 15; ++i) {
    const glm::dvec3 from = 5.0 * any_direction(1, i);
    samples.push_back({ray_to(from, 0.6 * any_direction(2, i)), SobolPairs(1, i)});
  }
  for (const Material& white : white_materials()) {
    const Scene scene = scene_of({{icosphere(1, 2), white}}, grey(1), -1e6);
    const auto found = estimate_of(traced(PathTracer(scene, sky, 64, {}), samples));
    for (glm::length_t k = 0; k < 3; ++k) {
      const double off = std::abs(found.mean[k] - radiance);
      EXPECT_LT(off, 1e-3 * radiance) << white.name;
      testing::record_margin("white things", off / radiance, 1e-3);
      EXPECT_LT(off, sigmas * found.standard_error[k] + 5e-4 * radiance) << white.name;
    }
    // Only the surface itself samples directions, so its paths do not differ.
    if (white.name == "matt") {
      EXPECT_LT(glm::length(found.standard_error), 1e-6);
    }
  }
}

// Facts 5.1, 8. The shape of the enclosure does not matter, so a ball of 80 facets is exact.
TEST(PathTracer, GreyEmittingEnclosureSumsTheGeometricSeries) {
  constexpr double shines = 0.5, reflects = 0.5;
  const Scene scene = scene_of({{icosphere(2, 1), lamp(shines, reflects)}});
  const Sky sky = even_sky(7);  // not seen
  for (int depth = 1; depth <= 6; ++depth) {
    const PathTracer light(scene, sky, depth, {});
    const double expected = shines * (1 - std::pow(reflects, depth)) / (1 - reflects);
    const auto found = light_along(light, ray_to({0.4, 0.3, -0.2}, {2, 1, 3}), 1 << 14);
    EXPECT_NEAR(found.mean.g, expected, 1e-3 * expected) << depth;
    testing::record_margin("insides", found.mean.g / expected - 1, 1e-3);
    EXPECT_NEAR(found.mean.g, expected, sigmas * found.standard_error.g + 1e-6) << depth;
  }
}

// Facts 5.1, 9. The only noise comes from the cosine over the sun's disc of radius r, sampled
// uniformly: 1 + r tan(incidence) sqrt(u) cos(2 pi v). Its variation in the sense of Hardy and
// Krause is 9 r tan(incidence), and 2^16 points of a (0, m, 2)-net have a discrepancy of at most
// (16 / 2 + 3 / 2) / 2^16 (Niederreiter 1987): by the Koksma-Hlawka inequality the error is at most
// 9e-6 at 35 degrees.
TEST(PathTracer, SunlitMattGroundFollowsLambertsLaw) {
  constexpr double reflectance = 0.3;
  const Scene scene = scene_of({}, grey(reflectance), 0);
  for (const double elevation_deg : {35., 50., 90.}) {
    const Sky sky = sun_alone(elevation_deg);
    const PathTracer light(scene, sky, 2, {});
    const glm::dvec3 expected =
        sky.sun()->irradiance() * reflectance / pi * std::sin(sky.sun()->elevation_rad());
    const auto found = light_along(light, ray_to({3, 1, 2}, {0, 0, 0}), 1 << 16);
    for (glm::length_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(found.mean[k] / expected[k], 1, 1e-5);
      testing::record_margin("ground", found.mean[k] / expected[k] - 1, 1e-5);
    }
    const double spread = found.standard_error.g * 256 / expected.g;
    const double tangent = 1 / std::tan(sky.sun()->elevation_rad());
    EXPECT_LT(spread, 0.51 * sky.sun()->angular_radius_rad() * tangent + 1e-5);
  }
}

// As above: relative to a surface perpendicular to the sun's rays the error is at most 9 r
// sin(incidence) 9 / 2^15 = 9e-6. The shading normal of a point on a smooth sphere's facet is that
// of the sphere beyond it.
TEST(PathTracer, SunlitMattSphereFollowsLambertsLaw) {
  const Scene scene = scene_of({{smooth_sphere(3), grey(1)}});
  const Sky sky = sun_alone(90);
  const PathTracer light(scene, sky, 2, {});
  for (std::uint32_t i = 0; i < 8; ++i) {
    const double x = 0.1 * i;
    const Ray ray{{x, 0.1, 4}, {0, 0, -1}};
    Hit hit;
    scene.trace({&ray, 1}, {&hit, 1});
    const double cosine = glm::normalize(glm::dvec3(x, 0.1, 4 - hit.range_m)).z;
    const auto found = light_along(light, ray, 1 << 15, i);
    EXPECT_NEAR(found.mean.g / (sky.sun()->irradiance().g / pi), cosine, 1e-5) << x;
    testing::record_margin("a sphere", found.mean.g / (sky.sun()->irradiance().g / pi) - cosine,
                           1e-5);
  }
}

// Fraction of a uniform disc of radius 1 on one side of a line at distance `s` from its centre.
double disc_beside(double s) {
  return std::abs(s) < 1 ? 0.5 + (std::asin(s) + s * std::sqrt(1 - s * s)) / pi : s > 0;
}

// Facts 5.1, 10: within 1 % of the width, as the edge's slope is at most 2 / pi per radius.
TEST(PathTracer, PenumbraOfAnEdgeIsAsWideAsTheSun) {
  constexpr double tolerance = 2 / pi * 0.02;
  constexpr double height_m = 3;
  constexpr double penumbra_m = 9.32e-3 * height_m;
  const Scene scene =
      scene_of({{rectangle({-200, -200}, {0, 200}), grey(0), {0, 0, height_m}}}, grey(0.5), 0);
  for (const SunDisc disc : {SunDisc::Uniform, SunDisc::LimbDarkened}) {
    const Sky sky = sun_alone(90, disc);
    const Sun& sun = *sky.sun();
    const PathTracer light(scene, sky, 2, {});
    const double all = 0.5 * sun.irradiance().g / pi;
    // For a limb-darkened disc: sums over strips.
    std::vector<double> strips(201);
    for (int i = 0; i < 201; ++i) {
      for (int k = 0; k < 201; ++k) {
        const glm::dvec2 aside = glm::dvec2(i - 100, k - 100) / 100.0 * sun.angular_radius_rad();
        strips[std::size_t(i)] += sun.radiance(glm::normalize(glm::dvec3(aside, 1))).g;
      }
    }
    double sum = 0;
    for (double& strip : strips) strip = sum += strip;
    for (int i = -11; i <= 11; ++i) {
      const double s = 0.1 * i, x = s * penumbra_m / 2;
      const double expected =
          disc == SunDisc::Uniform
              ? disc_beside(s)
              : strips[std::size_t(std::clamp(100 + 10 * i, 0, 200))] / strips.back();
      const auto found =
          light_along(light, ray_to({x, -2, 1}, {x, 0, 0}), 1 << 13, std::uint32_t(i + 50));
      EXPECT_NEAR(found.mean.g / all, expected, tolerance) << s;
      testing::record_margin("penumbra", found.mean.g / all - expected, tolerance);
    }
  }
}

// Facts 5.1, 11.
TEST(PathTracer, WallsOccludeTheirShareOfAUniformSky) {
  constexpr double radiance = 2, tolerance = 2e-3;
  const Sky sky = even_sky(radiance);
  for (const double rises_deg : {10., 35., 60., 80.}) {
    const double rises_rad = glm::radians(rises_deg);
    // A wall beside the point, so long that its ends have no effect.
    const glm::dquat upright = glm::angleAxis(pi / 2, glm::dvec3(0, -1, 0));
    const double wall_m = std::tan(rises_rad);
    const Thing wall{rectangle({0, -1e4}, {wall_m, 1e4}), grey(0), {1, 0, 0}, upright};
    const Scene beside = scene_of({wall}, grey(1), 0);
    const Ray down = ray_to({-0.5, 0, 0.5}, {0, 0, 0});
    const auto one = light_along(PathTracer(beside, sky, 2, {}), down, 1 << 14);
    EXPECT_NEAR(one.mean.g / radiance, (1 + std::cos(rises_rad)) / 2, tolerance) << rises_deg;
    Thing other = wall;
    other.p_DO.x = -1;
    const Scene groove = scene_of({wall, other}, grey(1), 0);
    const auto two = light_along(PathTracer(groove, sky, 2, {}), down, 1 << 14);
    EXPECT_NEAR(two.mean.g / radiance, std::cos(rises_rad), tolerance) << rises_deg;
    // A slope over dark ground.
    const Scene slope = scene_of({{rectangle({-1, -1}, {1, 1}),
                                   grey(1),
                                   {0, 0, 2},
                                   glm::angleAxis(rises_rad, glm::dvec3(0, -1, 0))}},
                                 grey(0), 0);
    const glm::dvec3 up(-std::sin(rises_rad), 0, std::cos(rises_rad));
    const auto tilted =
        light_along(PathTracer(slope, sky, 2, {}), {glm::dvec3(0, 0, 2) + up, -up}, 1 << 14);
    EXPECT_NEAR(tilted.mean.g / radiance, (1 + std::cos(rises_rad)) / 2, tolerance) << rises_deg;
    testing::record_margin(
        "shares of the sky",
        std::max({std::abs(one.mean.g / radiance - (1 + std::cos(rises_rad)) / 2),
                  std::abs(two.mean.g / radiance - std::cos(rises_rad)),
                  std::abs(tilted.mean.g / radiance - (1 + std::cos(rises_rad)) / 2)}),
        tolerance);
  }
}

// A dim sky with a patch of a thousandth of all directions that gives most of the light.
ImageF sky_with_a_lamp() {
  ImageF image(64, 32, 3);
  for (float& value : image.values()) value = 0.1f;
  for (const int x : {20, 21}) {
    image.at(x, 9)[0] = 300;
    image.at(x, 9)[1] = 400;
    image.at(x, 9)[2] = 100;
  }
  return image;
}

// Next-event estimation and BSDF sampling of the dome are two estimators of one integral. The
// oracle uses BSDF sampling alone; for matt ground the sky has the integral in closed form.
TEST(PathTracer, NextEventEstimationOfTheDomeMatchesBsdfSampling) {
  const Sky sky({.dome = EnvironmentImage{.image = "lamp.exr"}}, sky_with_a_lamp());
  const std::vector<Material> materials{grey(0.5),
                                        {"rough", RoughDiffuse{flat(0.5), 0.7}},
                                        {"wet", Coated{flat(0.5), 1.33, 0.3}},
                                        {"metal", Conductor{flat(0.2), flat(3), 0.25}}};
  const Ray ray = ray_to({1, 2, 2}, {0, 0, 0});
  for (const Material& material : materials) {
    const Scene scene = scene_of({}, material, 0);
    const auto found = light_along(PathTracer(scene, sky, 2, {}), ray, 1 << 14);
    const Bsdf bsdf = bsdf_in_colour(material);
    std::vector<glm::vec3> alone;
    for (std::uint32_t i = 0; i < 1 << 17; ++i) {
      const auto [wi, weight, pdf_per_sr] =
          bsdf.sample(-ray.direction, random_uniform({.seed = {5}, .pulse = i}));
      alone.emplace_back(wi.z > 0 ? weight * sky.dome_radiance(wi) : glm::dvec3(0));
    }
    const auto expected = estimate_of(alone);
    for (glm::length_t k = 0; k < 3; ++k) {
      const double error = std::hypot(found.standard_error[k], expected.standard_error[k]);
      EXPECT_NEAR(found.mean[k], expected.mean[k], sigmas * error) << material.name;
      EXPECT_LT(found.standard_error[k], 0.01 * found.mean[k]) << material.name;
    }
    if (material.name != "grey") continue;
    const glm::dvec3 exact = 0.5 / pi * sky.dome_irradiance();
    for (glm::length_t k = 0; k < 3; ++k) EXPECT_NEAR(found.mean[k], exact[k], 2e-3 * exact[k]);
  }
}

// Irradiance at a point from a parallel rectangle whose corner is directly above it, as a fraction
// of that from a full hemisphere of the same radiance.
// @see Howell, A catalog of radiation heat transfer configuration factors, B-3.
double corner_share(double a_m, double b_m, double height_m) {
  const double a = a_m / height_m, b = b_m / height_m;
  const double p = std::sqrt(1 + a * a), q = std::sqrt(1 + b * b);
  return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * pi);
}

// Near lamps are mostly hit by BSDF sampling, far ones mostly by next-event estimation: only 2e-6
// of all BSDF-sampled paths hit the lamp at 1000 m. These count as much as the others, so a mean
// may lack them.
TEST(PathTracer, IrradianceOfARectangularLampIsItsConfigurationFactor) {
  constexpr double shines = 10, reflects = 0.8;
  const Sky dark = even_sky(0);
  for (const double height_m : {1e-3, 0.1, 1., 30., 1000.}) {
    const Scene scene =
        scene_of({{rectangle({0, 0}, {2, 3}), lamp(shines), {0, 0, height_m}}}, grey(reflects), 0);
    const PathTracer light(scene, dark, 2, {});
    const double expected = shines * reflects * corner_share(2, 3, height_m);
    const auto found = light_along(light, ray_to({-height_m, 0, height_m / 2}, {0, 0, 0}), 1 << 15);
    EXPECT_NEAR(found.mean.g, expected, 2e-3 * expected) << height_m;
    testing::record_margin("a rectangle", found.mean.g / expected - 1, 2e-3);
    EXPECT_NEAR(found.mean.g, expected, sigmas * found.standard_error.g + 3e-6 * expected);
    // Each of the two estimators contributes at most the lamp's radiance times the reflectance.
    EXPECT_LE(found.most.g, 2 * shines * reflects);
  }
}

// Two coincident triangles are one to rays, so they must be one to the sampling of lights.
TEST(PathTracer, CoincidentLampTrianglesEmitOnce) {
  Model twice = rectangle({0, 0}, {2, 3});
  twice.mesh.triangles.insert(twice.mesh.triangles.end(), {{0, 2, 1}, {0, 3, 2}});
  twice.surface_of.assign(4, 0);
  const Scene scene = scene_of({{twice, lamp(10), {0, 0, 5}}}, grey(0.8), 0);
  const Sky dark = even_sky(0);
  const double expected = 8 * corner_share(2, 3, 5);
  const auto found =
      light_along(PathTracer(scene, dark, 2, {}), ray_to({-1, 0, 1}, {0, 0, 0}), 1 << 14);
  EXPECT_NEAR(found.mean.g, expected, 2e-3 * expected);
}

// Lambert's formula for the irradiance of an upward surface at the origin from a polygon above it,
// as a fraction of that from a full hemisphere: any polygon, at any angle.
double polygon_share(const std::vector<glm::dvec3>& corners) {
  double sum = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const glm::dvec3 a = glm::normalize(corners[i]);
    const glm::dvec3 b = glm::normalize(corners[(i + 1) % corners.size()]);
    const glm::dvec3 across = glm::cross(a, b);
    sum += std::atan2(glm::length(across), glm::dot(a, b)) * glm::normalize(across).z;
  }
  return std::abs(sum) / (2 * pi);
}

// Two lamps of different size and radiance, one of them moving.
TEST(PathTracer, MovingLampsEmitFromTheirPoseAtTheRaysTime) {
  const RayDevice device;
  const glm::dquat tilt = glm::angleAxis(0.4, glm::normalize(glm::dvec3(1, 2, 0.5)));
  const Trajectory path({{seconds(0), {tilt, {-4, 1, 3}}}, {seconds(2), {tilt, {4, -1, 5}}}});
  const std::vector<ModelScene> models{{device, rectangle({-1, -1}, {1, 1}), Tracing::Fast},
                                       {device, rectangle({-1, -1}, {1, 1}), Tracing::Fast}};
  const PlacedObject still{{2, 3, 4}, glm::conjugate(tilt), 0.5, 0};
  const HeightGrid heights{{2, 2}, {-100, -100}, {200, 200}, std::vector<float>(4, 0.0f)};
  const Scene scene{RayTracer({full_resolution_level(heights)}, {0, 0, 0}, Tracing::Fast),
                    {},
                    {grey(0.9), lamp(20), lamp(3)},
                    ObjectTracer(device, models, {still}, {{path, 1.5, 1}}),
                    {{1, {1}}, {2, {2}}}};
  const auto share = [&](const glm::dvec3& p_DO, const glm::dquat& R_DO, double scale) {
    std::vector<glm::dvec3> corners;
    for (const glm::dvec3& p_O : models[0].model().mesh.vertices_m)
      corners.push_back(p_DO + R_DO * (scale * p_O));
    return polygon_share(corners);
  };
  const Sky dark = even_sky(0);
  const PathTracer light(scene, dark, 2, {});
  for (const int tenths : {0, 5, 10, 17, 20}) {
    Ray ray = ray_to({0.5, 0.2, 0.3}, {0, 0, 0});
    ray.time = std::chrono::milliseconds(100 * tenths);
    const glm::dvec3 way = glm::mix(glm::dvec3(-4, 1, 3), glm::dvec3(4, -1, 5), tenths / 20.0);
    const double expected =
        0.9 * (20 * share(still.p_DO, still.R_DO, still.scale) + 3 * share(way, tilt, 1.5));
    const auto found = light_along(light, ray, 1 << 14);
    EXPECT_NEAR(found.mean.g, expected, 4e-3 * expected) << tenths;
    testing::record_margin("lamps that move", found.mean.g / expected - 1, 4e-3);
    EXPECT_NEAR(found.mean.g, expected, sigmas * found.standard_error.g) << tenths;
  }
}

// A lamp that surrounds the point is at one distance, so air attenuates all of it equally, both in
// next-event estimation and where BSDF sampling hits it.
TEST(PathTracer, AirAttenuatesLampsInBothSamplingStrategies) {
  constexpr double radius_m = 50, shines = 4, reflects = 0.5;
  const AerialPerspective air({.visibility_m = 200});
  const Sky sky = even_sky(0);  // another test covers the air's in-scattered light
  const Scene scene = scene_of({{icosphere(radius_m, 3), lamp(shines)},
                                {rectangle({-1e-3, -1e-3}, {1e-3, 1e-3}), grey(reflects)}});
  const PathTracer light(scene, sky, 2, air);
  const glm::dvec3 left = glm::exp(-air.extinction_per_m() * radius_m);
  const auto direct = light_along(light, {{0, 0, 1e-3}, {0, 0, 1}}, 1);
  const auto lit = light_along(light, {{0, 0, 1e-3}, {0, 0, -1}}, 1 << 14);
  for (glm::length_t k = 0; k < 3; ++k) {
    // Facets lie up to 0.6 % inside the sphere.
    EXPECT_NEAR(direct.mean[k], shines * left[k], 0.01 * left[k]);
    EXPECT_NEAR(lit.mean[k], shines * reflects * left[k], 0.01 * shines * reflects * left[k]);
  }
}

// Koschmieder's model: docs/theory/sky.md.
TEST(PathTracer, AirFadesDistantSurfacesIntoTheHorizon) {
  const AerialPerspective air({.visibility_m = 1000});
  const Sky sky = even_sky(0.3);
  const Scene scene =
      scene_of({{rectangle({-1, -1}, {1, 1}), lamp(5), {0, 0, 700}}}, grey(0), -1000);
  const auto found = light_along(PathTracer(scene, sky, 1, air), {{0, 0, 0}, {0, 0, 1}}, 1);
  const glm::dvec3 left = glm::exp(-air.extinction_per_m() * 700.0);
  for (glm::length_t k = 0; k < 3; ++k)
    EXPECT_NEAR(found.mean[k], 5 * left[k] + 0.3 * (1 - left[k]), 1e-6);
}

// Light from the sky below the slope is lost over the angle between the two normals: the part of
// the shading normal's hemisphere that lies below the facet is dark.
TEST(PathTracer, BumpsLoseOnlyTheLightBelowTheSurface) {
  constexpr double radiance = 2;
  const Sky sky = even_sky(radiance);
  for (const std::uint8_t x : std::initializer_list<std::uint8_t>{128, 180, 230}) {
    const Scene scene = scene_of({{bumpy(rectangle({-1, -1}, {1, 1}), x, 128, 200), grey(1)}});
    const glm::dvec3 bump = glm::normalize(glm::dvec3(x, 128, 200) / 255.0 * 2.0 - 1.0);
    const auto found = light_along(PathTracer(scene, sky, 2, {}), {{0, 0, 1}, {0, 0, -1}}, 1 << 14);
    EXPECT_NEAR(found.mean.g, radiance * (1 + bump.z) / 2, 2e-3 * radiance) << int{x};
  }
}

TEST(PathTracer, BumpsLetNoLightThroughASurface) {
  ImageF below(16, 8, 1);
  for (int x = 0; x < 16; ++x) {
    for (const int y : {5, 6, 7}) below.at(x, y)[0] = 1000;
  }
  const Sky sky({.dome = EnvironmentImage{.image = "below.exr"}}, std::move(below));
  const Thing light_below{rectangle({-5, -5}, {5, 5}), lamp(50), {0, 0, -1}};
  for (const Material& material : {white_materials()[0], white_materials()[3]}) {
    const Scene scene =
        scene_of({{bumpy(rectangle({-9, -9}, {9, 9}), 250, 60, 140), material}, light_below},
                 grey(0), -1000);
    const PathTracer light(scene, sky, 5, {});
    for (const double aside : {0., 0.5, 3., -3., 30.}) {
      const auto found = light_along(light, ray_to({aside, 0, 1}, {0, 0, 0}), 1 << 10);
      EXPECT_EQ(found.most, glm::dvec3(0)) << material.name << ' ' << aside;
    }
  }
}

// Near its silhouette a coarse sphere has visible facets whose shading normals face away from the
// camera. At most half of the hemisphere of such a normal is cut off from the sky.
TEST(PathTracer, SmoothObjectsHaveNoDarkSilhouettes) {
  const Sky sky = even_sky(1);
  const Scene scene =
      scene_of({{smooth_sphere(1), grey(1), {}, glm::angleAxis(0.3, glm::dvec3(1, 0, 0))}});
  const PathTracer light(scene, sky, 2, {});
  int away = 0;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const glm::dvec2 u = random_uniform({.seed = {2}, .pulse = i});
    const glm::dvec2 aside =
        glm::mix(0.85, 1.0, u.x) * glm::dvec2(std::cos(2 * pi * u.y), std::sin(2 * pi * u.y));
    const Ray ray{{aside, 4}};
    Hit hit;
    scene.trace({&ray, 1}, {&hit, 1});
    if (!hit) continue;
    if (scene.look_at(ray, hit, 0, Filtering::Fast).shading_normal.z > 0) continue;
    ++away;
    EXPECT_GT(light_along(light, ray, 1 << 8).mean.g, 0.5) << i;
  }
  EXPECT_GT(away, 5);
}

TEST(PathTracer, LabelsAreOfEachRaysFirstHit) {
  const Scene scene = scene_of({{icosphere(1, 1), grey(0.5), {0, 0, 2}},
                                {rectangle({-1, -1}, {1, 1}), grey(0.5), {5, 0, 2}}},
                               grey(0.5), 0);
  const Sky sky = even_sky(1);
  const std::vector<Sample> samples{{{{0, 0, 9}}, {1, 0}},
                                    {{{5, 0, 9}}, {1, 1}},
                                    {{{9, 9, 9}}, {1, 2}},
                                    {{{0, 0, 9}, {0, 0, 1}}, {1, 3}}};
  PathTracer::Workspace work;
  std::vector<glm::vec3> radiance(4);
  std::vector<std::uint16_t> labels(4, 77);
  for (const Sample& sample : samples) work.add(sample.ray, sample.numbers);
  PathTracer(scene, sky, 3, {}).trace(work, radiance, labels);
  EXPECT_THAT(labels, ::testing::ElementsAre(1, 2, 9, 0));
}

// The same bytes, whatever else is traced at the same time.
TEST(PathTracer, PathsDoNotDependOnTheirBatch) {
  const Scene scene =
      scene_of({{icosphere(1, 2), {"paint", Coated{flat(0.6), 1.5, 0.2}}, {0, 0, 1}},
                {rectangle({-1, -1}, {1, 1}), lamp(9, 0.2), {0, 0, 4}}},
               grey(0.5), 0);
  const Sky sky({.dome = EnvironmentImage{.image = "lamp.exr"},
                 .sun = SunSpec{SunAngles{.azimuth_deg = 200, .elevation_deg = 30}}},
                sky_with_a_lamp());
  const PathTracer light(scene, sky, 5, AerialPerspective({.visibility_m = 500}));
  std::vector<Sample> samples;
  for (std::uint32_t i = 0; i < 3000; ++i)
    samples.push_back({ray_to({4, 3, 2}, 2.0 * any_direction(8, i)), SobolPairs(3, i)});
  const auto together = traced(light, samples);
  PathTracer::Workspace work;
  glm::vec3 alone;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    work.add(samples[i].ray, samples[i].numbers);
    light.trace(work, {&alone, 1});
    ASSERT_EQ(alone, together[i]) << i;
  }
}

TEST(PathTracer, RejectsInvalidDepths) {
  const Scene scene = scene_of({});
  const Sky sky = even_sky(1);
  for (const int depth : {-1, 0, 65}) {
    EXPECT_THAT([&] { PathTracer(scene, sky, depth, {}); },
                ThrowsMessage<Error>(HasSubstr("must be from 1 to 64")));
  }
}

}  // namespace
}  // namespace groundray::path_tracer_test
