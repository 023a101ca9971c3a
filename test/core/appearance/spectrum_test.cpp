#include "core/appearance/spectrum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace groundray::spectrum_test {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

TEST(Spectrum, IsLinearBetweenSamplesAndEmptyBeyond) {
  const Spectrum spectrum{{500, 0.1}, {600, 0.3}, {1000, 0.2}};
  for (const auto& [wavelength_nm, value] :
       {SpectrumSample{500, 0.1}, SpectrumSample{525, 0.15}, SpectrumSample{600, 0.3},
        SpectrumSample{900, 0.225}, SpectrumSample{1000, 0.2}}) {
    EXPECT_NEAR(*value_at(spectrum, wavelength_nm), value, 2 * epsilon);
  }
  EXPECT_FALSE(value_at(spectrum, 499.9));
  EXPECT_FALSE(value_at(spectrum, 1000.1));
  EXPECT_FALSE(value_at(spectrum, std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(value_at({}, 500));
}

// Rounding of 81 products in each sum, and of a matrix whose terms are up to ten times its result.
TEST(Spectrum, ConstantSpectrumIsGrey) {
  for (const double value : {1.0, 0.18}) {
    const glm::dvec3 colour = linear_srgb(Spectrum{{400, value}, {700, value}});
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(colour[i], value, 64 * epsilon);
  }
}

// Spectra of four patches of a ColorChecker (BabelColor, mean of 30 charts) from 380 to 730 nm, as
// in the package colour-science 0.4.7, and their colours as that package integrates them from
// tables every 1 nm, linear between the samples, with the rounded matrix of IEC 61966-2-1. Both
// roundings, and kinks between the library's steps of 5 nm, change less than the tolerance;
// interpolation by a curve instead of a line would change 8e-4.
TEST(Spectrum, ColourCheckerMatchesAnIndependentProgram) {
  struct Patch {
    const char* name;
    std::vector<double> reflectances;
    glm::dvec3 colour;
  };
  const Patch patches[] = {
      {"red",
       {0.050, 0.049, 0.048, 0.047, 0.047, 0.047, 0.047, 0.047, 0.046, 0.045, 0.044, 0.044,
        0.045, 0.046, 0.047, 0.048, 0.049, 0.050, 0.054, 0.060, 0.072, 0.104, 0.178, 0.312,
        0.467, 0.581, 0.644, 0.675, 0.690, 0.698, 0.706, 0.715, 0.724, 0.730, 0.734, 0.738},
       {0.43015668, 0.03243512, 0.04010061}},
      {"foliage",
       {0.051, 0.054, 0.056, 0.057, 0.058, 0.059, 0.060, 0.061, 0.062, 0.063, 0.065, 0.067,
        0.075, 0.101, 0.145, 0.178, 0.184, 0.170, 0.149, 0.133, 0.122, 0.115, 0.109, 0.105,
        0.104, 0.106, 0.109, 0.112, 0.114, 0.114, 0.112, 0.112, 0.115, 0.120, 0.125, 0.130},
       {0.10419481, 0.14983605, 0.05224409}},
      {"neutral 5",
       {0.105, 0.131, 0.163, 0.180, 0.186, 0.190, 0.193, 0.194, 0.194, 0.192, 0.191, 0.191,
        0.191, 0.192, 0.192, 0.192, 0.192, 0.192, 0.192, 0.193, 0.192, 0.192, 0.191, 0.189,
        0.188, 0.186, 0.184, 0.182, 0.181, 0.179, 0.178, 0.176, 0.174, 0.173, 0.172, 0.171},
       {0.18752757, 0.19236938, 0.19163604}},
      {"cyan, out of gamut",
       {0.108, 0.141, 0.192, 0.236, 0.261, 0.286, 0.317, 0.353, 0.390, 0.426, 0.446, 0.444,
        0.423, 0.385, 0.337, 0.283, 0.231, 0.185, 0.146, 0.118, 0.101, 0.090, 0.082, 0.076,
        0.074, 0.073, 0.073, 0.074, 0.076, 0.077, 0.076, 0.075, 0.073, 0.072, 0.074, 0.079},
       {-0.02788325, 0.24902246, 0.38254361}},
  };
  constexpr double tolerance = 3e-4;
  for (const Patch& patch : patches) {
    Spectrum spectrum;
    for (const double reflectance : patch.reflectances)
      spectrum.push_back({380 + 10 * static_cast<double>(spectrum.size()), reflectance});
    const glm::dvec3 colour = linear_srgb(spectrum);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(colour[i], patch.colour[i], tolerance) << patch.name;
  }
}

TEST(Spectrum, WavelengthsBeyondTheVisibleRangeAddLittle) {
  const Spectrum within{{400, 0.5}, {700, 0.5}};
  const Spectrum beyond{{380, 1}, {399.999, 1}, {400, 0.5}, {700, 0.5}, {700.001, 1}, {780, 1}};
  const glm::dvec3 added = linear_srgb(beyond) - linear_srgb(within);
  for (int i = 0; i < 3; ++i) EXPECT_LT(std::abs(added[i]), 0.003 * 0.5);
}

}  // namespace
}  // namespace groundray::spectrum_test
