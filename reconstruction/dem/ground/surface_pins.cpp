#include "reconstruction/dem/ground/surface_pins.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace groundray {
namespace {

// Merges blocks of four cells into one, with the mean of their points.
SurfacePins coarser(const SurfacePins& fine) {
  const glm::ivec2 size = (fine.height_m.size + 1) / 2;
  SurfacePins coarse(size);
  tbb::parallel_for(0, size.y, [&](int row) {
    for (int column = 0; column < size.x; ++column) {
      float count = 0, height = 0, right = 0, up = 0;
      for (int y = 2 * row; y < std::min(2 * row + 2, fine.height_m.size.y); ++y) {
        for (int x = 2 * column; x < std::min(2 * column + 2, fine.height_m.size.x); ++x) {
          if (std::isnan(fine.height_m(x, y))) continue;
          ++count;
          height += fine.height_m(x, y);
          right += fine.right_cells(x, y) + static_cast<float>(x - 2 * column) - 0.5f;
          up += fine.up_cells(x, y) + static_cast<float>(y - 2 * row) - 0.5f;
        }
      }
      if (count == 0) continue;
      coarse.height_m(column, row) = height / count;
      coarse.right_cells(column, row) = 0.5f * right / count;
      coarse.up_cells(column, row) = 0.5f * up / count;
    }
  });
  return coarse;
}

// Interpolates the coarse surface at the centres of the finer cells. In cells with a point, it
// serves to carry the point's height to the centre.
Raster refined(const Raster& coarse, const SurfacePins& pins, PinPlace place) {
  Raster surface(pins.height_m.size);
  tbb::parallel_for(0, surface.size.y, [&](int row) {
    for (int column = 0; column < surface.size.x; ++column) {
      const float x = 0.5f * static_cast<float>(column) - 0.25f,
                  y = 0.5f * static_cast<float>(row) - 0.25f;
      const std::size_t i = surface.index(column, row);
      const float pin = pins.height_m.values[i];
      float& height = surface.values[i];
      if (std::isnan(pin)) {
        height = between_cells(coarse, x, y);
      } else if (place == PinPlace::Middle) {
        height = pin;
      } else {
        height = pin + between_cells(coarse, x, y) -
                 between_cells(coarse, x + 0.5f * pins.right_cells.values[i],
                               y + 0.5f * pins.up_cells.values[i]);
      }
    }
  });
  return surface;
}

// Moves each cell without a point towards the mean of its neighbours, in checkerboard order.
void relax(const SurfacePins& pins, float beyond, Raster& surface) {
  const glm::ivec2 size = surface.size;
  for (const int colour : {0, 1}) {
    tbb::parallel_for(0, size.y, [&](int row) {
      for (int column = (row + colour) & 1; column < size.x; column += 2) {
        const std::size_t i = surface.index(column, row);
        if (!std::isnan(pins.height_m.values[i])) continue;
        float sum = 0, count = 0;
        const auto add = [&](bool is_there, int x, int y) {
          if (!is_there) return;
          sum += surface(x, y);
          ++count;
        };
        add(column > 0, column - 1, row);
        add(column + 1 < size.x, column + 1, row);
        add(row > 0, column, row - 1);
        add(row + 1 < size.y, column, row + 1);
        if (count > 0) surface.values[i] += beyond * (sum / count - surface.values[i]);
      }
    });
  }
}

}  // namespace

Raster membrane_through(const SurfacePins& pins, PinPlace place) {
  constexpr int sweeps = 8;
  constexpr float beyond = 1.3f;    // of the way to the mean: over-relaxation converges sooner
  std::vector<SurfacePins> levels;  // from fine to coarse
  const SurfacePins* last = &pins;
  while (last->height_m.size.x > 1 || last->height_m.size.y > 1) {
    levels.push_back(coarser(*last));
    last = &levels.back();
  }
  Raster surface = last->height_m;  // one cell
  for (std::size_t level = levels.size(); level-- > 0;) {
    const SurfacePins& finer = level == 0 ? pins : levels[level - 1];
    // Means of several points apply at their mean positions.
    surface = refined(surface, finer, level == 0 ? place : PinPlace::Measured);
    for (int sweep = 0; sweep < sweeps; ++sweep) relax(finer, beyond, surface);
  }
  return surface;
}

}  // namespace groundray
