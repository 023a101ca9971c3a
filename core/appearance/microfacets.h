#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>

#include "core/appearance/cosine_table.h"
#include "core/elementary.h"

// Private to this library: reflection by a rough surface of microfacets with the GGX distribution
// of normals (Trowbridge and Reitz) and height-correlated Smith masking-shadowing. Directions are
// unit vectors away from the surface and above it, z = normal.
// @see Walter et al., Microfacet models for refraction through rough surfaces (EGSR 2007); Heitz,
//      Understanding the masking-shadowing function in microfacet-based BRDFs (JCGT 2014).
namespace groundray::ggx {

/// Returns cos (1 + 2 Lambda), with Smith's Lambda, without a division by the cosine.
template <typename Real>
Real masked_cosine(const Real& cosine, double alpha) noexcept {
  using std::sqrt;
  return sqrt(cosine * cosine + alpha * alpha * (1.0 - cosine * cosine));
}

/// Returns the distribution of facet normals D(h), 1/sr: D(h) cos integrates to 1 over the
/// hemisphere.
template <typename Real>
Real normals_per_sr(const Vec3<Real>& h, double alpha) noexcept {
  const double alpha2 = alpha * alpha;
  const Real spread = alpha2 * h.z * h.z + (h.x * h.x + h.y * h.y);
  return alpha2 / (std::numbers::pi * spread * spread);
}

/// Returns D G2 / (4 cos_o cos_i), 1/sr: the BRDF of perfectly reflecting facets.
template <typename Real>
Real brdf_per_sr(const Vec3<Real>& wo, const Vec3<Real>& wi, double alpha) noexcept {
  const Real normals = normals_per_sr(unit_of(wo + wi), alpha);
  return normals / (2.0 * (wi.z * masked_cosine(wo.z, alpha) + wo.z * masked_cosine(wi.z, alpha)));
}

/// Returns brdf_per_sr times the cosine for light that returns to its source, 1/sr, as a function
/// of the cosine of its angle to the normal.
inline double retro_brdf_cos(double cosine, double alpha) noexcept {
  const double alpha2 = alpha * alpha;
  const double cos2 = cosine * cosine;
  const double spread = alpha2 * cos2 + (1 - cos2);
  return alpha2 / (4 * std::numbers::pi * spread * spread * masked_cosine(cosine, alpha));
}

/// Returns the direction into which a facet visible from `wo`, drawn by u in [0, 1)^2, reflects it.
/// The direction may lie below the surface.
/// @see Dupuy and Benyoub, Sampling visible GGX normals with spherical caps (HPG 2023).
template <typename Real>
Vec3<Real> sample(const Vec3<Real>& wo, double alpha, const Vec2<Real>& u) noexcept {
  using std::max;
  using std::sqrt;
  const Vec3<Real> stretched = unit_of(Vec3<Real>(alpha * wo.x, alpha * wo.y, wo.z));
  const Real z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
  const Vec2<Real> across = on_circle(u.x) * sqrt(max(1.0 - z * z, Real(0.0)));
  const Vec3<Real> normal = Vec3<Real>(across.x, across.y, z) + stretched;
  const Vec3<Real> h =
      unit_of(Vec3<Real>(alpha * normal.x, alpha * normal.y, max(normal.z, Real(1e-300))));
  return h * (2.0 * dot_of(wo, h)) - wo;
}

/// Returns the density of `sample`, 1/sr.
template <typename Real>
Real pdf_per_sr(const Vec3<Real>& wo, const Vec3<Real>& wi, double alpha) noexcept {
  const Real normals = normals_per_sr(unit_of(wo + wi), alpha);
  return normals / (2.0 * (wo.z + masked_cosine(wo.z, alpha)));
}

/// Returns brdf_per_sr cos_i / pdf_per_sr of a sampled direction: at most 1; 0 below the surface.
inline double sample_weight(const glm::dvec3& wo, const glm::dvec3& wi, double alpha) noexcept {
  if (!(wi.z > 0)) return 0;
  const double masked_o = masked_cosine(wo.z, alpha);
  return wi.z * (wo.z + masked_o) / (wi.z * masked_o + wo.z * masked_cosine(wi.z, alpha));
}

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
inline double scale(double roughness) noexcept {
  return 1 / (1 + (0.5 - 2 / (3 * std::numbers::pi)) * roughness);
}

/// Returns the fraction of the incident light that leaves the surface, given the cosine of the
/// angle of incidence.
template <typename Real>
Real share(const Real& cosine, double roughness) noexcept {
  using std::max;
  using std::min;
  using std::sqrt;
  const Real c = min(max(cosine, Real(0.0)), Real(1.0));
  const Real s = sqrt(1.0 - c * c);
  // tan(theta) (1 - s^3) of the paper, rewritten without the division by the cosine
  const Real steep = s * c * (1.0 + s + s * s) / (1.0 + s);
  const Real g = s * (angle_of_cosine(c) - s * c) + 2.0 / 3 * (steep - s);
  return scale(roughness) * (1.0 + roughness * g / std::numbers::pi);
}

/// Returns the mean of `share` under uniform illumination.
inline double mean_share(double roughness) noexcept {
  return scale(roughness) * (1 + roughness * (2.0 / 3 - 28 / (15 * std::numbers::pi)));
}

/// Returns the albedo of the facets for which the whole surface has the given albedo under uniform
/// illumination, multiple scattering included.
template <typename Value>
Value facet_albedo(const Value& albedo, double mean_share) noexcept {
  return albedo / (Value(mean_share) + albedo * Value(1 - mean_share));
}

}  // namespace groundray::oren_nayar
