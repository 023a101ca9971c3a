#include "terrain/judge/mesh_deviation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <random>

#include "terrain/judge/mesh_topology.h"
#include "test/support/terrain/adversarial_terrain.h"
#include "test/support/terrain/reference_tracer.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::testing::mesh_deviation_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct SampleMesh {
  std::vector<glm::ivec2> vertices;
  std::vector<glm::uvec3> triangles;
};

// The reference surface itself as a mesh.
SampleMesh facets_of(const HeightGrid& grid) {
  SampleMesh mesh;
  std::vector<int> index(grid.heights_m().size(), -1);
  const auto number_of = [&](glm::ivec2 p) {
    const int sample = p.y * grid.columns() + p.x;
    int& number = index[static_cast<std::size_t>(sample)];
    if (number < 0) {
      number = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(p);
    }
    return static_cast<std::uint32_t>(number);
  };
  for (int row = 0; row + 1 < grid.rows(); ++row) {
    for (int column = 0; column + 1 < grid.columns(); ++column) {
      const glm::ivec2 p(column, row);
      const std::array<glm::ivec2, 4> corner{p, p + glm::ivec2(1, 0), p + glm::ivec2(0, 1),
                                             p + glm::ivec2(1, 1)};
      for (const glm::ivec3& of : {glm::ivec3(0, 1, 2), glm::ivec3(3, 2, 1)}) {
        const auto at = [&](int i) { return corner[static_cast<std::size_t>(of[i])]; };
        const auto missing = [&](int i) { return std::isnan(grid.height_m(at(i).x, at(i).y)); };
        if (missing(0) || missing(1) || missing(2)) continue;
        mesh.triangles.emplace_back(number_of(at(0)), number_of(at(1)), number_of(at(2)));
      }
    }
  }
  return mesh;
}

std::vector<std::string> faults_of(const HeightGrid& grid, const SampleMesh& mesh) {
  return judge::topology_faults(grid, mesh.vertices, mesh.triangles);
}

TEST(MeshDeviation, ReferenceSurfaceHasNoFaultsAndNoDeviation) {
  for (const auto& [name, grid] : adversarial_terrain()) {
    SCOPED_TRACE(name);
    const SampleMesh mesh = facets_of(grid);
    EXPECT_THAT(faults_of(grid, mesh), IsEmpty());
    const judge::MeshDeviation found =
        judge::largest_deviation(grid, mesh.vertices, mesh.triangles);
    EXPECT_EQ(found.largest_m, 0);
    EXPECT_EQ(found.rms_m, 0);
    EXPECT_EQ(found.over_missing, 0u);
    EXPECT_EQ(found.samples, mesh.vertices.size());
  }
}

TEST(MeshDeviation, CellSplitAlongTheOtherDiagonalDeviatesMostAtItsCentre) {
  const HeightGrid grid({2, 2}, {0, 0}, {1, 1}, {1, 2, 4, 16});
  const std::vector<glm::ivec2> vertices{{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  const std::vector<glm::uvec3> triangles{{0, 1, 3}, {0, 3, 2}};
  const judge::MeshDeviation found = judge::largest_deviation(grid, vertices, triangles);
  EXPECT_EQ(found.largest_m, (1 + 16) / 2.0 - (2 + 4) / 2.0);
  EXPECT_EQ(found.place, glm::dvec2(0.5, 0.5));
  EXPECT_EQ(found.samples, 4u);
  EXPECT_EQ(found.rms_m, 0);
  EXPECT_THAT(judge::topology_faults(grid, vertices, triangles), IsEmpty());
}

TEST(MeshDeviation, AllowedDeviationIsEvaluatedOnTheReferenceSurface) {
  const HeightGrid grid({2, 2}, {0, 0}, {1, 1}, {1, 2, 4, 16});
  const std::vector<glm::ivec2> vertices{{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  const std::vector<glm::uvec3> triangles{{0, 1, 3}};
  const auto allowed_m = [](const glm::dvec3& p) { return 10 * p.x * p.y + p.z; };
  const judge::MeshDeviation found = judge::largest_deviation(grid, vertices, triangles, allowed_m);
  EXPECT_EQ(found.largest_excess_m, std::max({5.5 - (2.5 + 3), 0 - 1.0, 0 - 2.0, 0 - 26.0}));
}

// Random points of random triangles, including slivers, over noise: none deviates by more than the
// reported maximum, and the mesh reaches that maximum at the reported position.
TEST(MeshDeviation, NoPointOfATriangleExceedsTheLargestDeviation) {
  constexpr double tolerance_m = 1e-12;  // roundings of the points' coordinates, slopes below 100
  const HeightGrid noise = white_noise({40, 30}, 50, Seed{9});
  const glm::dvec2 step_m = noise.step_m();
  std::mt19937_64 random(4);
  std::uniform_int_distribution<int> column(0, 39), row(0, 29);
  std::uniform_real_distribution<double> share(0, 1);
  double reached = 0;
  int trials = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<glm::ivec2> t;
    for (int i = 0; i < 3; ++i) t.emplace_back(column(random), row(random));
    if (trial % 3 == 0) t[2] = t[1] + glm::ivec2(t[1].x < 39 ? 1 : -1, 0);
    const glm::dmat3 m(glm::dvec3(t[0], 1), glm::dvec3(t[1], 1), glm::dvec3(t[2], 1));
    if (std::abs(glm::determinant(m)) < 0.5) continue;
    const auto deviation_m = [&](const glm::dvec3& weights) {
      glm::dvec2 place(0);
      double height_m = 0;
      for (int i = 0; i < 3; ++i) {
        const glm::ivec2 p = t[static_cast<std::size_t>(i)];
        place += weights[i] * glm::dvec2(p);
        height_m += weights[i] * noise.height_m(p.x, p.y);
      }
      place = glm::clamp(place, glm::dvec2(0), glm::dvec2(39, 29));
      const glm::dvec2 point_m = noise.origin_m() + place * step_m;
      return std::abs(height_m - reference_height_m(noise, point_m.x, point_m.y));
    };
    const std::vector<glm::uvec3> one{{0, 1, 2}};
    const judge::MeshDeviation found = judge::largest_deviation(noise, t, one);
    double most_m = 0;
    for (int i = 0; i < 2000; ++i) {
      const double a = std::sqrt(share(random));
      const double b = share(random);
      most_m = std::max(most_m, deviation_m({1 - a, a * (1 - b), a * b}));
    }
    EXPECT_LE(most_m, found.largest_m + tolerance_m);
    if (found.largest_m == 0) continue;  // it is a facet
    const glm::dvec3 weights = glm::inverse(m) * glm::dvec3(found.place, 1);
    EXPECT_GE(std::min({weights.x, weights.y, weights.z}), -1e-12);
    EXPECT_NEAR(deviation_m(weights), found.largest_m, 1e-10);
    reached += most_m / found.largest_m;
    ++trials;
  }
  EXPECT_GT(trials, 250);
  EXPECT_GT(reached / trials,
            0.8);  // the points come close to the maximum, so it is not much too large
}

TEST(MeshDeviation, TrianglesOverMissingFacetsAreCounted) {
  std::vector<float> heights(25, 1);
  heights[2 * 5 + 3] = std::numeric_limits<float>::quiet_NaN();  // (3, 2): six facets are missing
  const HeightGrid grid({5, 5}, {0, 0}, {1, 1}, heights);
  const std::vector<glm::ivec2> vertices{{0, 0}, {4, 0}, {0, 4}, {4, 4}, {2, 2}, {2, 1}, {2, 3}};
  const auto over_missing = [&](const std::vector<glm::uvec3>& triangles) {
    return judge::largest_deviation(grid, vertices, triangles).over_missing;
  };
  EXPECT_EQ(over_missing({{1, 3, 2}}), 1u);
  // The facet (2, 2) (3, 1) (3, 2) is missing; its neighbour across the edge from (2, 2) to (3, 1)
  // exists.
  EXPECT_EQ(over_missing({{0, 1, 2}}), 0u);
  EXPECT_EQ(over_missing({{0, 4, 6}, {0, 5, 4}, {2, 6, 3}, {1, 3, 0}, {6, 3, 4}}), 2u);
}

TEST(MeshDeviation, ReportsEveryTopologyFault) {
  const HeightGrid grid = white_noise({4, 4}, 1, Seed{1});
  const SampleMesh whole = facets_of(grid);

  SampleMesh mesh = whole;
  mesh.triangles.erase(mesh.triangles.begin() + 9);  // one half of the cell (1, 1)
  EXPECT_THAT(faults_of(grid, mesh),
              ::testing::Contains(HasSubstr("but the surface continues at (1, 2)")));

  mesh = whole;
  mesh.triangles.push_back(mesh.triangles[5]);
  EXPECT_THAT(faults_of(grid, mesh), ::testing::Contains(HasSubstr("is used 3 times")));

  mesh = whole;
  std::swap(mesh.triangles[5].x, mesh.triangles[5].y);
  EXPECT_THAT(faults_of(grid, mesh), ElementsAre(HasSubstr("has the doubled area -1")));

  mesh = whole;
  mesh.triangles[3].z = mesh.triangles[3].x;
  EXPECT_THAT(faults_of(grid, mesh), ElementsAre(HasSubstr("has the doubled area 0")));

  mesh = whole;
  mesh.triangles[3].z = 16;
  EXPECT_THAT(faults_of(grid, mesh), ElementsAre(HasSubstr("16, but there are 16")));

  mesh = whole;
  mesh.vertices.emplace_back(2, 1);
  EXPECT_THAT(faults_of(grid, mesh), ElementsAre("vertex (2, 1) occurs twice"));

  mesh = whole;
  mesh.vertices.emplace_back(4, 1);
  EXPECT_THAT(faults_of(grid, mesh), ElementsAre("vertex (4, 1) is not a sample with a height"));

  // The left column of cells is two triangles, next to cells with a vertex in the middle of an
  // edge.
  mesh = {{{0, 0}, {1, 0}, {0, 2}, {1, 2}, {2, 0}, {2, 2}, {1, 1}},
          {{0, 1, 2}, {3, 2, 1}, {1, 4, 6}, {6, 4, 5}, {6, 5, 3}}};
  const HeightGrid small = white_noise({3, 3}, 1, Seed{1});
  EXPECT_THAT(faults_of(small, mesh), ElementsAre(HasSubstr("edge (1, 0) (1, 2) has one triangle"),
                                                  HasSubstr("edge (1, 1) (1, 0) has one triangle"),
                                                  HasSubstr("edge (1, 2) (1, 1) has one triangle"),
                                                  "V - E + F = 0, but 1 for the facets"));

  // One half of the grid: its outline lies inside the surface, and its area is too small.
  mesh = {{{0, 0}, {2, 0}, {0, 2}}, {{0, 1, 2}}};
  EXPECT_THAT(faults_of(small, mesh),
              ElementsAre(HasSubstr("edge (2, 0) (0, 2) has one triangle"),
                          "the doubled areas add up to 4, those of the facets to 8"));
}

TEST(MeshDeviation, MeshMustEndAtTheBoundaryOfAHole) {
  const HeightGrid holed({3, 3}, {0, 0}, {1, 1},
                         {1, 1, std::numeric_limits<float>::quiet_NaN(), 1, 1, 1, 1, 1, 1});
  EXPECT_THAT(faults_of(holed, facets_of(holed)), IsEmpty());
  const SampleMesh mesh{{{0, 0}, {1, 0}, {0, 2}, {1, 2}, {2, 2}, {1, 1}},
                        {{0, 1, 5}, {0, 5, 2}, {2, 5, 3}, {5, 4, 3}}};
  EXPECT_THAT(
      faults_of(holed, mesh),
      ::testing::Contains(HasSubstr("edge (1, 1) (2, 2) has one triangle and does not follow")));
}

}  // namespace
}  // namespace groundray::testing::mesh_deviation_test
