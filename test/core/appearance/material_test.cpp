#include "core/appearance/material.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/error.h"

namespace groundray::material_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double pi = std::numbers::pi;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

Material lambertian(std::vector<SpectrumSample> spectrum) {
  return {.name = "clay", .reflection = Lambertian{std::move(spectrum)}};
}

// The power that leaves a Lambertian surface into the hemisphere, per incident watt, is the
// integral of f_r cos over solid angle: the reflectance, whatever f_r the code uses.
TEST(Material, LambertianReflectsItsReflectanceIntoTheHemisphere) {
  constexpr int rings = 1000;
  constexpr double step_rad = pi / 2 / rings;
  // The error of the midpoint rule is step^2 / 24 (pi / 2) times 4, the bound of the second
  // derivative of the integrand, sin(2 theta).
  constexpr double tolerance = step_rad * step_rad * pi / 12;
  for (const double reflectance : {0., 0.1, 0.37, 1.}) {
    const RetroBrdf brdf = retro_brdf(lambertian({{905, reflectance}}), 905);
    double sum = 0;
    for (int i = 0; i < rings; ++i) {
      const double theta = (i + 0.5) * step_rad;
      sum += retro_brdf_cos(brdf, std::cos(theta)) * 2 * pi * std::sin(theta) * step_rad;
    }
    EXPECT_NEAR(sum, reflectance, tolerance);
  }
}

// Intensity I = R_A E A of a sheet of area A in a beam of cross-section a = A cos, illuminance E =
// flux / a, where R_A falls with the cosine: each incident watt returns R_A watts per sr.
TEST(Material, RetroReflectorReturnsItsCoefficientPerWattAtAnyIncidence) {
  constexpr double coefficient = 250, flux_w = 3, area_m2 = 0.2;
  const Material sheet{.name = "sheet", .reflection = RetroReflector{coefficient}};
  for (const double incidence_rad : {0., 0.3, 1.2}) {
    const double cosine = std::cos(incidence_rad);
    const double illuminance = flux_w / (area_m2 * cosine);
    const double intensity = coefficient * cosine * illuminance * area_m2;
    EXPECT_NEAR(flux_w * retro_brdf_cos(retro_brdf(sheet, 1550), cosine), intensity,
                8 * epsilon * intensity);  // six roundings
  }
}

TEST(Material, SpectrumIsLinearBetweenItsSamples) {
  const Material material = lambertian({{500, 0.1}, {600, 0.3}, {1000, 0.2}});
  for (const auto& [wavelength_nm, reflectance] :
       {SpectrumSample{500, 0.1}, SpectrumSample{525, 0.15}, SpectrumSample{600, 0.3},
        SpectrumSample{900, 0.225}, SpectrumSample{1000, 0.2}}) {
    EXPECT_NEAR(retro_brdf(material, wavelength_nm).diffuse_per_sr * pi, reflectance, 4 * epsilon);
  }
}

TEST(Material, SpectrumIsNotExtrapolated) {
  const Material material = lambertian({{500, 0.1}, {1000, 0.2}});
  EXPECT_THAT([&] { retro_brdf(material, 1550); },
              ThrowsMessage<Error>("Material 'clay': the spectrum reaches from 500 to 1000 nm, but "
                                   "not to 1550 nm"));
  EXPECT_THROW(retro_brdf(material, 499.9), Error);
  EXPECT_THROW(retro_brdf(material, std::numeric_limits<double>::quiet_NaN()), Error);
}

TEST(Material, ErrorListsEveryFault) {
  EXPECT_THAT(
      [] {
        check_material(lambertian({{500, 10}, {500, 0.2}, {-1, 0.2}}));
      },
      ThrowsMessage<Error>(
          AllOf(HasSubstr("Material 'clay':"),
                HasSubstr("spectrum[0].value = 10 must be in [0, 1]: is it in percent?"),
                HasSubstr("spectrum[1].wavelength_nm = 500 must be greater"),
                HasSubstr("spectrum[2].wavelength_nm = -1 must be positive"))));
  EXPECT_THAT([] { check_material(lambertian({})); },
              ThrowsMessage<Error>(HasSubstr("at least one sample")));
  EXPECT_THAT([] { check_material({.name = "sheet", .reflection = RetroReflector{0}}); },
              ThrowsMessage<Error>(HasSubstr("coefficient_cd_lx_m2 = 0 must be positive")));
}

TEST(Material, ErrorListsEveryFaultOfRoughSurfaces) {
  const auto message_of = [](decltype(Material::reflection) reflection) {
    try {
      check_material({"thing", std::move(reflection)});
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const Spectrum half{{400, 0.5}, {700, 0.5}};
  EXPECT_THAT(message_of(RoughDiffuse{half, 30}), HasSubstr("roughness = 30 must be in [0, 1]"));
  EXPECT_THAT(message_of(Coated{half, 1, 0}),
              AllOf(HasSubstr("refractive_index = 1 must be in (1, 4]"),
                    HasSubstr("alpha = 0 must be in [0.01, 1]")));
  EXPECT_THAT(message_of(Conductor{{{500, -0.2}}, {{500, -3}}, 2}),
              AllOf(HasSubstr("refractive_index at 500 nm = -0.2 must be positive"),
                    HasSubstr("extinction_coefficient at 500 nm = -3 must not be negative"),
                    HasSubstr("alpha = 2 must be in [0.01, 1]")));
  EXPECT_THAT(message_of(Conductor{{}, half, 0.1}),
              HasSubstr("refractive_index: there must be at least one sample"));
  EXPECT_THAT(message_of(PlantLeaf{half, {{400, 0.4}, {500, 0.6}, {700, 0.4}}}),
              HasSubstr("reflectance and transmittance at 500 nm add up to 1.1"));
  EXPECT_EQ(message_of(PlantLeaf{half, half}), "");
}

// Microfacet mirror at normal incidence: D(n) F / 4, with D(n) = 1 / (pi alpha^2).
TEST(Material, MetalAtNormalIncidenceMatchesTheMicrofacetDensity) {
  constexpr double n = 2.9, k = 3.1, alpha = 0.05;
  const Material metal{"iron", Conductor{{{905, n}}, {{905, k}}, alpha}};
  const double mirrored = ((n - 1) * (n - 1) + k * k) / ((n + 1) * (n + 1) + k * k);
  const double expected = mirrored / (4 * pi * alpha * alpha);
  // Multiple scattering is less than a fraction of 0.01 spread over the hemisphere.
  EXPECT_NEAR(retro_brdf_cos(retro_brdf(metal, 905), 1), expected, 1e-6 * expected + 0.01 / pi);
}

TEST(Material, LeafReflectsOnlyItsReflectance) {
  const Material leaf{"leaf", PlantLeaf{{{905, 0.45}}, {{905, 0.5}}}};
  EXPECT_NEAR(retro_brdf_cos(retro_brdf(leaf, 905), 0.5), 0.45 * 0.5 / pi, epsilon);
}

// Fujii's form toward the source, s = sin^2, t = cos, without multiple scattering.
TEST(Material, RoughGroundIsBrighterThanLambertianAtGrazingIncidence) {
  const Spectrum dark{{905, 0.01}};
  const double cosine = 0.2;
  const double matt = retro_brdf_cos(retro_brdf({"matt", Lambertian{dark}}, 905), cosine);
  const double rough = retro_brdf_cos(retro_brdf({"rough", RoughDiffuse{dark, 1}}, 905), cosine);
  const double scale = 1 / (1.5 - 2 / (3 * pi));
  const double mean = scale * (1 + 2. / 3 - 28 / (15 * pi));
  // Light scattered twice is up to a fraction of 0.01 of it.
  EXPECT_NEAR(rough / matt, scale / mean * (1 + (1 - cosine * cosine) / cosine),
              0.01 * rough / matt);
}

}  // namespace
}  // namespace groundray::material_test
