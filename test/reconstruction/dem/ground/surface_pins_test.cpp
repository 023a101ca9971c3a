#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "reconstruction/dem/ground/ground_surface.h"

namespace groundray::surface_pins_test {
namespace {

// Random fraction of the cells, each with one point at a random position in it.
SurfacePins pins_on(const std::function<double(double x, double y)>& surface, glm::ivec2 size,
                    double share, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  SurfacePins pins(size);
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      if (uniform(random) >= share) continue;
      const float u = uniform(random) - 0.5f, v = uniform(random) - 0.5f;
      pins.right_cells(x, y) = u;
      pins.up_cells(x, y) = v;
      pins.height_m(x, y) = static_cast<float>(surface(x + double{u}, y + double{v}));
    }
  }
  return pins;
}

// Reference: the membrane itself, iterated from a distant start until nothing changes.
Raster slow_membrane(const SurfacePins& pins) {
  const glm::ivec2 size = pins.height_m.size;
  Raster surface = pins.height_m;
  for (float& height : surface.values) height = std::isnan(height) ? 0 : height;
  for (int sweep = 0; sweep < 20000; ++sweep) {
    float moved = 0;
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        if (!std::isnan(pins.height_m(x, y))) continue;
        float sum = 0, count = 0;
        for (const glm::ivec2 to : {glm::ivec2(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
          const int u = x + to.x, v = y + to.y;
          if (u < 0 || v < 0 || u >= size.x || v >= size.y) continue;
          sum += surface(u, v);
          ++count;
        }
        moved = std::max(moved, std::abs(sum / count - surface(x, y)));
        surface(x, y) = sum / count;
      }
    }
    if (moved < 1e-6f) break;
  }
  return surface;
}

TEST(MembraneThrough, PassesThroughPointsAtCellCentres) {
  const SurfacePins pins =
      pins_on([](double x, double y) { return std::sin(x) * y; }, {50, 31}, 0.2, 1);
  const Raster surface = membrane_through(pins, PinPlace::Middle);
  for (std::size_t i = 0; i < surface.values.size(); ++i) {
    const float pin = pins.height_m.values[i];
    EXPECT_EQ(surface.values[i], std::isnan(pin) ? surface.values[i] : pin);
  }
}

// Planes are membranes, and their points' heights are carried to cell centres exactly. The
// remaining error is the solver's residual, a fraction of a cell's rise.
TEST(MembraneThrough, ReproducesMeasuredPlanes) {
  const auto plane = [](double x, double y) { return 0.8 * x - 0.6 * y + 3; };
  for (const double share : {1., 0.5, 0.1}) {
    const Raster surface =
        membrane_through(pins_on(plane, {120, 90}, share, 2), PinPlace::Measured);
    float worst = 0;
    for (int y = 20; y < 70; ++y) {
      for (int x = 20; x < 100; ++x)
        worst = std::max(worst, std::abs(surface(x, y) - static_cast<float>(plane(x, y))));
    }
    EXPECT_LE(worst, 0.05f) << share;
  }
}

// The solver stops early on purpose: for hills 8 m high, an error of some per cent remains in a gap
// of 30 cells and where 50 cells share a point.
TEST(MembraneThrough, IsCloseToTheConvergedMembrane) {
  const auto hills = [](double x, double y) { return 4 * std::sin(x / 9) * std::cos(y / 7); };
  for (const double share : {0.5, 0.1, 0.02}) {
    SurfacePins pins = pins_on(hills, {90, 70}, share, 3);
    for (int y = 20; y < 45; ++y) {  // and a large gap
      for (int x = 30; x < 60; ++x) pins.height_m(x, y) = std::nanf("");
    }
    const Raster surface = membrane_through(pins, PinPlace::Middle);
    const Raster slow = slow_membrane(pins);
    double sum = 0, worst = 0;
    for (std::size_t i = 0; i < surface.values.size(); ++i) {
      const double off = std::abs(surface.values[i] - slow.values[i]);
      sum += off;
      worst = std::max(worst, off);
    }
    EXPECT_LE(sum / static_cast<double>(surface.values.size()), 0.1) << share;
    EXPECT_LE(worst, 0.4) << share;
  }
}

TEST(MembraneThrough, IsLevelThroughOnePoint) {
  for (const glm::ivec2 size : {glm::ivec2(1, 1), {7, 1}, {2, 300}, {33, 20}}) {
    SurfacePins pins(size);
    pins.height_m(size.x / 2, size.y / 2) = 4;
    pins.right_cells(size.x / 2, size.y / 2) = 0.3f;
    pins.up_cells(size.x / 2, size.y / 2) = -0.4f;
    for (const PinPlace place : {PinPlace::Middle, PinPlace::Measured}) {
      for (const float height_m : membrane_through(pins, place).values)
        EXPECT_NEAR(height_m, 4, 1e-5);
    }
  }
}

}  // namespace
}  // namespace groundray::surface_pins_test
