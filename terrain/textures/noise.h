#pragma once

// Private to the library: periodic random fields.
#include <cstdint>
#include <vector>

#include "terrain/lod/pass.h"

namespace groundray::ground {

/// Pixels of one value, row by row; `side` is a power of two, and both axes wrap.
struct Field {
  int side = 0;
  std::vector<float> values;

  float at(int x, int y) const noexcept { return values[index(x, y)]; }
  std::size_t index(int x, int y) const noexcept {
    return static_cast<std::size_t>(y & (side - 1)) * static_cast<std::size_t>(side) +
           static_cast<std::size_t>(x & (side - 1));
  }
};

/// Wavelengths of a random field. Each octave has 2^-hurst of the amplitude of the next longer one.
struct NoiseSpec {
  double longest_m = 1, shortest_m = 0.01;
  double hurst = 0.8;
};

/// Returns a periodic random field with mean 0 and root mean square 1. Octaves of independent
/// numbers on ever finer lattices are summed, and the lattices refined as uniform cubic B-splines.
/// @see Lane and Riesenfeld, A theoretical development for the computer generation and display of
///      piecewise polynomial surfaces, IEEE PAMI 2 (1980): the refinement.
Field noise(const NoiseSpec& spec, int side, double size_m, std::uint64_t seed,
            const PassRunner& runner);

/// Returns a field with twice the columns and rows: the same B-spline.
Field refined(const Field& coarse, const PassRunner& runner);

/// Returns the mean of the square of 2 radius + 1 pixels around each pixel.
Field box_mean(const Field& field, int radius, const PassRunner& runner);

/// Subtracts the mean, and divides by the root mean square where that is not 0.
void standardise(Field& field);

}  // namespace groundray::ground
