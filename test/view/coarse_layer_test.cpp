#include "apps/view/rendering/coarse_layer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <set>

#include "apps/view/layers/mesh_layer.h"

namespace groundray::coarse_layer_test {
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
    EXPECT_EQ(column.GetComponent(i, 0), data.GetPoint(i)[0]);  // values stay with their points
  }
  return numbers;
}

TEST(CoarseLayer, ThinsPointsRoughlyEvenly) {
  const Layer cloud = numbered_points(100'000);
  const auto few = thin_points(cloud, 10'000);
  // Binomial distribution with a standard deviation of 95; the tolerance is 6 of them.
  EXPECT_NEAR(static_cast<double>(few->GetNumberOfPoints()), 10'000, 570);
  const std::set<float> numbers = numbers_in(*few);
  const auto first_half = std::distance(numbers.begin(), numbers.lower_bound(50'000));
  EXPECT_NEAR(static_cast<double>(first_half), 5'000, 420);
}

TEST(CoarseLayer, LargerSubsetContainsTheSmaller) {
  const Layer cloud = numbered_points(20'000);
  const std::set<float> few = numbers_in(*thin_points(cloud, 1'000));
  const std::set<float> more = numbers_in(*thin_points(cloud, 5'000));
  EXPECT_TRUE(std::ranges::includes(more, few));
  EXPECT_EQ(numbers_in(*thin_points(cloud, 20'000)).size(), 20'000u);
}

TEST(CoarseLayer, KeepsSmallCloudsComplete) {
  const Layer cloud = numbered_points(400);
  EXPECT_EQ(thin_points(cloud, 0), cloud.data);
  EXPECT_EQ(thin_points(Layer{.name = "none", .data = make_points(0)}, 0)->GetNumberOfPoints(), 0);
}

// Triangles on a grid of columns x rows points with heights height(column, row).
template <typename Height>
Layer relief(int columns, int rows, double step_m, const glm::dvec3& low, const Height& height) {
  TriangleMesh mesh;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column)
      mesh.vertices_m.push_back(low +
                                glm::dvec3(column * step_m, row * step_m, height(column, row)));
  }
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      const auto a = static_cast<std::uint32_t>(row * columns + column);
      const auto up = static_cast<std::uint32_t>(columns);
      mesh.triangles.emplace_back(a, a + 1, a + up);
      mesh.triangles.emplace_back(a + 1, a + up + 1, a + up);
    }
  }
  return mesh_layer("relief", mesh, glm::dvec3(0));
}

double area_m2(vtkPolyData& data) {
  const auto at = coordinates(data);
  const auto corner = corners(data);
  double area = 0;
  for (std::size_t i = 0; i + 2 < corner.size(); i += 3) {
    std::array<glm::dvec3, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto first = std::size_t{3} * static_cast<std::size_t>(corner[i + k]);
      p[k] = {at[first], at[first + 1], at[first + 2]};
    }
    area += glm::length(glm::cross(p[1] - p[0], p[2] - p[0])) / 2;
  }
  return area;
}

// A plane through all quadrants round the origin, and the same plane far away. At most the
// requested number of triangles remains, and at least a quarter of it; they cover the plane except
// for one cell at its boundary.
TEST(CoarseLayer, KeepsPlanesWithoutGaps) {
  for (const double low_m : {-40.0, 0.0, 1e5}) {
    const Layer plane = relief(201, 201, 0.4, glm::dvec3(low_m), [](int, int) { return 0.0; });
    for (const std::size_t most : {0U, 700U, 5'000U, 30'000U}) {
      const auto thinned = thin_triangles(plane, most);
      const std::size_t limit = std::max(most, fewest_elements);
      const auto kept = static_cast<std::size_t>(thinned->GetNumberOfPolys());
      EXPECT_LE(kept, limit);
      EXPECT_GE(kept, limit / 4);
      const double cell_m = 80 / std::sqrt(static_cast<double>(limit) / 8);
      EXPECT_NEAR(area_m2(*thinned), 6400, 4 * 80 * cell_m);
      EXPECT_LE(area_m2(*thinned), 6400 * 1.001);
    }
  }
}

// Spikes have much more area than their grid has cells. No limit removes all of them.
TEST(CoarseLayer, KeepsRoughSurfaces) {
  const Layer rough = relief(150, 150, 0.1, {-7, -7, 0}, [](int column, int row) {
    return (column * 7 + row * 13) % 11 * 0.3;
  });
  for (const std::size_t most : {1U, 2'000U, 20'000U}) {
    const std::size_t limit = std::max(most, fewest_elements);
    const auto kept = static_cast<std::size_t>(thin_triangles(rough, most)->GetNumberOfPolys());
    EXPECT_LE(kept, limit);
    EXPECT_GE(kept, limit / 8);
  }
}

// A thousand tetrahedra of 10 cm on a square kilometre, each smaller than any cell that would meet
// the limit.
TEST(CoarseLayer, KeepsObjectsSmallerThanACell) {
  TriangleMesh posts;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const glm::dvec3 foot(i % 32 * 31, i / 32 * 31, 0);
    for (const glm::dvec3& p :
         {glm::dvec3(0), glm::dvec3(0.1, 0, 0), glm::dvec3(0, 0.1, 0), glm::dvec3(0, 0, 0.1)})
      posts.vertices_m.push_back(foot + p);
    for (const glm::uvec3& t :
         {glm::uvec3(0, 2, 1), glm::uvec3(0, 1, 3), glm::uvec3(1, 2, 3), glm::uvec3(0, 3, 2)})
      posts.triangles.push_back(t + 4 * i);
  }
  const Layer layer = mesh_layer("posts", posts, glm::dvec3(0));
  const auto thinned = thin_triangles(layer, 600);
  EXPECT_LE(thinned->GetNumberOfPolys(), 600);
  EXPECT_GT(thinned->GetNumberOfPolys(), 600 / 8);
  std::array<double, 6> bounds{};
  thinned->GetBounds(bounds.data());
  EXPECT_GT(bounds[1] - bounds[0], 760);  // of 961 m
  EXPECT_GT(bounds[3] - bounds[2], 760);
  // A mesh with few triangles is drawn unchanged.
  posts.triangles.resize(60);
  const Layer few = mesh_layer("few", posts, glm::dvec3(0));
  EXPECT_EQ(thin_triangles(few, 0), few.data);
}

// Degenerate triangles, without extent or area, define no cell size.
TEST(CoarseLayer, AcceptsDegenerateTriangles) {
  for (const double length_m : {0.0, 1e-30, 3.0}) {
    TriangleMesh line;
    for (std::uint32_t i = 0; i < 3000; ++i) {
      line.vertices_m.emplace_back(i % 3 * length_m, 0, 0);
      if (i % 3 == 0) line.triangles.emplace_back(i, i + 1, i + 2);
    }
    Layer layer{.name = "line", .kind = LayerKind::Mesh, .data = make_points(3000)};
    const auto at = coordinates(*layer.data);
    for (std::size_t i = 0; i < 3000; ++i) at[3 * i] = static_cast<float>(line.vertices_m[i].x);
    set_triangles(*layer.data, line.triangles);
    const auto thinned = thin_triangles(layer, 700);
    EXPECT_LE(thinned->GetNumberOfPolys(), 700);
    EXPECT_GT(thinned->GetNumberOfPolys(), 0);
  }
}

// A sphere of radius 1: the thinned surface uses only its vertices and covers it on all sides.
TEST(CoarseLayer, ThinnedSphereRemainsASphere) {
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
}  // namespace groundray::coarse_layer_test
