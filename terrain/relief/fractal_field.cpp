#include "terrain/relief/fractal_field.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

using Complex = std::complex<double>;

// Inverse Fourier transform whose size is a power of two, not normalised: value[x] = sum over m of
// amplitude[m] exp(2 pi i m x / size). See Cooley, Tukey, An algorithm for the machine calculation
// of complex Fourier series (1965).
class WaveSum {
 public:
  explicit WaveSum(int size) : size_(static_cast<std::size_t>(size)), turns_(size_ / 2) {
    for (std::size_t i = 0; i < turns_.size(); ++i) {
      const double angle_rad =
          2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(size_);
      turns_[i] = {math::cos(angle_rad), math::sin(angle_rad)};
    }
  }

  // Replaces amplitudes by values.
  void operator()(Complex* values) const noexcept {
    reverse_bits(values);
    for (std::size_t half = 1; half < size_; half *= 2) {
      const std::size_t stride = size_ / (2 * half);
      for (std::size_t first = 0; first < size_; first += 2 * half) {
        for (std::size_t i = 0; i < half; ++i) {
          Complex& a = values[first + i];
          Complex& b = values[first + i + half];
          const Complex turn = turns_[i * stride];
          // Written out, because operator* also checks for infinities.
          const Complex turned{turn.real() * b.real() - turn.imag() * b.imag(),
                               turn.real() * b.imag() + turn.imag() * b.real()};
          b = a - turned;
          a += turned;
        }
      }
    }
  }

 private:
  void reverse_bits(Complex* values) const noexcept {
    std::size_t other = 0;
    for (std::size_t i = 1; i < size_; ++i) {
      std::size_t bit = size_ / 2;
      for (; (other & bit) != 0; bit /= 2) other ^= bit;
      other |= bit;
      if (i < other) std::swap(values[i], values[other]);
    }
  }

  std::size_t size_;
  std::vector<Complex> turns_;
};

// Waves (m, n) of a period: m is the wave number in x (columns), n in y (rows). The field is real,
// so that one of (m, n) and (-m, -n) is sufficient.
struct Waves {
  const FractalSpec& spec;
  glm::ivec2 size;
  glm::dvec2 per_period_m;  // frequency of a wave that fits the period once

  // Returns the largest wave numbers; the wave with two samples per wavelength is not used.
  glm::ivec2 last() const {
    const glm::dvec2 most = 1.0 / (spec.shortest_m * per_period_m);
    return {static_cast<int>(std::min(most.x, size.x / 2.0 - 1)),
            static_cast<int>(std::min(most.y, size.y / 2.0 - 1))};
  }
  // Returns the power of a wave, up to a common factor.
  double power(int m, int n) const {
    if (m == 0 && n <= 0) return 0;
    const double frequency = math::hypot(m * per_period_m.x, n * per_period_m.y);
    if (frequency * spec.shortest_m > 1 || frequency * spec.longest_m < 1) return 0;
    return math::pow(frequency, -2 * spec.hurst - 2);
  }
  double whole_power() const {
    double sum = 0;
    for (int m = 0; m <= last().x; ++m) {
      for (int n = -last().y; n <= last().y; ++n) sum += power(m, n);
    }
    return sum;
  }
  Complex amplitude(int m, int n, double scale) const {
    const glm::dvec2 normal = random_normal({.seed = spec.seed,
                                             .frame = static_cast<std::uint32_t>(m),
                                             .pulse = static_cast<std::uint32_t>(n),
                                             .stream = RandomStream::Relief});
    const double deviation = std::sqrt(scale * power(m, n));
    return {deviation * normal.x, deviation * normal.y};
  }
};

}  // namespace

std::vector<double> fractal_field(const FractalSpec& spec, glm::ivec2 size, glm::dvec2 cell_m,
                                  const PassRunner& runner) {
  const Waves waves{spec, size, 1.0 / (glm::dvec2(size) * cell_m)};
  const glm::ivec2 last = waves.last();
  const double whole = waves.whole_power();
  if (whole == 0) {
    throw Error(
        "relief: no wave with a period of {:g} x {:g} m is {:g} to {:g} m long; move shortest_m "
        "and longest_m farther apart, or make longest_m shorter than the period",
        1 / waves.per_period_m.x, 1 / waves.per_period_m.y, spec.shortest_m, spec.longest_m);
  }
  const double scale = spec.rms_m * spec.rms_m / whole;
  const auto columns = static_cast<std::size_t>(size.x), rows = static_cast<std::size_t>(size.y);
  std::vector<Complex> by_wave((static_cast<std::size_t>(last.x) + 1) * rows);
  const WaveSum along_rows(size.y), along_columns(size.x);
  run_pass(runner, static_cast<std::size_t>(last.x) + 1, [&](std::size_t m) {
    Complex* const values = by_wave.data() + m * rows;
    for (int n = -last.y; n <= last.y; ++n) {
      const auto place = static_cast<std::size_t>(n < 0 ? n + size.y : n);
      if (waves.power(static_cast<int>(m), n) > 0)
        values[place] = waves.amplitude(static_cast<int>(m), n, scale);
    }
    along_rows(values);
  });
  std::vector<double> field(columns * rows);
  run_pass(runner, rows, [&](std::size_t row) {
    std::vector<Complex> values(columns);
    for (std::size_t m = 0; m <= static_cast<std::size_t>(last.x); ++m)
      values[m] = by_wave[m * rows + row];
    along_columns(values.data());
    for (std::size_t x = 0; x < columns; ++x) field[row * columns + x] = values[x].real();
  });
  return field;
}

}  // namespace groundray
