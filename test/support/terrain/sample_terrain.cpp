#include "test/support/terrain/sample_terrain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <string_view>

namespace groundray::testing {
namespace {

glm::dvec2 uniform_pair(Seed seed, std::size_t index, std::uint32_t of = 0) {
  return random_uniform(
      {seed, of, static_cast<std::uint32_t>(index >> 32), static_cast<std::uint32_t>(index)});
}

}  // namespace

HeightGrid fractal(int samples, double step_m, double relief_m, Seed seed) {
  const auto n = static_cast<std::size_t>(samples);
  std::vector<float> heights(n * n);
  const auto at = [&](std::size_t column, std::size_t row) -> float& {
    return heights[row * n + column];
  };
  const double roughness = std::exp2(-0.95);  // Hurst exponent 0.95
  double scale_m = relief_m / 2;
  const auto noise = [&](std::size_t column, std::size_t row) {
    return (uniform_pair(seed, row * n + column).x - 0.5) * 2 * scale_m;
  };
  for (std::size_t block = n - 1; block > 1; block /= 2, scale_m *= roughness) {
    const std::size_t half = block / 2;
    for (std::size_t row = half; row < n; row += block) {
      for (std::size_t column = half; column < n; column += block) {
        const float mean = (at(column - half, row - half) + at(column + half, row - half) +
                            at(column - half, row + half) + at(column + half, row + half)) /
                           4;
        at(column, row) = static_cast<float>(mean + noise(column, row));
      }
    }
    for (std::size_t row = 0; row < n; row += half) {
      for (std::size_t column = row / half % 2 == 0 ? half : 0; column < n; column += block) {
        const float left = column >= half ? at(column - half, row) : at(column + half, row);
        const float right = column + half < n ? at(column + half, row) : at(column - half, row);
        const float above = row >= half ? at(column, row - half) : at(column, row + half);
        const float below = row + half < n ? at(column, row + half) : at(column, row - half);
        at(column, row) =
            static_cast<float>((left + right + above + below) / 4 + noise(column, row) / 1.4);
      }
    }
  }
  const double reach_m = step_m * (samples - 1) / 2;
  return {{samples, samples},
          {-reach_m + 0.313, reach_m - 0.425},
          {step_m, -step_m},
          std::move(heights)};
}

HeightGrid with_holes(const HeightGrid& grid, int count, int radius, Seed seed) {
  std::vector<float> heights(grid.heights_m().begin(), grid.heights_m().end());
  for (int hole = 0; hole < count; ++hole) {
    const glm::dvec2 place = uniform_pair(seed, static_cast<std::size_t>(hole));
    const int column = static_cast<int>(place.x * grid.columns());
    const int row = static_cast<int>(place.y * grid.rows());
    const int reach = hole % (radius + 1);
    for (int r = std::max(0, row - reach); r <= std::min(grid.rows() - 1, row + reach); ++r) {
      for (int c = std::max(0, column - reach); c <= std::min(grid.columns() - 1, column + reach);
           ++c) {
        if ((c - column) * (c - column) + (r - row) * (r - row) > reach * reach) continue;
        heights[static_cast<std::size_t>(r) * static_cast<std::size_t>(grid.columns()) +
                static_cast<std::size_t>(c)] = std::numeric_limits<float>::quiet_NaN();
      }
    }
  }
  return {{grid.columns(), grid.rows()}, grid.origin_m(), grid.step_m(), std::move(heights)};
}

HeightGrid with_missing_samples(const HeightGrid& grid, double share, Seed seed) {
  std::vector<float> heights(grid.heights_m().begin(), grid.heights_m().end());
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (random_uniform({seed, 0, 0, static_cast<std::uint32_t>(i)}).x < share)
      heights[i] = std::numeric_limits<float>::quiet_NaN();
  }
  return {{grid.columns(), grid.rows()}, grid.origin_m(), grid.step_m(), std::move(heights)};
}

TriangleMesh mesh_of(const HeightGrid& grid) {
  TriangleMesh mesh;
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column)
      mesh.vertices_m.emplace_back(grid.frame().to_D({column, row}), grid.height_m(column, row));
  }
  const auto side = static_cast<unsigned>(grid.columns());
  const bool is_southwards = grid.step_m().x * grid.step_m().y < 0;
  for (unsigned row = 0; row + 1 < static_cast<unsigned>(grid.rows()); ++row) {
    for (unsigned column = 0; column + 1 < side; ++column) {
      const unsigned a = row * side + column, b = a + 1, c = a + side, d = c + 1;
      if (is_southwards) {
        mesh.triangles.insert(mesh.triangles.end(), {{a, c, b}, {b, c, d}});
      } else {
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {b, d, c}});
      }
    }
  }
  return mesh;
}

std::vector<Ray> random_rays(const HeightGrid& grid, std::size_t count, Seed seed) {
  const glm::dvec2 extent_m = glm::dvec2(grid.columns() - 1, grid.rows() - 1) * grid.step_m();
  std::vector<Ray> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec2 place = uniform_pair(seed, i, 0) * 1.1 - 0.05;
    const glm::dvec2 turn = uniform_pair(seed, i, 1);
    const glm::dvec2 other = uniform_pair(seed, i, 2);
    const glm::dvec2 p = grid.origin_m() + place * extent_m;
    const double ground_m = grid.height_m_at(p).value_or(grid.max_height_m());
    const double sine = 0.15 - 1.15 * turn.x * std::sqrt(turn.x);
    const double cosine = std::sqrt(std::max(0.0, 1 - sine * sine));
    const double azimuth_rad = 2 * std::numbers::pi * turn.y;
    rays[i].origin = {p, ground_m + 0.2 + 300 * other.x * other.x * other.x};
    rays[i].direction = glm::normalize(
        glm::dvec3(cosine * std::cos(azimuth_rad), cosine * std::sin(azimuth_rad), sine));
  }
  return rays;
}

std::size_t proof_size(std::size_t reduced, std::size_t full) {
  const char* asked = std::getenv("GROUNDRAY_PROOF");
  const bool is_full = asked != nullptr && std::string_view(asked) == "full";
  if (::testing::UnitTest::GetInstance()->current_test_info() != nullptr)
    ::testing::Test::RecordProperty("size", is_full ? "full" : "reduced");
  return is_full ? full : reduced;
}

}  // namespace groundray::testing
