#include "core/model/displacement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <random>
#include <tuple>

#include "core/error.h"
#include "core/tracing/object_tracer.h"
#include "test/support/scans/solid.h"

namespace groundray::displacement_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double float_error = 1e-6;  // pixels and normals are floats

ImageF image_of(int width, int height, const std::function<float(int, int)>& value) {
  ImageF image(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at(x, y)[0] = value(x, y);
  }
  return image;
}
ImageF constant(float value) {
  return image_of(1, 1, [value](int, int) { return value; });
}
ImageF noise(int side) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform;
  return image_of(side, side, [&](int, int) { return uniform(random); });
}

// A box whose six faces have separate vertices and texture coordinates: every edge is a seam.
Model boxed(const glm::dvec3& sides_m) {
  Model model;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-0.5, 0.5}) {
      const auto first = static_cast<std::uint32_t>(model.mesh.vertices_m.size());
      const glm::length_t u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (const glm::dvec2 corner : {glm::dvec2(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
        glm::dvec3 p;
        p[axis] = side;
        p[u] = corner.x - 0.5;
        p[v] = corner.y - 0.5;
        model.mesh.vertices_m.push_back(p * sides_m);
        model.uv.push_back(0.37f * static_cast<float>(axis) +
                           glm::vec2(corner) * static_cast<float>(1 + axis));
      }
      for (glm::uvec3 t : {glm::uvec3(0, 1, 2), glm::uvec3(0, 2, 3)}) {
        if (side < 0) std::swap(t.y, t.z);
        model.mesh.triangles.push_back(t + first);
        model.surface_of.push_back(0);
      }
    }
  }
  model.surfaces.resize(1);
  return model;
}

Model square(double side_m) {
  Model model;
  model.mesh.vertices_m = {{0, 0, 0}, {side_m, 0, 0}, {side_m, side_m, 0}, {0, side_m, 0}};
  model.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  model.uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  model.surface_of = {0, 0};
  model.surfaces.resize(1);
  return model;
}

using Place = std::tuple<double, double, double>;
Place place_of(const glm::dvec3& p) { return {p.x, p.y, p.z}; }

// True if every edge, identified by the positions of its ends, occurs once in each direction.
bool is_closed(const Model& model) {
  std::map<std::pair<Place, Place>, int> edges;
  const auto& p = model.mesh.vertices_m;
  for (const glm::uvec3& t : model.mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++edges[{place_of(p[t[k]]), place_of(p[t[(k + 1) % 3]])}];
  }
  return std::ranges::all_of(edges, [&](const auto& edge) {
    const auto back = edges.find({edge.first.second, edge.first.first});
    return edge.second == 1 && back != edges.end() && back->second == 1;
  });
}

TEST(Displacement, APlaneFollowsItsImage) {
  // Linear from 0.1 to 0.9 between the centres of two pixels, at u = 1/4 and 3/4.
  const ImageF ramp = image_of(2, 1, [](int x, int) { return x == 0 ? 0.1f : 0.9f; });
  const Model model = displaced(square(2), {ramp, 0.5, 0.2, 0.05});
  int between = 0;
  for (const glm::dvec3& p : model.mesh.vertices_m) {
    const double u = p.x / 2;
    if (u < 0.25 || u > 0.75) continue;
    ++between;
    EXPECT_NEAR(p.z, 0.5 * (0.1 + 0.8 * (u - 0.25) / 0.5 - 0.2), float_error);
  }
  EXPECT_GT(between, 500);
}

TEST(Displacement, EdgesAreHalvedUntilNoneIsLongerThanACell) {
  const Model model = displaced(square(3), {constant(1), 1, 1, 0.1});
  EXPECT_EQ(model.surface_of.size(), model.mesh.triangles.size());
  double area_m2 = 0;
  for (const glm::uvec3& t : model.mesh.triangles) {
    const auto& p = model.mesh.vertices_m;
    for (int k = 0; k < 3; ++k) EXPECT_LE(glm::distance(p[t[k]], p[t[(k + 1) % 3]]), 0.1);
    const double twice_m2 = glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]).z;
    EXPECT_GT(twice_m2, 0);
    area_m2 += twice_m2 / 2;
  }
  EXPECT_NEAR(area_m2, 9, 1e-12);
}

TEST(Displacement, KeepsClosedSurfacesClosedAcrossSeamsAndCreases) {
  const Model box = boxed({1, 0.7, 0.3});
  ASSERT_TRUE(is_closed(box));
  const Model rough = displaced(box, {noise(16), 0.05, 0.5, 0.04});
  EXPECT_GT(rough.mesh.triangles.size(), 3000u);
  EXPECT_TRUE(is_closed(rough));
  EXPECT_NO_THROW(check_model(rough, "box"));
}

TEST(Displacement, ABallGrowsAlongItsNormals) {
  Model ball = testing::icosphere(2, 3);
  ball.uv.assign(ball.mesh.vertices_m.size(), glm::vec2(0));
  for (const glm::dvec3& p : ball.mesh.vertices_m) ball.normals.emplace_back(glm::normalize(p));
  const Model larger = displaced(ball, {constant(1), 0.25, 0, 10});
  ASSERT_EQ(larger.mesh.triangles.size(), ball.mesh.triangles.size());
  for (std::size_t i = 0; i < ball.mesh.vertices_m.size(); ++i) {
    EXPECT_NEAR(glm::length(larger.mesh.vertices_m[i]), 2.25, float_error);
    EXPECT_NEAR(glm::length(larger.normals[i]), 1, float_error);
    EXPECT_GT(glm::dot(glm::dvec3(larger.normals[i]), larger.mesh.vertices_m[i]), 2.2);
  }
}

TEST(Displacement, RaysHitTheDisplacedSurface) {
  const RayDevice device;
  const Model lifted = displaced(square(2), {constant(0.75f), 0.4, 0.25, 0.1});
  for (const Tracing tracing : {Tracing::Fast, Tracing::Exact}) {
    const ObjectTracer tracer(device, {{device, lifted, tracing}}, {{{0, 0, 10}}}, {});
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> at(0, 2);
    for (int i = 0; i < 1000; ++i) {
      const Ray ray{{at(random), at(random), 15}, {0, 0, -1}};
      Hit hit;
      tracer.trace({&ray, 1}, {&hit, 1});
      ASSERT_NEAR(hit.range_m, 4.8, 2e-9);
    }
  }
}

TEST(Displacement, ReportsInvalidArguments) {
  const auto make = [](const Model& model, const Displacement& by) {
    return [model, by] { displaced(model, by); };
  };
  Model bare = square(1);
  bare.uv.clear();
  EXPECT_THAT(make(bare, {constant(0), 1, 0, 1}), ThrowsMessage<Error>(HasSubstr("has no uv")));
  EXPECT_THAT(make(square(1), {constant(0), 0, 0, 1}),
              ThrowsMessage<Error>(HasSubstr("amplitude_m = 0 must be positive")));
  EXPECT_THAT(make(square(1), {constant(0), 1, 0, -1}),
              ThrowsMessage<Error>(HasSubstr("cell_m = -1 must be positive")));
  EXPECT_THAT(
      make(square(100), {constant(0), 1, 0, 0.01}),
      ThrowsMessage<Error>(HasSubstr("result in about 4e+08 triangles, more than 16777216")));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(make(square(1), {constant(nan), 1, 0, 1}), ThrowsMessage<Error>(HasSubstr("finite")));
}

}  // namespace
}  // namespace groundray::displacement_test
