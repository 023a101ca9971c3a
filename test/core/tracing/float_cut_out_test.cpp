#include "core/tracing/float_cut_out.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "core/tracing/object_tracer.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::float_cut_out_test {
namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

int integer(Random& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}

// 10^x of a random x.
double magnitude(Random& random, double low, double high) {
  return std::pow(10.0, uniform(random, low, high));
}

glm::dvec3 random_vector(Random& random, double reach) {
  return {uniform(random, -reach, reach), uniform(random, -reach, reach),
          uniform(random, -reach, reach)};
}

// Noise, stripes as fine as texels, and large areas of one value.
Image8 random_image(int channels, Random& random) {
  Image8 image(integer(random, 1, 70), integer(random, 1, 70), channels);
  const int kind = integer(random, 0, 2);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      for (std::uint8_t& value : image.at(x, y)) {
        value = static_cast<std::uint8_t>(kind == 0   ? integer(random, 0, 255)
                                          : kind == 1 ? 255 * ((x + y) % 2)
                                                      : 255 * ((x / 9 + y / 5) % 2));
      }
    }
  }
  return image;
}

// A triangle that an image cuts out, and two specks that widen the model's bounding box.
Model random_model(Random& random) {
  Model model;
  const double size_m = magnitude(random, -3, 3);
  const double box_m = size_m * magnitude(random, 0, 3);
  const glm::dvec3 place_m = random_vector(random, box_m);
  for (int k = 0; k < 3; ++k)
    model.mesh.vertices_m.push_back(place_m + random_vector(random, size_m));
  const double speck_m = 1e-6 * box_m;
  for (const double end_m : {-box_m, box_m}) {
    for (const double off_m : {0.0, speck_m, 2 * speck_m})
      model.mesh.vertices_m.emplace_back(end_m + off_m, end_m - off_m * off_m, end_m);
  }
  model.mesh.triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
  model.surface_of = {0, 1, 1};
  model.surfaces.resize(2);
  ModelSurface& cut = model.surfaces[0];
  const bool is_from_albedo = integer(random, 0, 1) == 0;
  (is_from_albedo ? cut.albedo : cut.opacity).pixels =
      random_image(is_from_albedo ? 2 * integer(random, 1, 2) : integer(random, 1, 4), random);
  constexpr std::array<float, 4> thresholds{0.5f, 128 / 255.0f, 1.0f, 0.01f};
  cut.least_alpha = thresholds[static_cast<std::size_t>(integer(random, 0, 3))];
  const bool is_huge = integer(random, 0, 19) == 0;
  const double spread = is_huge ? 3e38 : magnitude(random, -2, 2);
  const double away = is_huge ? 0 : magnitude(random, -1, 7);
  const bool is_flat = integer(random, 0, 9) == 0;  // a line of the image on the whole triangle
  for (int k = 0; k < 9; ++k) {
    const double u = uniform(random, -spread, spread);
    const double v = is_flat ? u : uniform(random, -spread, spread);
    model.uv.emplace_back(glm::dvec2(away + u, v - away));
  }
  return model;
}

// Rays to points of the triangle and just outside, at all angles, from near and far.
std::vector<Ray> random_rays(const Model& model, int count, Random& random) {
  const auto& p_m = model.mesh.vertices_m;
  const double size_m = glm::distance(p_m[0], p_m[1]);
  const glm::dvec3 normal = glm::normalize(glm::cross(p_m[1] - p_m[0], p_m[2] - p_m[0]));
  std::vector<Ray> rays;
  while (static_cast<int>(rays.size()) < count) {
    const double u = uniform(random, -0.05, 1), v = uniform(random, -0.05, 1);
    if (u + v > 1.05) continue;
    const glm::dvec3 target_m = p_m[0] + u * (p_m[1] - p_m[0]) + v * (p_m[2] - p_m[0]);
    glm::dvec3 direction = random_vector(random, 1);
    if (integer(random, 0, 2) == 0)  // almost along the plane
      direction -= (1 - magnitude(random, -4, -1)) * glm::dot(normal, direction) * normal;
    direction = glm::normalize(direction);
    rays.push_back({target_m - direction * (size_m * magnitude(random, -1, 9)), direction});
  }
  return rays;
}

std::vector<Hit> trace(const Model& model, Tracing tracing, std::span<const Ray> rays) {
  const RayDevice device;
  const ObjectTracer tracer(device, {{device, model, tracing}}, {{}}, {});
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits);
  return hits;
}

// The oracle: fast tracing reports a point exactly if it reports it on the triangle without
// cut-outs, and exact tracing, which knows nothing of floats, reports it with them.
void check_models(int models, int rays_each, Random& random) {
  int opaque = 0, transparent = 0;
  for (int i = 0; i < models; ++i) {
    const Model model = random_model(random);
    Model whole = model;
    whole.surfaces[0].least_alpha = 0;
    const auto rays = random_rays(model, rays_each, random);
    const auto reached = trace(whole, Tracing::Fast, rays);
    const auto exact = trace(model, Tracing::Exact, rays);
    const auto fast = trace(model, Tracing::Fast, rays);
    for (std::size_t r = 0; r < rays.size(); ++r) {
      const bool is_expected = reached[r] && exact[r];
      ASSERT_EQ(static_cast<bool>(fast[r]), is_expected) << "model " << i << " ray " << r;
      if (is_expected) {
        ASSERT_EQ(fast[r].range_m, exact[r].range_m);
      }
      opaque += is_expected ? 1 : 0;
      transparent += reached[r] && !is_expected ? 1 : 0;
    }
  }
  const int traced = models * rays_each;
  EXPECT_GT(opaque, traced / 10);
  EXPECT_GT(transparent, traced / 10);
}

TEST(FloatCutOut, TracesAsExactTracingDoes) {
  Random random(1);
  check_models(200, 5000, random);
}

TEST(FloatCutOutProof, TracesAsExactTracingDoes) {
  Random random(2);
  check_models(static_cast<int>(testing::proof_size(100, 4000)), 20'000, random);
}

// A leaf of 0.1 m, half of it opaque, in a plant of 2 m: only hits at the outline and at the rim
// are left to double.
TEST(FloatCutOut, DecidesAllButHitsNearTheOutline) {
  Model model;
  model.mesh.vertices_m = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}};
  model.mesh.triangles = {{0, 1, 2}};
  model.uv = {{0, 0}, {1, 0}, {0, 1}};
  model.surface_of = {0};
  model.surfaces.resize(1);
  Image8 pixels(64, 64, 2);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) pixels.at(x, y)[1] = x < 16 ? 255 : 0;  // ends at u = 1/4
  }
  const Texture image(pixels, Encoding::Linear, Wrap::Repeat);
  const FloatCutOuts::Source source{&image, 0.5f};
  const std::array<std::uint32_t, 1> triangles{0};
  const FloatCutOuts cut_outs(model, triangles, {&source, 1}, 2);
  const auto at = [&](float u, float v, float slope) {
    return cut_outs.at(0, {0, 0, 1}, {u, v, 1, {0, 0, 0.01f}, {slope, 0, -1}});
  };
  EXPECT_EQ(at(0.2f, 0.3f, 0), CutOut::Opaque);
  EXPECT_EQ(at(0.249f, 0.3f, 0), CutOut::Opaque);
  EXPECT_EQ(at(0.25f, 0.3f, 0), CutOut::Unsure);
  EXPECT_EQ(at(0.251f, 0.3f, 0), CutOut::Transparent);
  EXPECT_EQ(at(0.251f, 0.3f, 1e6f), CutOut::Unsure);  // along the plane
  EXPECT_EQ(at(0.5f, 0.3f, 0), CutOut::Transparent);
  EXPECT_EQ(at(0.5f, 1e-6f, 0), CutOut::Unsure);  // at the rim
  EXPECT_EQ(at(0.2f, 0.8f, 0), CutOut::Unsure);
  EXPECT_EQ(cut_outs.at(0, {0, 0, 1e9}, {0.5f, 0.3f, 1, {0, 0, 0.01f}, {0, 0, -1}}),
            CutOut::Unsure);  // double is too coarse
  EXPECT_EQ(cut_outs.memory_bytes(), 44u + 65 * 65);
}

}  // namespace
}  // namespace groundray::float_cut_out_test
