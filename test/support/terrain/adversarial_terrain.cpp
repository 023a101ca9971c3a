#include "test/support/terrain/adversarial_terrain.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "test/support/terrain/sample_terrain.h"

namespace groundray::testing {
namespace {

constexpr float hole = std::numeric_limits<float>::quiet_NaN();

// Rows run from north to south; cells are not square.
HeightGrid grid_of(glm::ivec2 samples, auto height_m) {
  std::vector<float> heights_m;
  for (int row = 0; row < samples.y; ++row) {
    for (int column = 0; column < samples.x; ++column) {
      heights_m.push_back(static_cast<float>(height_m(column, row)));
    }
  }
  return {samples, {-3 * samples.x, 4 * samples.y}, {6, -8}, std::move(heights_m)};
}

HeightGrid without(const HeightGrid& grid, auto is_hole) {
  return grid_of({grid.columns(), grid.rows()}, [&](int column, int row) {
    return is_hole(column, row) ? hole : grid.height_m(column, row);
  });
}

double uniform_at(Seed seed, int column, int row) {
  return random_uniform(
             {seed, 0, static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row)})
      .x;
}

HeightGrid plane(glm::ivec2 samples) {
  return grid_of(samples, [](int c, int r) { return 100 + 0.25 * c - 0.125 * r; });
}

// A wave with detail at every scale, for any number of samples.
HeightGrid hills(glm::ivec2 samples) {
  return grid_of(samples, [](int c, int r) {
    return 40 * std::sin(0.05 * c) * std::cos(0.07 * r) + 6 * std::sin(0.6 * c + 0.4 * r) +
           uniform_at(Seed{3}, c, r);
  });
}

using Terrains = std::vector<NamedTerrain>;

void add_spikes(Terrains& out) {
  for (const glm::ivec2 at : {glm::ivec2(0, 0), glm::ivec2(64, 64), glm::ivec2(32, 31),
                              glm::ivec2(63, 1), glm::ivec2(0, 33), glm::ivec2(17, 64)}) {
    for (const double height_m : {1000.0, -0.7}) {
      out.push_back({fmt::format("spike of {} m at ({}, {})", height_m, at.x, at.y),
                     grid_of({65, 65}, [&](int c, int r) {
                       return 10 + (c == at.x && r == at.y ? height_m : 0);
                     })});
    }
  }
}

void add_steps(Terrains& out) {
  for (const int at : {1, 31, 32, 33, 63}) {
    out.push_back({fmt::format("step after column {}", at),
                   grid_of({65, 65}, [&](int c, int) { return c < at ? 5 : 17; })});
    out.push_back({fmt::format("step after row {}", at),
                   grid_of({65, 65}, [&](int, int r) { return r < at ? 5 : 17; })});
    out.push_back({fmt::format("step along the main diagonal {}", at),
                   grid_of({65, 65}, [&](int c, int r) { return c - r < at - 32 ? 5 : 17; })});
    out.push_back({fmt::format("step along the anti-diagonal {}", at),
                   grid_of({65, 65}, [&](int c, int r) { return c + r < 2 * at ? 5 : 17; })});
  }
  out.push_back({"terraces", grid_of({97, 97}, [](int c, int r) { return (c / 7 + r / 5) % 9; })});
}

void add_noise(Terrains& out) {
  out.push_back({"checkerboard", grid_of({65, 65}, [](int c, int r) { return (c + r) % 2 * 4; })});
  out.push_back({"columns up and down", grid_of({65, 65}, [](int c, int) { return c % 2 * 4; })});
  out.push_back({"white noise", white_noise({65, 65}, 30, Seed{1})});
  out.push_back({"white noise of an odd size", white_noise({78, 51}, 30, Seed{2})});
  const auto low_m = 8192.0F;
  const float high_m = std::nextafter(low_m, 9000.0F);
  out.push_back({"noise of one ulp at 8192 m", grid_of({65, 65}, [&](int c, int r) {
                   return uniform_at(Seed{4}, c, r) < 0.5 ? low_m : high_m;
                 })});
}

void add_sizes(Terrains& out) {
  for (const glm::ivec2 size :
       {glm::ivec2(2, 2), glm::ivec2(3, 3), glm::ivec2(2, 3), glm::ivec2(5, 2), glm::ivec2(2, 65),
        glm::ivec2(65, 2), glm::ivec2(2, 100), glm::ivec2(77, 2), glm::ivec2(3, 50),
        glm::ivec2(100, 37), glm::ivec2(129, 65), glm::ivec2(66, 64), glm::ivec2(34, 130),
        glm::ivec2(18, 18)}) {
    out.push_back({fmt::format("hills of {} x {}", size.x, size.y), hills(size)});
  }
  out.push_back({"fractal", fractal(129, 5, 200, Seed{5})});
  const HeightGrid rough = fractal(129, 5, 60, Seed{6});
  out.push_back({"corner of a fractal",
                 grid_of({103, 58}, [&](int c, int r) { return rough.height_m(c, r); })});
}

void add_single_holes(Terrains& out) {
  const HeightGrid ground = hills({65, 65});
  for (const glm::ivec2 at : {glm::ivec2(0, 0), glm::ivec2(64, 0), glm::ivec2(64, 64),
                              glm::ivec2(32, 32), glm::ivec2(31, 33), glm::ivec2(1, 16)}) {
    out.push_back({fmt::format("hills without ({}, {})", at.x, at.y),
                   without(ground, [&](int c, int r) { return c == at.x && r == at.y; })});
    out.push_back({fmt::format("plane without ({}, {})", at.x, at.y),
                   without(plane({50, 70}), [&](int c, int r) { return c == at.x && r == at.y; })});
  }
  out.push_back({"two holes that meet at a corner", without(ground, [](int c, int r) {
                   return (c == 20 && r == 20) || (c == 21 && r == 21) || (c == 40 && r == 21) ||
                          (c == 41 && r == 20);
                 })});
  out.push_back({"every 5th sample missing",
                 without(ground, [](int c, int r) { return (c + 2 * r) % 5 == 0; })});
  out.push_back(
      {"every other row missing", without(ground, [](int, int r) { return r % 2 == 0; })});
}

void add_large_holes(Terrains& out) {
  const HeightGrid ground = hills({129, 90});
  const auto round = [](int c, int r, int radius) {
    return (c - 70) * (c - 70) + (r - 40) * (r - 40) < radius * radius;
  };
  out.push_back({"lake", without(ground, [&](int c, int r) { return round(c, r, 25); })});
  out.push_back({"island", without(ground, [&](int c, int r) { return !round(c, r, 25); })});
  out.push_back(
      {"ring", without(ground, [&](int c, int r) { return !round(c, r, 38) || round(c, r, 20); })});
  out.push_back({"half", without(plane({100, 37}), [](int c, int r) { return c > 2 * r + 20; })});
  out.push_back({"archipelago", without(ground, [](int c, int r) {
                   return uniform_at(Seed{8}, c / 5, r / 4) < 0.6;
                 })});
  out.push_back({"half of the samples",
                 without(ground, [](int c, int r) { return uniform_at(Seed{9}, c, r) < 0.5; })});
  out.push_back({"holes in a fractal", with_holes(fractal(129, 5, 200, Seed{5}), 30, 5, Seed{7})});
  out.push_back(
      {"strip with holes", without(hills({90, 2}), [](int c, int r) { return c % 13 == r; })});
  out.push_back(
      {"lone samples", without(ground, [](int c, int r) { return c % 2 == 0 || r % 3 == 0; })});
  out.push_back({"nothing", without(ground, [](int, int) { return true; })});
}

}  // namespace

std::vector<NamedTerrain> planes() {
  Terrains out;
  for (const glm::ivec2 size :
       {glm::ivec2(2, 2), glm::ivec2(3, 3), glm::ivec2(2, 9), glm::ivec2(40, 2), glm::ivec2(5, 5),
        glm::ivec2(65, 65), glm::ivec2(64, 64), glm::ivec2(66, 33), glm::ivec2(100, 37),
        glm::ivec2(37, 100), glm::ivec2(129, 65), glm::ivec2(1000, 257), glm::ivec2(3, 513)}) {
    out.push_back({fmt::format("plane of {} x {}", size.x, size.y), plane(size)});
  }
  return out;
}

HeightGrid white_noise(glm::ivec2 samples, double relief_m, Seed seed) {
  return grid_of(samples, [&](int c, int r) { return relief_m * uniform_at(seed, c, r); });
}

std::vector<NamedTerrain> adversarial_terrain() {
  Terrains out = planes();
  add_spikes(out);
  add_steps(out);
  add_noise(out);
  add_sizes(out);
  add_single_holes(out);
  add_large_holes(out);
  return out;
}

}  // namespace groundray::testing
