#include "terrain/relief/fractal_field.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <iostream>
#include <numbers>

#include "test/support/terrain/shuffled_runner.h"

namespace groundray::fractal_field_test {
namespace {

using Complex = std::complex<double>;

// Fourier series of a real field, term by term: the sum over x of field exp(-2 pi i m x / N).
class Spectrum {
 public:
  Spectrum(const std::vector<double>& field, glm::ivec2 size) : size_(size) {
    std::vector<Complex> by_row(field.size());
    terms_.resize(field.size());
    const auto at = [&](int x, int y) {
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x) +
             static_cast<std::size_t>(x);
    };
    for (int y = 0; y < size.y; ++y) {
      for (int m = 0; m < size.x; ++m) {
        for (int x = 0; x < size.x; ++x) by_row[at(m, y)] += field[at(x, y)] * wave(m * x, size.x);
      }
    }
    for (int m = 0; m < size.x; ++m) {
      for (int n = 0; n < size.y; ++n) {
        for (int y = 0; y < size.y; ++y) terms_[at(m, n)] += by_row[at(m, y)] * wave(n * y, size.y);
      }
    }
  }
  Complex operator()(int m, int n) const {
    return terms_[static_cast<std::size_t>((n + size_.y) % size_.y) *
                      static_cast<std::size_t>(size_.x) +
                  static_cast<std::size_t>(m)];
  }

 private:
  static Complex wave(int turns, int size) {
    return std::polar(1.0, -2 * std::numbers::pi * (turns % size) / size);
  }
  glm::ivec2 size_;
  std::vector<Complex> terms_;
};

// The power of each wave divided by its expected power is exponentially distributed with mean 1.
// The mean of n such ratios is therefore 1 with a standard deviation of 1/sqrt(n), and that of
// their squares is 2 with a standard deviation of sqrt(20/n). Both are tested per octave, which
// tests the slope, and over all waves, which tests the root mean square. Significance 0.01 over the
// ten values: 3.3 standard deviations each.
TEST(FractalField, HasTheRequestedSpectrumAndRms) {
  constexpr double z = 3.29;  // 1 - (1 - 0.01)^(1/10) = 1.0e-3, two-sided
  const glm::ivec2 size(64, 32);
  const glm::dvec2 cell_m(0.5, 0.8);
  FractalSpec spec{.rms_m = 0.3, .hurst = 0.6, .shortest_m = 1.7, .longest_m = 20};
  constexpr int octaves = 4, fields = 40;
  double sum[octaves + 1] = {}, squares[octaves + 1] = {};
  int count[octaves + 1] = {};
  double whole_power = 0;
  const auto power = [&](int m, int n) {
    const double f = std::hypot(m / (size.x * cell_m.x), n / (size.y * cell_m.y));
    return 1 / f > spec.longest_m || 1 / f < spec.shortest_m ? 0 : std::pow(f, -3.2);
  };
  for (int m = -31; m < 32; ++m) {
    for (int n = -15; n < 16; ++n) whole_power += m == 0 && n == 0 ? 0 : power(m, n);
  }
  for (int field = 0; field < fields; ++field) {
    spec.seed = Seed{static_cast<std::uint64_t>(900 + field)};
    const Spectrum spectrum(fractal_field(spec, size, cell_m), size);
    const double scale = 1.0 / (size.x * size.y);
    for (int m = 0; m < 32; ++m) {
      for (int n = m == 0 ? 1 : -15; n < 16; ++n) {
        const double found = std::norm(spectrum(m, n) * scale);
        const double expected = spec.rms_m * spec.rms_m * power(m, n) / whole_power;
        if (expected == 0) {
          ASSERT_LT(found, 1e-30);
          continue;
        }
        const double length_m = 1 / std::hypot(m / (size.x * cell_m.x), n / (size.y * cell_m.y));
        const int octave = static_cast<int>(std::log2(spec.longest_m / length_m));
        for (const int band : {octave, octaves}) {
          sum[band] += found / expected;
          squares[band] += found / expected * (found / expected);
          ++count[band];
        }
      }
    }
    ASSERT_LT(std::abs(spectrum(0, 0)) * scale, 1e-15);
  }
  for (int band = 0; band <= octaves; ++band) {
    const double n = count[band];
    ASSERT_GT(n, 100);
    EXPECT_NEAR(sum[band] / n, 1, z / std::sqrt(n)) << band;
    EXPECT_NEAR(squares[band] / n, 2, z * std::sqrt(20 / n)) << band;
    std::cout << fmt::format("octave {}: {:.4f} of the power, {} waves\n", band, sum[band] / n, n);
  }
}

TEST(FractalField, DependsOnTheSeedButNotOnTheRunner) {
  const glm::ivec2 size(128, 64);
  FractalSpec spec{.shortest_m = 0.3, .longest_m = 5, .seed = Seed{3}};
  const auto field = fractal_field(spec, size, {0.1, 0.2});
  EXPECT_EQ(field, fractal_field(spec, size, {0.1, 0.2}, testing::shuffled_runner(Seed{4})));
  spec.seed = Seed{5};
  EXPECT_NE(field, fractal_field(spec, size, {0.1, 0.2}));
}

}  // namespace
}  // namespace groundray::fractal_field_test
