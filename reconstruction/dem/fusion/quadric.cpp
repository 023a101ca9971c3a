#include "reconstruction/dem/fusion/quadric.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/dem/fusion/float_lanes.h"

namespace groundray {
namespace {

constexpr std::size_t six = 6;

// Powers of u and v, and factor, of each term.
constexpr std::array<std::size_t, six> power_u{0, 1, 0, 2, 1, 0}, power_v{0, 0, 1, 0, 1, 2};
constexpr std::array<double, six> factor_of{1, 1, 1, 0.5, 1, 0.5};

// Sums of w u^i v^j with i + j up to `degree`; other entries are zero.
template <std::size_t degree>
using Moments = std::array<std::array<FloatLanes, degree + 1>, degree + 1>;

template <std::size_t degree>
void add_moments(FloatLanes weight, const FloatLanes& u, const FloatLanes& v,
                 Moments<degree>& sums) noexcept {
  for (std::size_t j = 0; j <= degree; ++j, weight *= v) {
    FloatLanes power = weight;
    for (std::size_t i = 0; i + j <= degree; ++i, power *= u) sums[i][j] += power;
  }
}

NormalEquations equations(const QuadricPlaces& places) noexcept {
  Moments<4> moments{};
  Moments<2> heights{};
  for (std::size_t i = 0; i < quadric_places; i += lanes) {
    const FloatLanes u = load(&places.u[i]), v = load(&places.v[i]), w = load(&places.weight[i]);
    add_moments<4>(w, u, v, moments);
    add_moments<2>(w * load(&places.z[i]), u, v, heights);
  }
  std::array<std::array<double, 5>, 5> sums{};
  for (std::size_t i = 0; i < sums.size(); ++i)
    for (std::size_t j = 0; i + j < sums.size(); ++j) sums[i][j] = double{total(moments[i][j])};
  NormalEquations found;
  for (std::size_t a = 0; a < six; ++a) {
    found.right[a] = factor_of[a] * double{total(heights[power_u[a]][power_v[a]])};
    for (std::size_t b = 0; b <= a; ++b) {
      found.matrix[a][b] =
          factor_of[a] * factor_of[b] * sums[power_u[a] + power_u[b]][power_v[a] + power_v[b]];
    }
  }
  return found;
}

// Performs a Cholesky factorisation of the lower triangle in place, with the reciprocal of the
// diagonal.
void factorise(QuadricMatrix& m) noexcept {
  constexpr double least = 1e-12;  // fraction of a diagonal entry: the rest is rounding
  for (std::size_t j = 0; j < six; ++j) {
    double diagonal = m[j][j];
    for (std::size_t k = 0; k < j; ++k) diagonal -= m[j][k] * m[j][k];
    const double per = 1 / std::sqrt(std::max(diagonal, least * m[j][j]));
    m[j][j] = per;
    for (std::size_t i = j + 1; i < six; ++i) {
      double rest = m[i][j];
      for (std::size_t k = 0; k < j; ++k) rest -= m[i][k] * m[j][k];
      m[i][j] = rest * per;
    }
  }
}

void solve_factorised(const QuadricMatrix& factor, QuadricTerms& x) noexcept {
  for (std::size_t i = 0; i < six; ++i) {
    for (std::size_t k = 0; k < i; ++k) x[i] -= factor[i][k] * x[k];
    x[i] *= factor[i][i];
  }
  for (std::size_t i = six; i-- > 0;) {
    for (std::size_t k = i + 1; k < six; ++k) x[i] -= factor[k][i] * x[k];
    x[i] *= factor[i][i];
  }
}

}  // namespace

QuadricMatrix QuadricFit::covariance() const noexcept {
  QuadricMatrix back{};  // inverse of L
  for (std::size_t j = 0; j < six; ++j) {
    back[j][j] = factor[j][j];
    for (std::size_t i = j + 1; i < six; ++i) {
      double sum = 0;
      for (std::size_t k = j; k < i; ++k) sum -= factor[i][k] * back[k][j];
      back[i][j] = sum * factor[i][i];
    }
  }
  QuadricMatrix inverse{};
  for (std::size_t i = 0; i < six; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0;
      for (std::size_t k = i; k < six; ++k) sum += back[k][i] * back[k][j];
      inverse[i][j] = inverse[j][i] = sum;
    }
  }
  return inverse;
}

QuadricFit solve(const NormalEquations& sums) noexcept {
  QuadricFit fit{sums.right, sums.matrix};
  factorise(fit.factor);
  solve_factorised(fit.factor, fit.terms);
  return fit;
}

QuadricFit fit_quadric(const QuadricPlaces& places, const QuadricTerms& hold) noexcept {
  NormalEquations sums = equations(places);
  for (std::size_t i = 0; i < six; ++i) sums.matrix[i][i] += hold[i];
  return solve(sums);
}

void set_residuals(const QuadricPlaces& places, const QuadricTerms& t,
                   QuadricColumn& residual) noexcept {
  std::array<float, six> by;
  for (std::size_t i = 0; i < six; ++i) by[i] = static_cast<float>(t[i]);
  for (std::size_t i = 0; i < quadric_places; i += lanes) {
    const FloatLanes u = load(&places.u[i]), v = load(&places.v[i]);
    const FloatLanes bent = 0.5F * (by[3] * u * u + by[5] * v * v) + by[4] * u * v;
    store(load(&places.z[i]) - by[0] - by[1] * u - by[2] * v - bent, &residual[i]);
  }
}

}  // namespace groundray
