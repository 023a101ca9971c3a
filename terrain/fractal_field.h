#pragma once

#include <glm/vec2.hpp>
#include <vector>

#include "core/random.h"
#include "terrain/pass.h"

namespace groundray {

/// Fractal ground: a Gaussian random field of mean 0 whose power spectral density in two dimensions
/// falls as f^-(2 hurst + 2) between two wavelengths and is 0 elsewhere.
struct FractalSpec {
  double rms_m = 0.02;      ///< root of the expected mean square
  double hurst = 0.8;       ///< 0 (roughest) to 1
  double shortest_m = 0.1;  ///< wavelength, from two cells on
  double longest_m = 10;    ///< wavelength, at most the period
  Seed seed;
};

/// Returns one period of such a field, row by row, metres: a sum of all waves that fit the period,
/// whose amplitudes are independent and named by wave numbers. Equal for any runner.
/// @param size    columns and rows of samples in a period: powers of two.
/// @param cell_m  between two samples.
/// @throws Error if no wave of the period is as long as the spec says.
/// @see Saupe, Algorithms for random fractals, in: Peitgen, Saupe (eds.), The Science of Fractal
///      Images (1988): the spectral exponent of a surface is 2 H + 2.
std::vector<double> fractal_field(const FractalSpec& spec, glm::ivec2 size, glm::dvec2 cell_m,
                                  const PassRunner& runner = run_in_parallel);

}  // namespace groundray
