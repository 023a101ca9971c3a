#pragma once

// Private to the library: weighted fits of a surface of the second degree to a few places.
#include <array>
#include <cstddef>

namespace groundray {

/// Places that are fitted at once: a whole number of vectors.
constexpr std::size_t quadric_places = 32;

using QuadricColumn = std::array<float, quadric_places>;
using QuadricTerms = std::array<double, 6>;
using QuadricMatrix = std::array<QuadricTerms, 6>;

/// Heights z at places (u, v) of the surface t0 + t1 u + t2 v + t3 u^2 / 2 + t4 u v + t5 v^2 / 2.
struct QuadricPlaces {
  QuadricColumn u{}, v{}, z{}, weight{};  ///< what is not there weighs 0
};

struct QuadricFit {
  QuadricTerms terms{};
  /// L of the normal equations' matrix L L^T: the lower triangle, with 1 / its diagonal.
  QuadricMatrix factor{};

  /// Returns the terms' covariance, if weights are 1 / variance.
  QuadricMatrix covariance() const noexcept;
};

/// Fits by least weighted squares.
/// @param hold  1 / variance of what is known of each term: that it is 0, but for this.
QuadricFit fit_quadric(const QuadricPlaces& places, const QuadricTerms& hold) noexcept;

/// Sets `residual` to heights less those of the surface.
void set_residuals(const QuadricPlaces& places, const QuadricTerms& terms,
                   QuadricColumn& residual) noexcept;

/// Returns the surface's height.
inline double height_at(const QuadricTerms& t, double u, double v) noexcept {
  return t[0] + t[1] * u + t[2] * v + 0.5 * t[3] * u * u + t[4] * u * v + 0.5 * t[5] * v * v;
}

}  // namespace groundray
