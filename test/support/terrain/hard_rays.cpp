#include "test/support/terrain/hard_rays.h"

#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "test/support/terrain/sample_terrain.h"

namespace groundray::testing {

std::vector<glm::dvec3> seam_points(const HeightGrid& grid, std::size_t count, Seed seed) {
  std::vector<glm::dvec3> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto bits = random_bits({seed, 0, 0, static_cast<std::uint32_t>(i)});
    const int column = 1 + static_cast<int>(bits[0] % static_cast<unsigned>(grid.columns() - 3));
    const int row = 1 + static_cast<int>(bits[1] % static_cast<unsigned>(grid.rows() - 3));
    const glm::ivec2 ends[4][2] = {
        {{0, 0}, {0, 0}}, {{0, 0}, {1, 0}}, {{0, 0}, {0, 1}}, {{1, 0}, {0, 1}}};
    const auto& [from, to] = ends[bits[2] % 4];
    const double share = bits[3] * 0x1p-32;
    const auto sample = [&](const glm::ivec2& step) {
      const glm::ivec2 at = glm::ivec2(column, row) + step;
      const double height_m = grid.height_m(at.x, at.y);
      return glm::dvec3(grid.origin_m() + glm::dvec2(at) * grid.step_m(),
                        std::isnan(height_m) ? grid.min_height_m() : height_m);
    };
    points[i] = glm::mix(sample(from), sample(to), share);
  }
  return points;
}

std::vector<Ray> aimed_rays(const HeightGrid& grid, std::size_t count, Seed seed) {
  const auto targets = seam_points(grid, count, seed);
  std::vector<Ray> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec2 turn = random_uniform({seed, 1, 0, static_cast<std::uint32_t>(i)});
    const glm::dvec2 other = random_uniform({seed, 2, 0, static_cast<std::uint32_t>(i)});
    const glm::dvec3 back(std::cos(6.2832 * turn.x), std::sin(6.2832 * turn.x),
                          4 * turn.y * turn.y * (i % 2 == 0 ? 1 : -1));
    rays[i].origin = targets[i] + back * (1 + 50 * other.x);
    rays[i].direction = glm::normalize(targets[i] - rays[i].origin);
  }
  return rays;
}

std::vector<Ray> hard_rays(const HeightGrid& grid, std::size_t count, Seed seed) {
  std::vector<Ray> rays = random_rays(grid, count, seed);
  const auto aimed = aimed_rays(grid, count, seed);
  const auto targets = seam_points(grid, count, seed);
  for (std::size_t i = 0; i < count; ++i) {
    if (i % 3 == 1) rays[i] = aimed[i];
    if (i % 3 != 2) continue;
    const auto bits = random_bits({seed, 3, 0, static_cast<std::uint32_t>(i)});
    const auto tiny = [](std::uint32_t some) {
      if (some % 4 == 0) return 0.0;
      return ((some & 8) != 0 ? 1 : -1) * std::pow(10.0, -10 - static_cast<double>(some % 311));
    };
    const double x = tiny(bits[0]), y = tiny(bits[1]), way = (bits[3] & 1) != 0 ? 1 : -1;
    const glm::dvec3 directions[3] = {{x, y, -1}, {way, x, -0.2}, {x, way, -0.2}};
    rays[i].direction = glm::normalize(directions[bits[2] % 3]);
    rays[i].origin = targets[i] - rays[i].direction * (20 + bits[3] * 0x1p-26);
  }
  return rays;
}

}  // namespace groundray::testing
