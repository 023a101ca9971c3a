#pragma once

// Private to the library: weighted fits of a second-degree surface to a few positions.
#include <array>
#include <cstddef>

namespace groundray {

/// Number of positions that are fitted at once: a whole number of vectors.
constexpr std::size_t quadric_places = 32;

using QuadricColumn = std::array<float, quadric_places>;
using QuadricTerms = std::array<double, 6>;
using QuadricMatrix = std::array<QuadricTerms, 6>;

/// Heights z at positions (u, v) of the surface
///     t0 + t1 u + t2 v + t3 u^2 / 2 + t4 u v + t5 v^2 / 2.
struct QuadricPlaces {
  QuadricColumn u{}, v{}, z{}, weight{};  ///< weight is 0 for missing positions
};

struct QuadricFit {
  QuadricTerms terms{};
  /// L of the normal equations' matrix L L^T: the lower triangle, with the reciprocal of its
  /// diagonal.
  QuadricMatrix factor{};

  /// Returns the covariance of the terms if weights are 1 / variance.
  QuadricMatrix covariance() const noexcept;
};

/// Normal equations for the terms of any six functions.
struct NormalEquations {
  QuadricMatrix matrix{};  ///< lower triangle of a positive matrix
  QuadricTerms right{};
};

/// Solves the equations by Cholesky's factorisation.
QuadricFit solve(const NormalEquations& sums) noexcept;

/// Fits the surface by weighted least squares.
/// @param hold  prior information on each term: 1 / variance about 0.
QuadricFit fit_quadric(const QuadricPlaces& places, const QuadricTerms& hold) noexcept;

/// Sets `residual` to the heights minus those of the surface.
void set_residuals(const QuadricPlaces& places, const QuadricTerms& terms,
                   QuadricColumn& residual) noexcept;

/// Returns the height of the surface.
inline double height_at(const QuadricTerms& t, double u, double v) noexcept {
  return t[0] + t[1] * u + t[2] * v + 0.5 * t[3] * u * u + t[4] * u * v + 0.5 * t[5] * v * v;
}

}  // namespace groundray
