#include "core/math_fingerprint.h"

#include <array>
#include <bit>

#include "core/math.h"

namespace groundray::math {
namespace {

constexpr std::uint64_t arguments = 1 << 12;

struct OfOne {
  double (*function)(double) noexcept;
  double low, high;
};

struct OfTwo {
  double (*function)(double, double) noexcept;
  double low, high;  // of the first argument
  double low_other, high_other;
};

// Most of the range in which results are finite; trigonometric functions have other methods for
// large angles, and logarithms lose digits near 1.
constexpr std::array of_one{
    OfOne{sin, -100, 100},   OfOne{sin, -1e15, 1e15}, OfOne{cos, -100, 100},
    OfOne{cos, -1e15, 1e15}, OfOne{tan, -100, 100},   OfOne{tan, -1e15, 1e15},
    OfOne{asin, -1, 1},      OfOne{acos, -1, 1},      OfOne{atan, -100, 100},
    OfOne{sinh, -600, 600},  OfOne{asinh, -1e3, 1e3}, OfOne{exp, -690, 690},
    OfOne{exp2, -1e3, 1e3},  OfOne{expm1, -1, 1},     OfOne{expm1, -40, 690},
    OfOne{log, 0, 2},        OfOne{log, 0, 1e9},      OfOne{log2, 0, 2},
    OfOne{log2, 0, 1e9},     OfOne{log10, 0, 2},      OfOne{log10, 0, 1e9},
    OfOne{log1p, -1, 1},     OfOne{log1p, -1, 1e9},   OfOne{cbrt, -1e9, 1e9},
    OfOne{erf, -6, 6},       OfOne{erfc, -6, 25}};
constexpr std::array of_two{OfTwo{atan2, -1, 1, -1, 1}, OfTwo{pow, 0, 1e4, -20, 20},
                            OfTwo{hypot, -1e5, 1e5, -1e5, 1e5}};

// Returns a number from `low` to `high`; those of consecutive `i` are spread evenly.
double spread(std::uint64_t i, std::uint64_t step, double low, double high) noexcept {
  return low + (high - low) * (static_cast<double>((i * step) >> 11) * 0x1p-53);
}

}  // namespace

std::uint64_t fingerprint() noexcept {
  std::uint64_t sum = 0xcbf29ce484222325;
  const auto add = [&](double result) {  // FNV-1a over words, and their upper half into the lower
    sum = (sum ^ std::bit_cast<std::uint64_t>(result)) * 0x100000001b3;
    sum ^= sum >> 32;
  };
  // The golden ratio's powers, as in the sequences R1 and R2 of Roberts (2018).
  constexpr std::uint64_t step = 0x9e3779b97f4a7c15, first = 0xc13fa9a902a6328f,
                          second = 0x91e10da5c79e7b1d;
  for (const auto& [function, low, high] : of_one)
    for (std::uint64_t i = 1; i <= arguments; ++i) add(function(spread(i, step, low, high)));
  for (const auto& [function, low, high, low_other, high_other] : of_two) {
    for (std::uint64_t i = 1; i <= arguments; ++i)
      add(function(spread(i, first, low, high), spread(i, second, low_other, high_other)));
  }
  return sum;
}

}  // namespace groundray::math
