#include "reconstruction/dem/fusion/quadric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/random.h"

namespace groundray::quadric_test {
namespace {

constexpr std::size_t six = 6;

glm::dvec2 uniform(std::uint32_t what, std::size_t i) {
  return random_uniform({.seed = Seed{8}, .frame = what, .pulse = static_cast<std::uint32_t>(i)});
}

std::array<double, six> row_of(double u, double v) {
  return {1, u, v, 0.5 * u * u, u * v, 0.5 * v * v};
}

// Cells of a window, some of them missing, with weights from 1 to 10^4.
QuadricPlaces places_of(std::uint32_t trial) {
  QuadricPlaces places;
  for (std::size_t i = 0; i < 25; ++i) {
    const std::size_t row = i / 5, column = i % 5;
    const glm::dvec2 off = uniform(5 * trial, i), more = uniform(5 * trial + 1, i);
    places.u[i] = static_cast<float>(static_cast<double>(column) - 2.5 + off.x);
    places.v[i] = static_cast<float>(static_cast<double>(row) - 2.5 + off.y);
    places.z[i] = static_cast<float>(more.x - 0.5);
    if (more.y > 0.3)
      places.weight[i] = static_cast<float>(std::pow(10.0, 4 * uniform(5 * trial + 2, i).x));
  }
  return places;
}

// Reference: normal equations in doubles, solved by Gauss-Jordan elimination with pivoting; terms
// and covariance.
struct Dense {
  QuadricTerms terms{};
  QuadricMatrix covariance{};
};

Dense dense_fit(const QuadricPlaces& places, const QuadricTerms& hold) {
  std::array<std::array<double, 2 * six + 1>, six> m{};  // matrix, right-hand side, identity
  for (std::size_t i = 0; i < quadric_places; ++i) {
    const auto row = row_of(double{places.u[i]}, double{places.v[i]});
    for (std::size_t a = 0; a < six; ++a) {
      m[a][six] += double{places.weight[i]} * row[a] * double{places.z[i]};
      for (std::size_t b = 0; b < six; ++b) m[a][b] += double{places.weight[i]} * row[a] * row[b];
    }
  }
  for (std::size_t a = 0; a < six; ++a) {
    m[a][a] += hold[a];
    m[a][six + 1 + a] = 1;
  }
  for (std::size_t a = 0; a < six; ++a) {
    std::size_t pivot = a;
    for (std::size_t b = a; b < six; ++b)
      if (std::abs(m[b][a]) > std::abs(m[pivot][a])) pivot = b;
    std::swap(m[a], m[pivot]);
    const double per = 1 / m[a][a];
    for (double& value : m[a]) value *= per;
    for (std::size_t b = 0; b < six; ++b) {
      const double times = m[b][a];
      if (b == a) continue;
      for (std::size_t k = 0; k < m[b].size(); ++k) m[b][k] -= times * m[a][k];
    }
  }
  Dense found;
  for (std::size_t a = 0; a < six; ++a) {
    found.terms[a] = m[a][six];
    for (std::size_t b = 0; b < six; ++b) found.covariance[a][b] = m[a][six + 1 + b];
  }
  return found;
}

// Sums of floats are rounded: tolerance of 1e-4 of a term's own standard deviation, or of its prior
// one.
TEST(Quadric, MatchesADenseSolve) {
  const QuadricTerms hold{0, 4, 4, 100, 200, 100};
  for (std::uint32_t trial = 0; trial < 200; ++trial) {
    const QuadricPlaces places = places_of(trial);
    const QuadricFit fit = fit_quadric(places, hold);
    const QuadricMatrix covariance = fit.covariance();
    const Dense dense = dense_fit(places, hold);
    for (std::size_t a = 0; a < six; ++a) {
      EXPECT_NEAR(fit.terms[a], dense.terms[a], 2e-4);
      for (std::size_t b = 0; b < six; ++b) {
        const double size = std::sqrt(dense.covariance[a][a] * dense.covariance[b][b]);
        EXPECT_NEAR(covariance[a][b], dense.covariance[a][b], 1e-3 * size);
      }
    }
  }
}

// A surface of the second degree is reproduced from its heights, whatever the weights.
TEST(Quadric, ReproducesItsOwnSurface) {
  const QuadricTerms truth{0.3, -0.2, 0.1, 0.05, -0.04, 0.02};
  for (std::uint32_t trial = 0; trial < 50; ++trial) {
    QuadricPlaces places = places_of(trial);
    for (std::size_t i = 0; i < quadric_places; ++i)
      places.z[i] = static_cast<float>(height_at(truth, double{places.u[i]}, double{places.v[i]}));
    const QuadricFit fit = fit_quadric(places, {});
    QuadricColumn residual;
    set_residuals(places, fit.terms, residual);
    for (std::size_t a = 0; a < six; ++a) EXPECT_NEAR(fit.terms[a], truth[a], 1e-4);
    for (std::size_t i = 0; i < 25; ++i) EXPECT_NEAR(residual[i], 0, 5e-4);
  }
}

// Without places, the terms follow from their priors alone.
TEST(Quadric, WithoutSamplesTermsFollowFromTheirPriors) {
  const QuadricFit fit = fit_quadric({}, {1, 4, 4, 100, 200, 100});
  const QuadricMatrix covariance = fit.covariance();
  for (std::size_t a = 0; a < six; ++a) EXPECT_EQ(fit.terms[a], 0);
  EXPECT_DOUBLE_EQ(covariance[0][0], 1);
  EXPECT_DOUBLE_EQ(covariance[1][1], 0.25);
  EXPECT_DOUBLE_EQ(covariance[4][4], 0.005);
  EXPECT_EQ(covariance[1][2], 0);
}

}  // namespace
}  // namespace groundray::quadric_test
