#pragma once

// Internal: directional albedo of a rough surface of white Lambertian facets for single scattering,
// in Fujii's form of the Oren-Nayar model (docs/reference/materials.md):
// f = A / pi (1 + roughness s / t), s = wo . wi - cos_o cos_i, and t = max(cos_o, cos_i), or 1 if
// s < 0.
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
