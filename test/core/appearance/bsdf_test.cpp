#include "core/appearance/bsdf.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "core/appearance/microfacets.h"
#include "core/error.h"
#include "core/random.h"

namespace groundray::bsdf_test {
namespace {

using ::testing::ThrowsMessage;

constexpr double pi = std::numbers::pi;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

// Error of the albedo tables: 64 nodes with linear interpolation, each node a sum over 48 x 64
// directions.
constexpr double table_tolerance = 5e-4;

Spectrum flat(double value) { return {{300, value}, {2500, value}}; }

Material material(std::string name, decltype(Material::reflection) reflection) {
  return {std::move(name), std::move(reflection)};
}

// Scatters all light to within 1e-9: n is much smaller than k.
Conductor white_metal(double alpha) { return {flat(1e-10), flat(5), alpha}; }

// One material of each kind; none of them absorbs light.
const std::vector<Material>& white_materials() {
  static const std::vector<Material> all{
      material("matt", Lambertian{flat(1)}),
      material("rough", RoughDiffuse{flat(1), 1}),
      material("somewhat rough", RoughDiffuse{flat(1), 0.3}),
      material("wet", Coated{flat(1), 1.33, 0.3}),
      material("gloss paint", Coated{flat(1), 1.5, 0.1}),
      material("dull paint", Coated{flat(1), 1.5, 0.8}),
      material("metal", Conductor{white_metal(0.2)}),
      material("rough metal", Conductor{white_metal(1)}),
      material("leaf", PlantLeaf{flat(0.6), flat(0.4)}),
  };
  return all;
}

// As above, but in colours other than white. J&C's gold has few samples here on purpose.
const std::vector<Material>& coloured_materials() {
  const Spectrum red{{400, 0.05}, {550, 0.2}, {700, 0.9}};
  const Spectrum gold_n{{400, 1.46}, {495.9, 1.04}, {616.8, 0.21}, {704.5, 0.13}};
  const Spectrum gold_k{{400, 1.958}, {495.9, 1.833}, {616.8, 3.272}, {704.5, 4.103}};
  static const std::vector<Material> all{
      material("matt", Lambertian{red}),
      material("rough", RoughDiffuse{red, 0.8}),
      material("paint", Coated{red, 1.5, 0.25}),
      material("gold", Conductor{gold_n, gold_k, 0.3}),
      material("leaf", PlantLeaf{{{400, 0.05}, {550, 0.15}, {700, 0.3}},
                                 {{400, 0.01}, {550, 0.15}, {700, 0.4}}}),
  };
  return all;
}

const std::vector<Bsdf>& bsdfs_of(const std::vector<Material>& materials) {
  static const auto resolved = [](const std::vector<Material>& all) {
    std::vector<Bsdf> bsdfs;
    for (const Material& each : all) bsdfs.push_back(bsdf_in_colour(each));
    return bsdfs;
  };
  static const std::vector<Bsdf> white = resolved(white_materials());
  static const std::vector<Bsdf> coloured = resolved(coloured_materials());
  return &materials == &white_materials() ? white : coloured;
}

glm::dvec2 uniform(std::uint32_t stream, std::uint32_t index) {
  return random_uniform({.seed = {20}, .sensor = stream, .pulse = index});
}

glm::dvec3 direction(double cosine, double azimuth_rad) {
  const double sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(azimuth_rad), sine * std::sin(azimuth_rad), cosine};
}

glm::dvec3 any_direction(std::uint32_t stream, std::uint32_t index) {
  const glm::dvec2 u = uniform(stream, index);
  return direction(1 - 2 * u.x, 2 * pi * u.y);
}

// Integral of f |cos| over all light directions of the sphere, with `wo` at azimuth 0: the midpoint
// rule, with nodes concentrated at grazing angles, at the normal and opposite `wo`, where specular
// peaks lie.
glm::dvec3 albedo(const Bsdf& bsdf, const glm::dvec3& wo) {
  constexpr int rings = 240;
  constexpr int spokes = 180;
  glm::dvec3 sum(0);
  for (int i = 0; i < rings; ++i) {
    const double t = (i + 0.5) / rings;
    const double cosine = t * t * (3 - 2 * t);
    for (int k = 0; k < spokes; ++k) {
      const double v = (k + 0.5) / spokes;
      const glm::dvec3 wi = direction(cosine, pi * (1 - v * v));  // half, by symmetry
      const double solid = 6 * t * (1 - t) / rings * 2 * pi * v / spokes;
      const glm::dvec3 below(wi.x, wi.y, -wi.z);
      sum += (bsdf.eval(wo, wi) + bsdf.eval(wo, below)) * (2 * cosine * solid);
    }
  }
  return sum;
}

TEST(Bsdf, IsExactlyReciprocal) {
  for (const auto* materials : {&white_materials(), &coloured_materials()}) {
    for (const Bsdf& bsdf : bsdfs_of(*materials)) {
      for (std::uint32_t i = 0; i < 2000; ++i) {
        const glm::dvec3 a = any_direction(1, i);
        const glm::dvec3 b = any_direction(2, i);
        ASSERT_EQ(bsdf.eval(a, b), bsdf.eval(b, a));
        ASSERT_EQ(glm::min(bsdf.eval(a, b), 0.0), glm::dvec3(0));
      }
    }
  }
}

TEST(Bsdf, WhiteFurnaceStaysWhite) {
  for (std::size_t m = 0; m < white_materials().size(); ++m) {
    for (const double cosine : {1.0, -0.7, 0.3, -0.1}) {
      const glm::dvec3 wo = direction(cosine, 0);
      EXPECT_NEAR(albedo(bsdfs_of(white_materials())[m], wo).y, 1, table_tolerance)
          << white_materials()[m].name << " seen at a cosine of " << cosine;
    }
  }
}

TEST(Bsdf, ConservesEnergy) {
  for (const Bsdf& bsdf : bsdfs_of(coloured_materials())) {
    for (const double cosine : {0.9, 0.2, 0.05}) {
      const glm::dvec3 share = albedo(bsdf, direction(cosine, 0));
      for (int c = 0; c < 3; ++c) EXPECT_LE(share[c], 1 + table_tolerance);
    }
  }
}

TEST(Bsdf, IsFiniteAtGrazingDirections) {
  for (const auto* materials : {&white_materials(), &coloured_materials()}) {
    for (const Bsdf& bsdf : bsdfs_of(*materials)) {
      for (const double cosine : {0.0, 1e-300, 1e-12, -1e-6}) {
        for (std::uint32_t i = 0; i < 50; ++i) {
          const BsdfSample sample = bsdf.sample(direction(cosine, 1), uniform(5, i));
          ASSERT_TRUE(std::isfinite(sample.weight.x)) << cosine;
          ASSERT_TRUE(std::isfinite(sample.pdf_per_sr));
          ASSERT_NEAR(glm::length(sample.wi), 1, 8 * epsilon);
          ASSERT_TRUE(std::isfinite(bsdf.eval(direction(cosine, 1), direction(1e-12, 1)).x));
        }
      }
    }
  }
}

// Quantile of chi^2 by Wilson and Hilferty, within 1 % for 20 degrees of freedom or more.
double chi2_quantile(double freedom, double z) {
  const double step = 2 / (9 * freedom);
  return freedom * std::pow(1 - step + z * std::sqrt(step), 3);
}

// Bins of the sphere with equal cosine and azimuth intervals; the density is integrated by
// midpoints.
struct Bins {
  static constexpr int cosines = 16;
  static constexpr int azimuths = 12;
  std::vector<double> counts = std::vector<double>(cosines * azimuths + 1);

  static std::size_t of(const glm::dvec3& w) {
    const int i = std::min(static_cast<int>((w.z + 1) / 2 * cosines), cosines - 1);
    const double turn = std::atan2(w.y, w.x) / (2 * pi);
    const int k = std::min(static_cast<int>((turn - std::floor(turn)) * azimuths), azimuths - 1);
    return static_cast<std::size_t>(i) * azimuths + static_cast<std::size_t>(k);
  }
};

// The last bin counts samples that carry no light.
Bins expected_bins(const Bsdf& bsdf, const glm::dvec3& wo, int samples) {
  constexpr int parts = 20;
  Bins bins;
  double rest = samples;
  for (int i = 0; i < Bins::cosines * parts; ++i) {
    const double cosine = 2 * (i + 0.5) / (Bins::cosines * parts) - 1;
    for (int k = 0; k < Bins::azimuths * parts; ++k) {
      const glm::dvec3 wi = direction(cosine, 2 * pi * (k + 0.5) / (Bins::azimuths * parts));
      const double solid = 4 * pi / (Bins::cosines * Bins::azimuths * parts * parts);
      const double expected = samples * solid * bsdf.pdf_per_sr(wo, wi);
      bins.counts[Bins::of(wi)] += expected;
      rest -= expected;
    }
  }
  bins.counts.back() = std::max(rest, 0.0);
  return bins;
}

// Significance 1 % over all 28 tests, by Sidak 3.6e-4 each: 3.38 standard deviations.
TEST(Bsdf, SamplesFollowTheirDensity) {
  constexpr int samples = 15000;
  constexpr double z = 3.38;
  std::uint32_t stream = 10;
  for (const auto* materials : {&white_materials(), &coloured_materials()}) {
    for (std::size_t m = 0; m < materials->size(); ++m) {
      const Bsdf& bsdf = bsdfs_of(*materials)[m];
      for (const double cosine : {0.8, -0.25}) {
        const glm::dvec3 wo = direction(cosine, 0.4);
        Bins found;
        ++stream;
        for (std::uint32_t i = 0; i < samples; ++i) {
          const BsdfSample sample = bsdf.sample(wo, uniform(stream, i));
          const bool lost = sample.pdf_per_sr == 0;
          ++found.counts[lost ? found.counts.size() - 1 : Bins::of(sample.wi)];
        }
        const Bins expected = expected_bins(bsdf, wo, samples);
        double chi2 = 0, freedom = -1, few_found = 0, few_expected = 0;
        for (std::size_t i = 0; i < found.counts.size(); ++i) {
          if (expected.counts[i] < 5) {
            few_found += found.counts[i];
            few_expected += expected.counts[i];
          } else {
            chi2 += std::pow(found.counts[i] - expected.counts[i], 2) / expected.counts[i];
            ++freedom;
          }
        }
        if (few_expected > 1) {
          chi2 += std::pow(few_found - few_expected, 2) / few_expected;
          ++freedom;
        }
        EXPECT_LT(chi2, chi2_quantile(freedom, z))
            << (*materials)[m].name << ", " << freedom << " degrees of freedom";
      }
    }
  }
}

// Z-test of the mean weight, at a significance of 1 % over all 14 x 3 tests: by Sidak 2.4e-4 each,
// two-sided: 3.67 standard deviations. The weights are f cos / pdf; the quadrature above sums f
// cos.
TEST(Bsdf, MeanWeightOfSamplesIsTheAlbedo) {
  constexpr int samples = 15000;
  std::uint32_t stream = 100;
  for (const auto* materials : {&white_materials(), &coloured_materials()}) {
    for (std::size_t m = 0; m < materials->size(); ++m) {
      const Bsdf& bsdf = bsdfs_of(*materials)[m];
      for (const double cosine : {0.95, -0.5, 0.12}) {
        const glm::dvec3 wo = direction(cosine, 2);
        ++stream;
        double sum = 0, squares = 0;
        for (std::uint32_t i = 0; i < samples; ++i) {
          const BsdfSample sample = bsdf.sample(wo, uniform(stream, i));
          sum += sample.weight.x;
          squares += sample.weight.x * sample.weight.x;
          if (sample.pdf_per_sr == 0) continue;
          ASSERT_NEAR(sample.pdf_per_sr, bsdf.pdf_per_sr(wo, sample.wi), 0);
        }
        const double mean = sum / samples;
        const double deviation =
            std::sqrt(std::max(squares / samples - mean * mean, 0.0) / samples);
        EXPECT_NEAR(mean, albedo(bsdf, direction(cosine, 0)).x,
                    3.67 * deviation + 5e-4)  // 5e-4 of the quadrature
            << (*materials)[m].name << " seen at a cosine of " << cosine;
      }
    }
  }
}

TEST(Ggx, ProjectedFacetAreasSumToOne) {
  for (const double alpha : {0.01, 0.1, 0.5, 1.0}) {
    constexpr int rings = 2000;
    double sum = 0;
    for (int i = 0; i < rings; ++i) {  // tan = alpha sqrt(t / (1 - t)) spreads the facets evenly
      const double t = (i + 0.5) / rings;
      const double tan2 = alpha * alpha * t / (1 - t);
      const double cos2 = 1 / (1 + tan2);
      const double dcos2 = cos2 * cos2 * alpha * alpha / ((1 - t) * (1 - t)) / rings;
      sum += ggx::normals_per_sr(direction(std::sqrt(cos2), 0), alpha) * pi * dcos2;
    }
    EXPECT_NEAR(sum, 1, rings * epsilon) << alpha;  // the integrand is 1 everywhere
  }
}

// Fresnel's equations in complex numbers, in the form of Born and Wolf.
double fresnel_oracle(double cosine, std::complex<double> index) {
  const std::complex<double> inside = std::sqrt(1.0 - (1 - cosine * cosine) / (index * index));
  const auto across = (cosine - index * inside) / (cosine + index * inside);
  const auto within = (index * cosine - inside) / (index * cosine + inside);
  return (std::norm(across) + std::norm(within)) / 2;
}

TEST(Fresnel, MatchesTheComplexForm) {
  const std::complex<double> indices[] = {{1, 0},        {1.33, 0},  {1.5, 0},
                                          {0.21, 3.272}, {2.9, 3.1}, {1e-10, 5}};
  for (const auto& index : indices) {
    // At index 1 and grazing incidence the complex form is 0 / 0.
    for (double cosine = index == 1.0 ? 0.01 : 0; cosine <= 1; cosine += 0.01) {
      EXPECT_NEAR(fresnel_reflectance(cosine, index.real(), index.imag()),
                  fresnel_oracle(cosine, index), 1e-12);  // rounding errors near grazing incidence
    }
  }
}

TEST(Fresnel, IndexOneReflectsNothing) {
  for (const double cosine : {0.0, 1e-170, 1e-9, 1e-3, 0.5, 1.0})
    EXPECT_EQ(fresnel_reflectance(cosine, 1, 0), 0) << cosine;
}

// To first order in r = sqrt(n^2 - sin^2), the reflectance is 1 - 4 r / cos - 2 r cos / n^2, which
// is greater than 1 - 6 r / (n^2 cos). A rounding error of cos^2 makes r 1.5e-8.
TEST(Fresnel, IsOneAtTheCriticalAngle) {
  for (int i = 1; i < 64; ++i) {
    const double n = i / 64.0, cosine = std::sqrt(1 - n * n);
    const double tolerance = 6 * std::sqrt(epsilon) / (n * n * cosine);
    EXPECT_NEAR(fresnel_reflectance(cosine, n, 0), 1, tolerance) << n;
  }
}

// Gold at 616.8 nm has n = 0.21, k = 3.272 (Johnson and Christy, Phys. Rev. B 6, 4370 (1972)); at
// normal incidence ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2) is 0.931. Glass of n = 1.5 reflects 4 %,
// water 2.0 %. At Brewster's angle, tan = n, half of ((n^2 - 1) / (n^2 + 1))^2 is reflected.
TEST(Fresnel, MatchesPublishedValues) {
  EXPECT_NEAR(fresnel_reflectance(1, 0.21, 3.272), 0.931, 5e-4);
  EXPECT_NEAR(fresnel_reflectance(1, 1.5, 0), 0.04, 4 * epsilon);
  EXPECT_NEAR(fresnel_reflectance(1, 1.333, 0), 0.0204, 5e-5);
  const double n2 = 1.5 * 1.5;
  const double across = (n2 - 1) / (n2 + 1);
  EXPECT_NEAR(fresnel_reflectance(1 / std::sqrt(1 + n2), 1.5, 0), across * across / 2, 4 * epsilon);
  EXPECT_EQ(fresnel_reflectance(0, 1.5, 0), 1);
}

// Mean Fresnel reflectance of diffuse light from outside, in closed form (Duntley, JOSA 32, 61
// (1942)): 0.092 for n = 1.5, from which Saunderson's internal reflectance of 0.596 follows.
double diffuse_reflectance(double n) {
  const double n2 = n * n, n4 = n2 * n2;
  return 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) * (n + 1)) +
         n2 * (n2 - 1) * (n2 - 1) / std::pow(n2 + 1, 3) * std::log((n - 1) / (n + 1)) -
         2 * n2 * n * (n2 + 2 * n - 1) / ((n2 + 1) * (n4 - 1)) +
         8 * n4 * (n4 + 1) / ((n2 + 1) * (n4 - 1) * (n4 - 1)) * std::log(n);
}

TEST(Bsdf, SmoothCoatMatchesTheSaundersonCorrection) {
  for (const double n : {1.33, 1.5}) {
    const Bsdf bsdf = bsdf_at(material("gloss", Coated{flat(0.5), n, 0.01}), 550);
    const auto& coated = std::get<CoatedBsdf>(bsdf.surface);
    const double outside = diffuse_reflectance(n);
    EXPECT_NEAR(coated.mirrored.mean(), outside, table_tolerance);
    EXPECT_NEAR(coated.thrown_back, 1 - (1 - outside) / (n * n), table_tolerance);
  }
  EXPECT_NEAR(1 - (1 - diffuse_reflectance(1.5)) / 2.25, 0.596, 5e-4);
}

// Model of Portsmouth, Kutz and Hill: the single-scattering albedo by quadrature of f, independent
// of the library's closed form.
TEST(OrenNayar, AlbedoIsTheIntegralOfTheModel) {
  for (const double roughness : {0.2, 1.0}) {
    const double scale = 1 / (1 + (0.5 - 2 / (3 * pi)) * roughness);
    double mean = 0;
    constexpr int steps = 50;
    for (int j = 0; j < steps; ++j) {
      const double cos_o = (j + 0.5) / steps;
      const double sin_o = std::sqrt(1 - cos_o * cos_o);
      double sum = 0;
      constexpr int rings = 300, spokes = 60;
      for (int i = 0; i < rings; ++i) {
        const double cos_i = (i + 0.5) / rings;
        for (int k = 0; k < spokes; ++k) {
          const double turn = (k + 0.5) * pi / spokes;
          const double s = sin_o * std::sqrt(1 - cos_i * cos_i) * std::cos(turn);
          const double t = s > 0 ? std::max(cos_o, cos_i) : 1;
          sum += (1 + roughness * s / t) * cos_i;
        }
      }
      const double share = scale * sum * 2 / (rings * spokes);
      EXPECT_NEAR(oren_nayar::share(cos_o, roughness), share, 3e-5);  // midpoints: 1 / rings^2
      mean += 2 * share * cos_o / steps;
    }
    EXPECT_NEAR(oren_nayar::mean_share(roughness), mean, 2e-4);  // midpoints: 1 / (2 steps^2)
  }
}

// The paper's fit, g(cos), of its listing 1: "less than 0.1 % off".
TEST(OrenNayar, AlbedoMatchesThePapersFit) {
  for (const double roughness : {0.5, 1.0}) {
    for (double cosine = 0; cosine <= 1; cosine += 0.05) {
      const double c = 1 - cosine;
      const double g =
          c * (0.0571085289 + c * (0.491881867 + c * (-0.332181442 + c * 0.0714429953)));
      const double fit = (1 + roughness * g) / (1 + (0.5 - 2 / (3 * pi)) * roughness);
      EXPECT_NEAR(oren_nayar::share(cosine, roughness), fit, 1e-3 * fit);
    }
  }
}

TEST(Bsdf, RoughDiffuseKeepsItsReflectanceUnderUniformLight) {
  const Bsdf bsdf = bsdf_at(material("rough", RoughDiffuse{flat(0.3), 0.9}), 905);
  constexpr int steps = 24;
  double mean = 0;
  for (int i = 0; i < steps; ++i) {
    const double cosine = (i + 0.5) / steps;
    mean += 2 * cosine * albedo(bsdf, direction(cosine, 0)).x / steps;
  }
  EXPECT_NEAR(mean, 0.3, 3e-4);  // midpoints: 1 / (4 steps^2) of 0.3, and the inner quadrature
}

// Midpoints of 24 cosines integrate each albedo curve to 1 / (4 steps^2) of it; albedo() guarantees
// 1e-3.
TEST(Bsdf, MeanAlbedoIsTheReflectedFractionOfUniformLight) {
  constexpr int steps = 24;
  for (const Bsdf& bsdf : bsdfs_of(coloured_materials())) {
    glm::dvec3 mean(0);
    for (int i = 0; i < steps; ++i) {
      const double cosine = (i + 0.5) / steps;
      mean += 2 * cosine * albedo(bsdf, direction(cosine, 0)) / static_cast<double>(steps);
    }
    if (const auto* leaf = std::get_if<PlantLeafBsdf>(&bsdf.surface)) mean -= leaf->transmittance;
    for (glm::length_t k = 0; k < 3; ++k) EXPECT_NEAR(bsdf.albedo()[k], mean[k], 1.5e-3);
  }
}

TEST(Bsdf, ZeroRoughnessIsLambertian) {
  const Bsdf smooth = bsdf_at(material("smooth", RoughDiffuse{flat(0.3), 0}), 905);
  for (std::uint32_t i = 0; i < 100; ++i) {
    const glm::dvec3 wo = direction(uniform(3, i).x, 0);
    const glm::dvec3 wi = direction(uniform(4, i).x, 6 * uniform(4, i).y);
    EXPECT_NEAR(smooth.eval(wo, wi).x, 0.3 / pi, 4 * epsilon);
  }
}

// Light that hits facets repeatedly leaves with the same fraction each time, the mean fraction of
// white metal: a geometric series. The mean reflectance represents that of each hit; the angles of
// first hits change it by a few per cent.
TEST(Bsdf, RoughMetalAbsorbsAtEachBounce) {
  constexpr double n = 1.2, k = 2.5, alpha = 1;
  const Bsdf metal = bsdf_at(material("metal", Conductor{flat(n), flat(k), alpha}), 550);
  const double once = ggx::reflected_share(alpha, [](double) { return 1.0; }).mean();
  double reflectance = 0, found = 0;
  constexpr int steps = 24;
  for (int i = 0; i < steps; ++i) {
    const double cosine = (i + 0.5) / steps;
    reflectance += 2 * cosine * fresnel_reflectance(cosine, n, k) / steps;
    found += 2 * cosine * albedo(metal, direction(cosine, 0)).x / steps;
  }
  double expected = 0, left = reflectance;
  for (int meeting = 0; meeting < 100; ++meeting, left *= (1 - once) * reflectance)
    expected += left * once;
  EXPECT_NEAR(found, expected, 0.03 * expected);
}

// By Saunderson's fractions a reflectance of 0.3 falls, under a smooth film of water, to 0.0204
// (mirrored) plus 0.98 x 0.3 x 0.525 / (1 - 0.3 x 0.475). The deviation of a film that is not quite
// smooth lies within the tolerance.
TEST(Bsdf, WaterDarkensGround) {
  const Bsdf wet = bsdf_at(material("wet", Coated{flat(0.3), 4 / 3., 0.05}), 550);
  const double seen = albedo(wet, direction(0.999, 0)).x;
  const double outside = diffuse_reflectance(4 / 3.);
  const double let_out = (1 - outside) / (16 / 9.);
  const double entering = 1 - 1 / 49.;
  EXPECT_NEAR(seen, 1 / 49. + entering * 0.3 * let_out / (1 - 0.3 * (1 - let_out)), 3e-3);
  EXPECT_LT(seen, 0.22);
}

// Two independent implementations: the lidar's formula uses no vectors, the path tracer's is not
// specific to retro-reflection. Lidars take the albedos of rough diffuse surfaces from a table of
// 64 nodes with an error of at most 2e-4.
TEST(Bsdf, BackscatterMatchesTheLidarModel) {
  for (const Material& each : coloured_materials()) {
    const Bsdf bsdf = bsdf_at(each, 600);
    const RetroBrdf retro = retro_brdf(each, 600);
    for (double cosine = 0.01; cosine < 1; cosine += 0.01) {
      const glm::dvec3 w = direction(cosine, 1);
      const double expected = bsdf.eval(w, w).x * cosine;
      EXPECT_NEAR(retro_brdf_cos(retro, cosine), expected, 3e-4 * expected) << each.name;
    }
  }
}

TEST(Bsdf, TintMultipliesTheReflectanceOfAllButMetals) {
  const glm::dvec3 tint(0.5, 0.2, 1);
  for (const Bsdf& bsdf : bsdfs_of(coloured_materials())) {
    const glm::dvec3 wo = direction(0.6, 0), wi = direction(0.4, 2.5);
    const glm::dvec3 change = bsdf.eval(wo, wi, tint) / bsdf.eval(wo, wi);
    if (std::holds_alternative<ConductorBsdf>(bsdf.surface)) {
      EXPECT_EQ(change, glm::dvec3(1));
    } else if (std::holds_alternative<LambertianBsdf>(bsdf.surface) ||
               std::holds_alternative<PlantLeafBsdf>(bsdf.surface)) {
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(change[c], tint[c], 4 * epsilon);
    } else {
      EXPECT_LT(change.x, 1);
      EXPECT_LT(change.y, 1);
      EXPECT_EQ(change.z, 1);
    }
  }
}

TEST(Bsdf, DirectionsThatAreNotNumbersAreNoFault) {
  const glm::dvec3 nan(std::numeric_limits<double>::quiet_NaN());
  for (const Bsdf& bsdf : bsdfs_of(white_materials())) {
    EXPECT_EQ(bsdf.pdf_per_sr({0, 0, 1}, nan) > 0, false);
    EXPECT_EQ(bsdf.eval({0, 0, 1}, nan).x > 0, std::holds_alternative<PlantLeafBsdf>(bsdf.surface));
  }
}

TEST(Bsdf, PacksHaveTheBitsOfSingleDirections) {
  for (const auto* materials : {&white_materials(), &coloured_materials()}) {
    for (const Bsdf& bsdf : bsdfs_of(*materials)) {
      for (std::uint32_t i = 0; i < 4000; i += pack_size) {
        const auto of = [&](auto draw) {
          return vectors_of(
              [&](std::size_t lane) { return draw(i + static_cast<std::uint32_t>(lane)); });
        };
        const auto wo_of = [](std::uint32_t k) {  // some along the surface
          return k % 64 == 0 ? glm::dvec3(1, 0, 0) : any_direction(1, k);
        };
        const auto wi_of = [](std::uint32_t k) { return any_direction(2, k); };
        const auto tint_of = [](std::uint32_t k) { return glm::dvec3(2.0 * uniform(3, k), 1); };
        const auto u_of = [](std::uint32_t k) { return glm::dvec3(uniform(4, k), 0); };
        const Vec3<Pack> wo = of(wo_of), wi = of(wi_of), tint = of(tint_of), u = of(u_of);
        const Vec3<Pack> f = bsdf.eval(wo, wi, tint);
        const Pack density = bsdf.pdf_per_sr(wo, wi, tint);
        const auto drawn = bsdf.sample(wo, {u.x, u.y}, tint);
        for (std::size_t lane = 0; lane < pack_size; ++lane) {
          const auto k = i + static_cast<std::uint32_t>(lane);
          ASSERT_EQ(vector_at(f, lane), bsdf.eval(wo_of(k), wi_of(k), tint_of(k)));
          ASSERT_EQ(density[lane], bsdf.pdf_per_sr(wo_of(k), wi_of(k), tint_of(k)));
          const BsdfSample one = bsdf.sample(wo_of(k), glm::dvec2(u_of(k)), tint_of(k));
          ASSERT_EQ(drawn.pdf_per_sr[lane], one.pdf_per_sr);
          ASSERT_EQ(vector_at(drawn.weight, lane), one.weight);
          if (one.pdf_per_sr > 0) {
            ASSERT_EQ(vector_at(drawn.wi, lane), one.wi);
          }
        }
      }
    }
  }
}

TEST(Bsdf, ColourRequiresTheVisibleRange) {
  EXPECT_THAT(
      [] {
        bsdf_in_colour(material("brick", Lambertian{{{500, 0.2}, {905, 0.3}}}));
      },
      ThrowsMessage<Error>("Material 'brick': the spectrum reaches from 500 to 905 nm, but "
                           "not to 400 nm, which colours require"));
}

TEST(Bsdf, RetroReflectorIsBlackAwayFromTheSource) {
  const Bsdf bsdf = bsdf_in_colour(material("sheet", RetroReflector{250}));
  EXPECT_EQ(bsdf.eval({0, 0, 1}, direction(0.7, 1)), glm::dvec3(0));
  EXPECT_EQ(bsdf.sample({0, 0, 1}, {0.5, 0.5}).weight, glm::dvec3(0));
}

}  // namespace
}  // namespace groundray::bsdf_test
