#pragma once

#include <glm/vec2.hpp>
#include <vector>

#include "core/random.h"
#include "terrain/lod/pass.h"

namespace groundray {

/// Fractal ground: a Gaussian random field of mean 0. Its two-dimensional power spectral density
/// falls as f^-(2 hurst + 2) between two wavelengths and is 0 elsewhere.
struct FractalSpec {
  double rms_m = 0.02;      ///< square root of the expected mean square
  double hurst = 0.8;       ///< Hurst exponent, 0 (roughest) to 1
  double shortest_m = 0.1;  ///< shortest wavelength, at least two cells
  double longest_m = 10;    ///< longest wavelength, at most the period
  Seed seed;
};

/// Returns one period of such a field, row by row, metres: the sum of all waves that fit the
/// period, with independent amplitudes that are keyed by the wave numbers. Equal for any runner.
/// @param size    columns and rows of samples in a period: powers of two.
/// @param cell_m  spacing of samples.
/// @throws Error if no wave of the period lies between the two wavelengths.
/// @see Saupe, Algorithms for random fractals, in: Peitgen, Saupe (eds.), The Science of Fractal
///      Images (1988): the spectral exponent of a surface is 2 H + 2.
std::vector<double> fractal_field(const FractalSpec& spec, glm::ivec2 size, glm::dvec2 cell_m,
                                  const PassRunner& runner = {});

}  // namespace groundray
