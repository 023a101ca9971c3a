#include "core/math.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "core/math_fingerprint.h"

namespace groundray::math_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// A function, its value in long double, the range of its arguments, and a checksum of its bits.
struct Case {
  std::string name;
  double (*function)(double);
  long double (*exact)(long double);
  double low, high;
  std::uint64_t sum;
  double most_ulp = 1;
};

std::ostream& operator<<(std::ostream& out, const Case& one) { return out << one.name; }

constexpr std::uint64_t next_word(std::uint64_t& state) {  // xorshift64, Marsaglia (2003)
  state ^= state << 13;
  state ^= state >> 7;
  return state ^= state << 17;
}

// Returns a number in [0, 1), from many octaves in every second call.
double share(std::uint64_t& state) {
  const double even = static_cast<double>(next_word(state) >> 11) * 0x1p-53;
  return next_word(state) % 2 == 0 ? even : std::ldexp(even, -static_cast<int>(state >> 60));
}

double ulp_of(double value) {
  const double size = std::max(std::abs(value), std::numeric_limits<double>::min());
  return std::nextafter(size, infinity) - size;
}

void add(std::uint64_t& sum, double value) {  // FNV-1a over words
  sum = (sum ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211U;
}

constexpr int numbers = 1 << 16;
constexpr std::uint64_t first_state = 88172645463325252U;
constexpr std::uint64_t no_words = 14695981039346656037U;

struct Outcome {
  double worst_ulp = 0;
  std::uint64_t sum = no_words;

  void take(double found, long double exact) {
    const double off = static_cast<double>(std::abs(found - exact)) / ulp_of(found);
    if (!(off <= worst_ulp)) worst_ulp = off;  // NaN too
    add(sum, found);
  }
};

class ElementaryFunction : public testing::TestWithParam<Case> {};

// The long doubles of the C library have 11 more bits. The sums were computed with SLEEF 3.5.1 by
// GCC 12 on a processor with AVX-512; all other machines must reach them.
TEST_P(ElementaryFunction, IsWithinItsUlpsAndHasItsBits) {
  const Case& one = GetParam();
  Outcome outcome;
  std::uint64_t state = first_state;
  for (int i = 0; i < numbers; ++i) {
    const double x = one.low + (one.high - one.low) * share(state);
    outcome.take(one.function(x), one.exact(x));
  }
  EXPECT_LE(outcome.worst_ulp, one.most_ulp);
  EXPECT_EQ(outcome.sum, one.sum);
}

#define GROUNDRAY_CASE(name) #name, math::name, std::name
INSTANTIATE_TEST_SUITE_P(
    Math, ElementaryFunction,
    testing::Values(Case{GROUNDRAY_CASE(sin), -1e4, 1e4, 8743322948488029936U},
                    Case{GROUNDRAY_CASE(cos), -1e4, 1e4, 17414365559126413533U},
                    Case{GROUNDRAY_CASE(tan), -1e4, 1e4, 13200953458709303544U},
                    Case{GROUNDRAY_CASE(asin), -1, 1, 16678214295950501456U},
                    Case{GROUNDRAY_CASE(acos), -1, 1, 18202334658563866823U},
                    Case{GROUNDRAY_CASE(atan), -100, 100, 6984657460980718281U},
                    Case{GROUNDRAY_CASE(sinh), -600, 600, 3890604486076126244U},
                    Case{GROUNDRAY_CASE(asinh), -1e9, 1e9, 15401514929684916372U},
                    Case{GROUNDRAY_CASE(exp), -690, 690, 2234182665690189012U},
                    Case{GROUNDRAY_CASE(exp2), -1000, 1000, 2642409142630591345U},
                    Case{GROUNDRAY_CASE(expm1), -40, 690, 9824496899656430082U},
                    Case{GROUNDRAY_CASE(log), 0, 1e9, 15430477140869474310U},
                    Case{GROUNDRAY_CASE(log2), 0, 1e9, 2873541988938022085U},
                    Case{GROUNDRAY_CASE(log10), 0, 1e9, 8235758260598058379U},
                    Case{GROUNDRAY_CASE(log1p), -1, 1e9, 11513095953206518987U},
                    Case{GROUNDRAY_CASE(cbrt), -1e9, 1e9, 4795227106890518424U},
                    Case{GROUNDRAY_CASE(erfc), -6, 25, 15524719630227888178U, 1.5}),
    [](const auto& tested) { return tested.param.name; });
#undef GROUNDRAY_CASE

// Compares a function of two numbers, each from -reach to reach, or from 0 where `is_positive`.
template <typename Function, typename Exact>
Outcome of_pairs(Function function, Exact exact, double first, double second, bool is_positive) {
  Outcome outcome;
  std::uint64_t state = first_state;
  for (int i = 0; i < numbers; ++i) {
    const double x = is_positive ? first * share(state) : first * (2 * share(state) - 1);
    const double y = second * (2 * share(state) - 1);
    outcome.take(function(x, y), exact(static_cast<long double>(x), static_cast<long double>(y)));
  }
  return outcome;
}

TEST(Math, FunctionsOfTwoNumbersAreWithinTheirUlpsAndHaveTheirBits) {
  const Outcome angles = of_pairs(
      math::atan2, [](auto y, auto x) { return std::atan2(y, x); }, 1, 1, false);
  EXPECT_LE(angles.worst_ulp, 1);
  EXPECT_EQ(angles.sum, 11532960130647298890U);
  const Outcome powers = of_pairs(
      math::pow, [](auto base, auto to) { return std::pow(base, to); }, 1e4, 20, true);
  EXPECT_LE(powers.worst_ulp, 1);
  EXPECT_EQ(powers.sum, 16699568151564011610U);
  const Outcome lengths = of_pairs(
      math::hypot, [](auto x, auto y) { return std::hypot(x, y); }, 1e5, 1e5, false);
  EXPECT_LE(lengths.worst_ulp, 0.5001);
  EXPECT_EQ(lengths.sum, 8190668888656596012U);
}

// Computed with SLEEF 3.5.1 by GCC 12, and with 3.6.1 by GCC 14.
TEST(Math, FingerprintIsThatOfAllMachines) { EXPECT_EQ(math::fingerprint(), 514935404632677231U); }

TEST(Math, FunctionsReachTheEndsOfTheirRanges) {
  Outcome outcome;
  for (const double sign : {-1., 1.}) {
    outcome.take(math::asinh(sign * 1e154), std::asinh(sign * 1e154L));
    outcome.take(math::sinh(sign * 709.7), std::sinh(static_cast<long double>(sign * 709.7)));
  }
  outcome.take(math::log1p(1e307), std::log1p(1e307L));
  EXPECT_LE(outcome.worst_ulp, 1);
}

TEST(Math, ErrorFunctionIsThatOfTheCLibraryTo2em16) {
  for (double x = -7; x < 7; x += 0.001) ASSERT_NEAR(math::erf(x), std::erf(x), 2.3e-16) << x;
}

TEST(Math, VectorsHaveTheExponentialsOfTheirComponents) {
  EXPECT_EQ(math::exp(glm::dvec3(-1, 0, 2)), glm::dvec3(math::exp(-1), 1, math::exp(2)));
}

TEST(Math, SpecialValuesAreThoseOfTheCStandard) {
  EXPECT_EQ(math::exp(-infinity), 0);
  EXPECT_EQ(math::exp(infinity), infinity);
  EXPECT_EQ(math::exp(1000), infinity);
  EXPECT_EQ(math::exp(-1000), 0);
  EXPECT_EQ(math::log(0), -infinity);
  EXPECT_TRUE(std::isnan(math::log(-1)));
  EXPECT_EQ(math::log1p(-1), -infinity);
  EXPECT_EQ(math::pow(0, 0), 1);
  EXPECT_EQ(math::pow(0, 2.5), 0);
  EXPECT_EQ(math::pow(0, -1), infinity);
  EXPECT_EQ(math::pow(-2, 3), -8);
  EXPECT_TRUE(std::isnan(math::pow(-2, 0.5)));
  EXPECT_EQ(math::hypot(0, 0), 0);
  EXPECT_DOUBLE_EQ(math::hypot(3e200, 4e200), 5e200);
  EXPECT_EQ(math::atan(infinity), std::atan(infinity));
  EXPECT_TRUE(std::isnan(math::asin(1.0000001)));
  EXPECT_TRUE(std::isnan(math::acos(-1.0000001)));
  EXPECT_TRUE(std::isnan(math::sin(infinity)));
  EXPECT_EQ(math::erfc(-infinity), 2);
  EXPECT_EQ(math::erfc(infinity), 0);
  for (const auto& [y, x] : {std::pair(0., 0.),
                             {-0., 0.},
                             {0., -0.},
                             {-0., -0.},
                             {0., -1.},
                             {-0., -1.},
                             {1., 0.},
                             {-1., 0.},
                             {1., infinity},
                             {1., -infinity},
                             {infinity, infinity},
                             {infinity, -1.}}) {
    EXPECT_EQ(math::atan2(y, x), std::atan2(y, x)) << y << ", " << x;
    EXPECT_EQ(std::signbit(math::atan2(y, x)), std::signbit(std::atan2(y, x))) << y << ", " << x;
  }
}

}  // namespace
}  // namespace groundray::math_test
