#include "sensors/camera/emitters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <utility>

#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "core/image/luminance.h"
#include "core/random.h"
#include "terrain/terrain_scene.h"
#include "test/support/scans/solid.h"

namespace groundray::emitters_test {
namespace {

using std::chrono::milliseconds;
using ::testing::AllOf;
using testing::box_model;
using ::testing::HasSubstr;
using testing::icosphere;
using ::testing::ThrowsMessage;

Material lamp(const glm::dvec3& radiance) {
  return {"lamp", Lambertian{{{300, 0.5}, {2500, 0.5}}}, radiance};
}

// A box at rest, 2 wide, a moving ball and a dark object, with these materials.
Scene scene_of(const glm::dvec3& box, const glm::dvec3& ball, const glm::dvec3& ground = {}) {
  const RayDevice device;
  const Trajectory path({{milliseconds(0), {{1, 0, 0, 0}, {0, 9, 5}}},
                         {milliseconds(1000), {{1, 0, 0, 0}, {0, 19, 5}}}});
  const HeightGrid heights{{2, 2}, {-100, -100}, {200, 200}, std::vector<float>(4, 0.0f)};
  const glm::dquat turn = glm::angleAxis(1.0, glm::normalize(glm::dvec3(1, 2, 3)));
  return {RayTracer({full_resolution_level(heights)}, {0, 0, 0}, Tracing::Fast),
          {},
          {lamp(ground), lamp(box), lamp(ball), lamp({})},
          ObjectTracer(device,
                       {{device, box_model({1, 1, 1}), Tracing::Fast},
                        {device, icosphere(1, 1), Tracing::Fast},
                        {device, icosphere(1, 1), Tracing::Fast}},
                       {{{5, 0, 5}, turn, 2, 0}, {{-5, 0, 5}, turn, 1, 2}}, {{path, 0.5, 1}}),
          {{1, {1}}, {2, {2}}, {3, {3}}}};
}

double area_m2(const Model& model) {
  double sum = 0;
  for (const glm::uvec3& t : model.mesh.triangles) {
    const auto& p = model.mesh.vertices_m;
    sum += glm::length(glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x])) / 2;
  }
  return sum;
}

glm::dvec2 uniform(std::uint32_t stream, std::uint32_t index) {
  return random_uniform({.seed = {4}, .sensor = stream, .pulse = index});
}

TEST(Emitters, AreSampledByAreaTimesLuminance) {
  const glm::dvec3 red(5, 0, 0), green(0, 1, 0);
  const Emitters emitters(scene_of(red, green));
  const double box_m2 = 6 * 4, ball_m2 = area_m2(icosphere(1, 1)) / 4;
  const double box_power = box_m2 * luminance(red), ball_power = ball_m2 * luminance(green);
  constexpr int count = 100'000;
  int of_box = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto point = emitters.draw(uniform(1, i), uniform(2, i), milliseconds(0));
    of_box += point.glow.radiance == red;
    const double expected = luminance(point.glow.radiance) / (box_power + ball_power);
    ASSERT_NEAR(point.glow.pdf_per_m2, expected, 1e-12 * expected);
  }
  const double share = box_power / (box_power + ball_power);
  // Three and a half standard errors: 0.05 %.
  EXPECT_NEAR(of_box, share * count, 3.5 * std::sqrt(count * share * (1 - share)));
}

// A ray to the sampled point hits a surface there that has the sampled point's radiance.
TEST(Emitters, SamplesLieOnTheirObjects) {
  const Scene scene = scene_of({2, 2, 2}, {0, 3, 0});
  const Emitters emitters(scene);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const milliseconds time(i % 1000);
    const auto [p_DQ, normal, glow] = emitters.draw(uniform(3, i), uniform(4, i), time);
    EXPECT_NEAR(glm::length(normal), 1, 1e-12);
    const bool is_ball = glow.radiance.g == 3;
    const glm::dvec3 middle =
        is_ball ? glm::dvec3(0, 9 + 0.01 * (i % 1000), 5) : glm::dvec3(5, 0, 5);
    EXPECT_LE(glm::distance(p_DQ, middle), is_ball ? 0.5 + 1e-9 : std::sqrt(3.0) + 1e-9);
    const glm::dvec3 out = glm::dot(normal, p_DQ - middle) < 0 ? -normal : normal;
    const Ray ray{p_DQ + out, -out, 2, time};
    Hit hit;
    scene.trace({&ray, 1}, {&hit, 1});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit.range_m, 1, 1e-8);
    EXPECT_EQ(emitters.glow_of(hit).radiance, glow.radiance);
    EXPECT_EQ(emitters.glow_of(hit).pdf_per_m2, glow.pdf_per_m2);
  }
}

TEST(Emitters, AreEmptyWithoutEmission) {
  const Emitters emitters(scene_of({}, {}));
  EXPECT_FALSE(emitters.any_shines());
  EXPECT_FALSE(emitters.any_is_drawn());
}

// Cut-out holes do not emit, and only rays can detect them.
TEST(Emitters, WithCutOutsEmitButAreNotSampled) {
  const RayDevice device;
  Model leafy = box_model({1, 1, 1});
  leafy.uv.assign(leafy.mesh.vertices_m.size(), {0, 0});
  leafy.surfaces[0].albedo.pixels = Image8(1, 1, 4);
  const HeightGrid heights{{2, 2}, {-100, -100}, {200, 200}, std::vector<float>(4, 0.0f)};
  const Scene scene{RayTracer({full_resolution_level(heights)}, {0, 0, 0}, Tracing::Fast),
                    {},
                    {lamp({}), lamp({1, 1, 1})},
                    ObjectTracer(device, {{device, leafy, Tracing::Fast}}, {{}}, {}),
                    {{1, {1}}}};
  const Emitters emitters(scene);
  EXPECT_TRUE(emitters.any_shines());
  EXPECT_FALSE(emitters.any_is_drawn());
  const auto glow = emitters.glow_of({.object = 1});
  EXPECT_EQ(glow.radiance, glm::dvec3(1));
  EXPECT_EQ(glow.pdf_per_m2, 0);
}

TEST(Emitters, ExcludeTheGround) {
  EXPECT_THAT(
      [] {
        Emitters(scene_of({}, {}, {0, 1, 0}));
      },
      ThrowsMessage<Error>(
          HasSubstr("the ground has material 'lamp', which emits light, but only objects")));
}

TEST(Emitters, RejectUnknownMaterials) {
  Scene scene = scene_of({}, {});
  scene.models[1].materials[0] = 8;
  scene.models.pop_back();
  EXPECT_THAT([&] { Emitters{scene}; },
              ThrowsMessage<Error>(
                  AllOf(HasSubstr("surface 0 of model 1 has material 8, but the scene has 4"),
                        HasSubstr("surface 0 of model 2 has no material"))));
}

TEST(Emitters, ReadEmissionFromTheMaterialFile) {
  const std::string head =
      "groundray_material: 1\nname: lamp\n"
      "spectrum: {wavelengths_nm: [400, 700], reflectances: [0.1, 0.1]}\n";
  EXPECT_EQ(parse_material(head, "a.yaml").emitted, glm::dvec3(0));
  EXPECT_EQ(parse_material(head + "emission_w_m2_sr: [3, 2.5, 0]\n", "a.yaml").emitted,
            glm::dvec3(3, 2.5, 0));
  EXPECT_THAT([&] { parse_material(head + "emission_w_m2_sr: [3, -2, 0]\n", "a.yaml"); },
              ThrowsMessage<Error>(
                  AllOf(HasSubstr("a.yaml:4:"), HasSubstr("emission_w_m2_sr"), HasSubstr(">= 0"))));
  EXPECT_THAT([&] { parse_material(head + "emission_w_m2_sr: [3, 2]\n", "a.yaml"); },
              ThrowsMessage<Error>(HasSubstr("a.yaml:4:")));
}

TEST(Emitters, RejectNegativeAndNonFiniteEmission) {
  for (const double wrong : {-1.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_THAT(
        [&] {
          check_material(lamp({1, wrong, 1}));
        },
        ThrowsMessage<Error>(HasSubstr("emitted[1]")));
  }
}

}  // namespace
}  // namespace groundray::emitters_test
