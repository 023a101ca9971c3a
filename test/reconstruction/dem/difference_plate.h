#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <map>
#include <utility>
#include <vector>

#include "reconstruction/dem/thin_plate/ldlt.h"

// Equations of plates for tests of solvers.
namespace groundray::testing {

/// Matrix of the summed squared differences of an order along columns and rows of a raster, plus a
/// thousandth of the squared heights.
struct DifferencePlate {
  std::vector<glm::ivec2> places;
  ThinPlateMatrix matrix;
};

/// @param order  1 to 3.
inline DifferencePlate difference_plate(glm::ivec2 size, int order) {
  constexpr std::array<std::array<double, 4>, 3> factors{{{-1, 1}, {1, -2, 1}, {-1, 3, -3, 1}}};
  const auto& of = factors[static_cast<std::size_t>(order - 1)];
  const auto index = [&](glm::ivec2 p) { return p.y * size.x + p.x; };
  DifferencePlate plate;
  std::vector<std::map<std::int32_t, double>> rows(static_cast<std::size_t>(size.x * size.y));
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column) {
      const glm::ivec2 at(column, row);
      plate.places.push_back(at);
      rows[static_cast<std::size_t>(index(at))][index(at)] += 1e-3;
      for (const glm::ivec2 way : {glm::ivec2(1, 0), glm::ivec2(0, 1)}) {
        const glm::ivec2 last = at + order * way;
        if (last.x >= size.x || last.y >= size.y) continue;
        for (int a = 0; a <= order; ++a)
          for (int b = 0; b <= order; ++b)
            rows[static_cast<std::size_t>(index(at + a * way))][index(at + b * way)] +=
                of[static_cast<std::size_t>(a)] * of[static_cast<std::size_t>(b)];
      }
    }
  }
  for (const auto& row : rows) {
    for (const auto& [sample, factor] : row) {
      plate.matrix.samples.push_back(sample);
      plate.matrix.factors.push_back(factor);
    }
    plate.matrix.ends.push_back(plate.matrix.samples.size());
  }
  return plate;
}

}  // namespace groundray::testing
