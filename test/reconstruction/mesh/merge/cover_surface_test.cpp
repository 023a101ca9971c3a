#include "reconstruction/mesh/merge/cover_surface.h"

#include <gtest/gtest.h>

namespace groundray::cover_surface_test {
namespace {

const CoverTolerance limits{.apart_m = 0.1, .least_cosine = 0.5};

TEST(CoverSurface, ClassifiesPointsInsideOnTheBorderAndApart) {
  TriangleMesh mesh{.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}};
  const CoverSurface surface(mesh, {}, limits);
  const auto cover = [&](const glm::dvec3& p, const glm::vec3& normal) {
    return surface.at({.p = p, .normal = normal}, 0, 0).cover;
  };
  EXPECT_EQ(cover({0.2, 0.2, 0.05}, {0, 0, 1}), Cover::Inside);
  EXPECT_EQ(cover({0.2, 0.2, 0.2}, {0, 0, 1}), Cover::None);
  EXPECT_EQ(cover({0.2, 0.2, 0.05}, {0, 0, -1}), Cover::None);
  EXPECT_EQ(cover({0.2, -0.099, 0}, {0, 0, 1}), Cover::Inside);  // within a tenth of its size
  mesh.vertices_m = {{0, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0}};
  const CoverSurface small(mesh, {}, limits);
  EXPECT_EQ(small.at({.p = {0.2, -0.09, 0}, .normal = {0, 0, 1}}, 0, 0).cover, Cover::Border);
}

TEST(CoverSurface, CoversNothingWithoutANormal) {
  // Both sides of a triangle, and a degenerate triangle: area vectors add up to zero.
  for (const std::vector<glm::uvec3>& triangles :
       {std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 1}}, {{0, 0, 0}}}) {
    const TriangleMesh mesh{.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                            .triangles = triangles};
    const CoverSurface surface(mesh, {}, limits);
    for (const float z : {-1.f, 1.f}) {
      const CoverAnswer answer = surface.at({.p = {0, 0, 0}, .normal = {0, 0, z}}, 0, 0);
      EXPECT_EQ(answer.cover, Cover::None);
    }
  }
}

}  // namespace
}  // namespace groundray::cover_surface_test
