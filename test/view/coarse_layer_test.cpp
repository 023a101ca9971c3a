#include "apps/view/coarse_layer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "apps/view/mesh_layer.h"

namespace groundray {
namespace {

Layer numbered_points(std::size_t count) {
  Layer layer{.name = "cloud", .kind = LayerKind::Cloud, .data = make_points(count)};
  std::vector<float> number(count);
  const auto places = coordinates(*layer.data);
  for (std::size_t i = 0; i < count; ++i) {
    number[i] = static_cast<float>(i);
    places[3 * i] = static_cast<float>(i);
  }
  add_column(layer, {.name = "number", .unit = ""}, number);
  return layer;
}

std::set<float> numbers_in(vtkPolyData& data) {
  vtkDataArray& column = *data.GetPointData()->GetArray("number");
  std::set<float> numbers;
  for (vtkIdType i = 0; i < column.GetNumberOfTuples(); ++i) {
    numbers.insert(static_cast<float>(column.GetComponent(i, 0)));
    EXPECT_EQ(column.GetComponent(i, 0), data.GetPoint(i)[0]);  // they stay with their points
  }
  return numbers;
}

TEST(CoarseLayer, ThinsPointsAboutEvenly) {
  const Layer cloud = numbered_points(100'000);
  const auto few = thin_points(cloud, 10'000);
  // Binomial: sd 95; 6 of them.
  EXPECT_NEAR(static_cast<double>(few->GetNumberOfPoints()), 10'000, 570);
  const std::set<float> numbers = numbers_in(*few);
  const auto first_half = std::distance(numbers.begin(), numbers.lower_bound(50'000));
  EXPECT_NEAR(static_cast<double>(first_half), 5'000, 420);
}

TEST(CoarseLayer, MorePointsHoldTheFewer) {
  const Layer cloud = numbered_points(20'000);
  const std::set<float> few = numbers_in(*thin_points(cloud, 1'000));
  const std::set<float> more = numbers_in(*thin_points(cloud, 5'000));
  EXPECT_TRUE(std::ranges::includes(more, few));
  EXPECT_EQ(numbers_in(*thin_points(cloud, 20'000)).size(), 20'000u);
}

// A sphere of radius 1: its thinned surface is made of its own vertices, all round.
TEST(CoarseLayer, ThinsASphereToOne) {
  TriangleMesh sphere;
  constexpr int rings = 120, steps = 240;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j < steps; ++j) {
      const double polar = 3.14159265 * i / rings, turn = 2 * 3.14159265 * j / steps;
      sphere.vertices_m.emplace_back(std::sin(polar) * std::cos(turn),
                                     std::sin(polar) * std::sin(turn), std::cos(polar));
    }
  }
  const auto at = [](int i, int j) { return static_cast<std::uint32_t>(i * steps + j % steps); };
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < steps; ++j) {
      sphere.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      sphere.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  const Layer layer = mesh_layer("sphere", sphere, glm::dvec3(0));
  const auto thinned = thin_triangles(layer, 5'000);
  EXPECT_LE(thinned->GetNumberOfPolys(), 5'000);
  EXPECT_GT(thinned->GetNumberOfPolys(), 1'500);
  EXPECT_NE(thinned->GetPointData()->GetArray("height"), nullptr);
  EXPECT_NE(thinned->GetPointData()->GetNormals(), nullptr);
  std::array<double, 6> bounds{};
  thinned->GetBounds(bounds.data());
  for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(std::abs(bounds[k]), 1, 0.1);
  for (vtkIdType i = 0; i < thinned->GetNumberOfPoints(); ++i) {
    const double* const p = thinned->GetPoint(i);
    ASSERT_NEAR(std::hypot(p[0], p[1], p[2]), 1, 1e-5);
  }
  EXPECT_EQ(thin_triangles(layer, sphere.triangles.size()), layer.data);
}

}  // namespace
}  // namespace groundray
