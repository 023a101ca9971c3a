// Appearance of surfaces where rays hit them.
#include "core/tracing/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "terrain/terrain_scene.h"

namespace groundray::scene_test {
namespace {

using std::chrono::milliseconds;

HeightGrid flat_ground() {
  return {{2, 2}, {-2000, -2000}, {4000, 4000}, std::vector<float>(4, -1000.0f)};
}

// A square of 2 m that stands in the y-z plane and faces x; u along y, v along z. Its albedo is
// `grey`, one row of texels.
Model board(std::initializer_list<std::uint8_t> grey) {
  Model model;
  model.mesh.vertices_m = {{0, -1, -1}, {0, 1, -1}, {0, 1, 1}, {0, -1, 1}};
  model.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  model.uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  model.surface_of = {0, 0};
  model.surfaces.resize(1);
  if (grey.size() > 0) {
    Image8 image(static_cast<int>(grey.size()), 1, 1);
    std::ranges::copy(grey, image.values().begin());
    model.surfaces[0].albedo.pixels = std::move(image);
  }
  return model;
}

// A normal map of one texel.
Image8 bump_map(std::uint8_t x, std::uint8_t y, std::uint8_t z) {
  Image8 image(1, 1, 3);
  std::ranges::copy(std::initializer_list<std::uint8_t>{x, y, z}, image.values().begin());
  return image;
}

Scene scene_of(Model model, const PlacedObject& place, Tracing tracing = Tracing::Fast) {
  const RayDevice device;
  std::vector<ModelScene> models;
  models.emplace_back(device, std::move(model), tracing);
  return {RayTracer({full_resolution_level(flat_ground())}, {0, 0, 0}, tracing),
          {},
          {},
          {device, std::move(models), {place}, {}},
          {{7, {1}}}};
}

struct Look {
  Ray ray;
  Hit hit;
};
Look look_at(const Scene& scene, const glm::dvec3& origin, const glm::dvec3& target) {
  Look look{{origin, glm::normalize(target - origin)}, {}};
  scene.trace({&look.ray, 1}, {&look.hit, 1});
  return look;
}

double linear(int byte) {  // IEC 61966-2-1
  const double v = byte / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

// Placements of an object, near the origin and at UTM-sized coordinates, rotated and scaled.
std::vector<PlacedObject> places() {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<PlacedObject> all{{}};
  for (int i = 0; i < 20; ++i) {
    all.push_back(
        {{500'000.0 * i / 20, -5e6 * i / 20, 100},
         glm::normalize(glm::dquat(normal(random), normal(random), normal(random), normal(random))),
         std::exp(normal(random)),
         0});
  }
  return all;
}

TEST(Scene, AlbedoImagesFollowTheirObjectsPose) {
  // Texel boundaries lie at y = -0.5, 0 and 0.5.
  const double a = linear(40), b = linear(200), mean = (2 * a + 2 * b) / 4;
  for (const PlacedObject& place : places()) {
    const Scene scene = scene_of(board({40, 40, 200, 200}), place);
    const auto brightness = [&](double y, double z) {
      const auto at = [&](const glm::dvec3& p_O) {
        return place.p_DO + place.R_DO * (p_O * place.scale);
      };
      const Look look = look_at(scene, at({5, 1, 2}), at({0, y, z}));
      const Appearance seen = scene.appearance_of(look.ray, look.hit, 0, Filtering::Exact);
      EXPECT_EQ(seen.count, 1u);
      EXPECT_EQ(seen.parts[0].material, 1);
      EXPECT_EQ(seen.parts[0].share, 1);
      return seen.parts[0].tint.brightness;
    };
    // Positions at 5e6 m are known to 1e-9 m, and tints are floats.
    EXPECT_NEAR(brightness(-0.01, 0.3), a / mean, 1e-6);
    EXPECT_NEAR(brightness(0.01, -0.9), b / mean, 1e-6);
    EXPECT_NEAR(brightness(0.9, 0.6), b / mean, 1e-6);
  }
}

TEST(Scene, MeanBrightnessCoversOnlyTheMappedPartOfAnImage) {
  Model model = board({40, 40, 200, 200});
  for (glm::vec2& uv : model.uv) uv.x = 0.2f + 0.1f * uv.x;  // inside the dark half
  const Scene scene = scene_of(std::move(model), {});
  const Look look = look_at(scene, {5, 0, 0}, {0, 0.2, 0.3});
  EXPECT_NEAR(scene.appearance_of(look.ray, look.hit, 0, Filtering::Exact).parts[0].tint.brightness,
              1, 1e-6);
}

TEST(Scene, WideRaysSeeTheMeanOverTheirFootprint) {
  const Scene scene = scene_of(board({40, 200}), {});
  const Look look = look_at(scene, {1000, 0, 0}, {0, 0, 0});
  const double both = (linear(40) + linear(200)) / 2;
  const auto tint = scene.appearance_of(look.ray, look.hit, 2, Filtering::Exact)
                        .parts[0]
                        .tint;  // the whole board
  EXPECT_NEAR(tint.brightness, both / both, 1e-6);
  const Look left = look_at(scene, {1000, -0.5, 0}, {0, -0.5, 0});
  EXPECT_NEAR(scene.appearance_of(left.ray, left.hit, 1, Filtering::Exact).parts[0].tint.brightness,
              linear(40) / both, 1e-6);
}

TEST(Scene, BumpsChangeOnlyTheShadingNormal) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    Model bumpy = board({});
    bumpy.surfaces[0].normal.pixels = bump_map(200, 90, 220);
    for (const PlacedObject& place : places()) {
      const Scene plain_scene = scene_of(board({}), place, tracing);
      const Scene bumpy_scene = scene_of(bumpy, place, tracing);
      // 2 c - 1 of the texel, on the board: u is y, v is z, and the surface normal is x.
      const glm::dvec3 bump =
          glm::normalize(2.0 * glm::dvec3(220, 200, 90) / 255.0 - glm::dvec3(1));
      for (int i = 0; i < 20; ++i) {
        const glm::dvec3 from_O(3, uniform(random), uniform(random));
        const glm::dvec3 to_O(0, uniform(random), uniform(random));
        const glm::dvec3 origin = place.p_DO + place.R_DO * (from_O * place.scale);
        const glm::dvec3 target = place.p_DO + place.R_DO * (to_O * place.scale);
        const Look plain = look_at(plain_scene, origin, target);
        const Look bumped = look_at(bumpy_scene, origin, target);
        ASSERT_TRUE(plain.hit);
        EXPECT_EQ(plain.hit.range_m, bumped.hit.range_m);
        EXPECT_EQ(plain.hit.normal, bumped.hit.normal);
        const auto shaded = [](const Scene& scene, const Look& look) {
          return scene.look_at(look.ray, look.hit, 0.01, Filtering::Exact).shading_normal;
        };
        const glm::dvec3 facet = place.R_DO * glm::dvec3(1, 0, 0);
        EXPECT_LT(glm::distance(shaded(plain_scene, plain), facet), 1e-6);
        EXPECT_LT(glm::distance(shaded(bumpy_scene, bumped), place.R_DO * bump), 1e-6);
      }
    }
  }
}

TEST(Scene, VertexNormalsAreInterpolated) {
  Model model = board({});
  const glm::vec3 left = glm::normalize(glm::vec3(1, -0.5f, 0));
  const glm::vec3 right = glm::normalize(glm::vec3(1, 0.5f, 0));
  model.normals = {left, right, right, left};
  const Scene scene = scene_of(std::move(model), {});
  for (const double y : {-0.9, -0.2, 0.6}) {
    for (const double from : {5.0, -5.0}) {  // surfaces have two sides
      const Look look = look_at(scene, {from, 0.3, 0.1}, {0, y, 0.4});
      const glm::dvec3 mixed =
          glm::normalize((1 - y) / 2 * glm::dvec3(left) + (1 + y) / 2 * glm::dvec3(right));
      const glm::dvec3 expected = from > 0 ? mixed : -mixed;
      EXPECT_LT(glm::distance(scene.look_at(look.ray, look.hit, 0, Filtering::Exact).shading_normal,
                              expected),
                1e-6);
    }
  }
}

TEST(Scene, GroundTruthNamesTheLayerWithTheLargestShare) {
  Scene scene{RayTracer({full_resolution_level(flat_ground())}, {0, 0, 0}, Tracing::Fast), {}};
  const auto mask =
      std::make_shared<const Drape>(Drape{[] {
                                            ImageF image(2, 1, 1);
                                            image.at(1, 0)[0] = 1;
                                            return Texture(std::move(image), Wrap::Clamp);
                                          }(),
                                          {-100, -100},
                                          {200, 200}});
  scene.cover = GroundCover(
      {{.material = 2, .label = 20}, {.material = 5, .label = 50, .height_m = {}, .mask = mask}},
      nullptr, {});
  for (const auto& [x, label, material, share] :
       {std::tuple{-80.0, 20, 2, 1.0}, {-10.0, 20, 2, 0.6}, {10.0, 50, 5, 0.6}}) {
    const Look look = look_at(scene, {x, 0, 0}, {x, 0, -1});
    const SurfaceTruth truth = scene.truth_of(look.ray, look.hit);
    EXPECT_EQ(truth.label, label);
    EXPECT_EQ(truth.material, material);
    EXPECT_EQ(truth.instance, 0u);
    const Appearance seen = scene.appearance_of(look.ray, look.hit, 0, Filtering::Fast);
    const auto largest =
        std::ranges::max_element(seen.parts.begin(), seen.parts.begin() + seen.count, {},
                                 [](const Appearance::Part& part) { return part.share; });
    EXPECT_EQ(largest->material, material);
    EXPECT_NEAR(largest->share, share, 1e-6);
  }
}

}  // namespace
}  // namespace groundray::scene_test
