#pragma once

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "core/appearance/cosine_table.h"

// Private to this library: reflection by a rough surface of microfacets with the GGX distribution
// of normals (Trowbridge and Reitz) and height-correlated Smith masking-shadowing. Directions are
// unit vectors away from the surface and above it, z = normal.
// @see Walter et al., Microfacet models for refraction through rough surfaces (EGSR 2007); Heitz,
//      Understanding the masking-shadowing function in microfacet-based BRDFs (JCGT 2014).
namespace groundray::ggx {

/// Returns the distribution of facet normals D(h), 1/sr: D(h) cos integrates to 1 over the
/// hemisphere.
double normals_per_sr(const glm::dvec3& h, double alpha) noexcept;

/// Returns D G2 / (4 cos_o cos_i), 1/sr: the BRDF of perfectly reflecting facets.
double brdf_per_sr(const glm::dvec3& wo, const glm::dvec3& wi, double alpha) noexcept;

/// Returns brdf_per_sr times the cosine for light that returns to its source, 1/sr, as a function
/// of the cosine of its angle to the normal.
double retro_brdf_cos(double cosine, double alpha) noexcept;

/// Returns the direction into which a facet visible from `wo`, drawn by u in [0, 1)^2, reflects it.
/// The direction may lie below the surface.
/// @see Dupuy and Benyoub, Sampling visible GGX normals with spherical caps (HPG 2023).
glm::dvec3 sample(const glm::dvec3& wo, double alpha, const glm::dvec2& u) noexcept;

/// Returns the density of `sample`, 1/sr.
double pdf_per_sr(const glm::dvec3& wo, const glm::dvec3& wi, double alpha) noexcept;

/// Returns brdf_per_sr cos_i / pdf_per_sr of a sampled direction: at most 1; 0 below the surface.
double sample_weight(const glm::dvec3& wo, const glm::dvec3& wi, double alpha) noexcept;

/// Returns the directional albedo of single scattering, by the cosine of incidence.
/// @param fresnel  returns the reflectance of a facet by the cosine of incidence on it.
template <typename Fresnel>
CosineTable<float> reflected_share(double alpha, Fresnel fresnel) {
  constexpr int turns = 48;
  constexpr int slopes = 64;  // gives an error of 5e-4 (test/core/appearance/bsdf_test.cpp)
  return CosineTable<float>([&](double cosine) {
    const double c = cosine > 0 ? cosine : 1e-9;
    const glm::dvec3 wo(glm::sqrt(1 - c * c), 0, c);
    double sum = 0;
    for (int k = 0; k < slopes; ++k) {
      const double root = (k + 0.5) / slopes;  // of 1 - u.y: dense where facets are steep
      for (int i = 0; i < turns; ++i) {
        const double turn = (i + 0.5) / (2 * turns);  // half a turn is enough by symmetry
        const glm::dvec3 wi = sample(wo, alpha, {turn, 1 - root * root});
        const double weight = 2 * root * sample_weight(wo, wi, alpha);
        if (weight > 0) sum += weight * fresnel(glm::dot(wo, glm::normalize(wo + wi)));
      }
    }
    return static_cast<float>(sum / (turns * slopes));
  });
}

}  // namespace groundray::ggx

// Private to this library: directional albedo of a rough surface of white Lambertian facets for
// single scattering, in Fujii's form of the Oren-Nayar model (docs/reference/materials.md): f = A /
// pi (1 + roughness s / t), s = wo . wi - cos_o cos_i, and t = max(cos_o, cos_i), or 1 if s < 0.
// @see Portsmouth, Kutz and Hill, EON: a practical energy-preserving rough diffuse BRDF (JCGT
//      2025).
namespace groundray::oren_nayar {

/// Returns the factor A.
double scale(double roughness) noexcept;

/// Returns the fraction of the incident light that leaves the surface, given the cosine of the
/// angle of incidence.
double share(double cosine, double roughness) noexcept;

/// Returns the mean of `share` under uniform illumination.
double mean_share(double roughness) noexcept;

/// Returns the albedo of the facets for which the whole surface has the given albedo under uniform
/// illumination, multiple scattering included.
template <typename Value>
Value facet_albedo(const Value& albedo, double mean_share) noexcept {
  return albedo / (mean_share + albedo * (1 - mean_share));
}

}  // namespace groundray::oren_nayar
